"""Effects on a user's deck: numbers and gauges of the parts that its case names in
``deck.parts``."""

from __future__ import annotations

from collections.abc import Callable, Collection

from ...errors import InputError
from ..case import LoadedCase
from ..own_deck.numbers import moduli, modulus_sign
from ..own_deck.solver_deck import SolverDeck
from ..own_deck.text import OwnDeckError
from .edit import changed, with_part

Change = Callable[[str, float], float]  # a field's or a layer's name and a number to a new one


def stiffer(factor: float, bulk: bool) -> Change:
    """Shear constants times a factor; with ``bulk`` the bulk modulus 2 / D1 too."""

    def change(field: str, number: float) -> float:
        if modulus_sign(field) < 0:  # D1; 1: a shear constant; 0: none of these
            return number / factor if bulk else number
        return factor * number if modulus_sign(field) else number

    return change


def with_compounds(case: LoadedCase, part: str, option: str, change: Change) -> LoadedCase:
    """The case with the numbers of an option, such as HYPERELASTIC, changed in a part's compounds,
    or, if ``part`` is "", in all.

    Raises InputError where a compound of the part is of others, too, or has marks for numbers.
    """
    numbers, flat, sets = _read(case, part)
    material_of = dict(zip(map(str.upper, flat.sections), flat.materials, strict=True))
    sets = _known(part, sets, material_of) if part else list(material_of)
    for name in {material_of[own] for own in sets}:
        others = [own for own, m in material_of.items() if m == name and own not in sets]
        if others:
            raise InputError(f"needs a material of its own in {part}: {name} is of {others[0]} too")
        start = f"material {name} / {option} / "
        paths = [path for path in numbers if path.startswith(start)]
        if not paths:
            raise InputError(f"needs plain numbers of {start.removesuffix(' / ')}, not marks")
        for path in paths:
            numbers[path] = change(path.rpartition(" / ")[2], numbers[path])
    return _with(case, numbers)


def with_prony(case: LoadedCase, shear: float, tau_s: float) -> LoadedCase:
    """The case with one Prony term in all compounds, which leaves the relaxed state and makes what
    is faster than ``tau_s`` ``shear`` times as stiff in shear: G0 = G_relaxed / (1 - g). Raises
    InputError."""
    numbers, flat, _ = _read(case, "")
    long_term: set[str] = set()
    material = ""
    for block in flat.blocks.model:
        if block.name == "MATERIAL":
            material = block.get("NAME")
        elif block.name == "HYPERELASTIC" and block.get("MODULI") != "INSTANTANEOUS":
            long_term.add(material)
    for name in dict.fromkeys(flat.materials):
        start = f"material {name} / VISCOELASTIC / "
        own = [path for path in numbers if path.startswith(start)]
        times = [path for path in own if path.endswith(" / tau")]
        if not times or name not in long_term:
            raise InputError(
                f"needs a Prony series of {name} in plain numbers, and its MODULI=LONG TERM"
            )
        numbers |= dict.fromkeys(own, 0.0) | dict.fromkeys(times, tau_s)
        numbers[times[0].removesuffix("tau") + "g"] = 1 - 1 / shear
    return _with(case, numbers)


def stresses(case: LoadedCase) -> list[str]:
    """Paths of all materials' moduli, except D1. Raises InputError where one has only marks."""
    numbers, flat, _ = _read(case, "")
    result = []
    for name in dict.fromkeys((*flat.materials, *(ply.material for ply in flat.plies))):
        own = [path for path, sign in moduli(numbers, name).items() if sign > 0]
        if not own:
            raise InputError(f"needs plain numbers of material {name}, not marks")
        result += own
    return result


def with_angles(case: LoadedCase, part: str, change: Change) -> LoadedCase:
    """The case with the angles of a part's layers changed, by their names. Raises InputError."""
    numbers, flat, sets = _read(case, part)
    sets = _known(part, sets, [ply.set_name.upper() for ply in flat.plies])
    for ply in flat.plies:
        if ply.set_name.upper() in sets:
            path = f"rebar {ply.name} / angle"
            path = path if path in numbers else f"section {ply.set_name} / {path}"
            if path not in numbers:
                raise InputError(f"needs a plain number for the angle of {ply.name}, not a mark")
            numbers[path] = change(ply.name, numbers[path])
    return _with(case, numbers)


def with_thickness(case: LoadedCase, part: str, factor: float) -> LoadedCase:
    """The case with a part, tread or sidewall, so many times as thick. Raises InputError."""
    numbers, flat, sets = _read(case, part)
    deck = case.kind.source(case.case)
    _known(part, sets, [name.upper() for name in flat.sections])
    thicker = with_part(deck.gauges, **{part: factor * getattr(deck.gauges, part)})
    deck = with_part(deck, gauges=thicker)
    try:
        case.kind.deck.flat(numbers, deck.thickened)
    except OwnDeckError as error:
        raise InputError(f"cannot be: {error.message}") from None
    return changed(case, deck=deck)


def _read(case: LoadedCase, part: str) -> tuple[dict[str, float], SolverDeck, list[str]]:
    """The deck's numbers by path or mark, the flat deck, and the sets of a part, in capitals."""
    numbers = dict(case.deck_numbers)
    return numbers, case.kind.deck.flat(numbers), case.kind.source(case.case).sets(part)


def _known(part: str, sets: list[str], known: Collection[str]) -> list[str]:
    """The sets of a part. Raises InputError for one that is no section's."""
    for name in sets:
        if name not in known:
            raise InputError(
                f"needs sets of sections in deck.parts.{part}: {name} is none of {', '.join(known)}"
            )
    return sets


def _with(case: LoadedCase, numbers: dict[str, float]) -> LoadedCase:
    return changed(case, deck=with_part(case.kind.source(case.case), numbers=numbers))
