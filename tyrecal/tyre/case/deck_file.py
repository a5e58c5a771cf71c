"""The deck that a case names: it must lie in its folder, and be read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..own_deck.numbers import as_known, marked_numbers
from ..own_deck.own_deck import OwnDeck, Units, read_own_deck
from ..own_deck.own_decks import PRESSURE_MARK, OwnDecks, read_own_decks
from ..own_deck.text import OwnDeckError
from .document import Document
from .mistakes import Mistake, suggestion
from .parts import DeckSource
from .shape import entries, table
from .stations import inside

if TYPE_CHECKING:
    from ..section.section import Section


def read_deck_of(
    document: Document, data: dict[str, Any], folder: Path
) -> tuple[OwnDeck | OwnDecks | None, bool]:
    """The deck, or the decks in three dimensions, that the case names, and whether their numbers
    are known: all of them are put into ``data``. None, with the mistakes recorded, where they are
    wrong or there are none."""
    source = table(data, "deck")
    names = entries(source, "decks") or [source.get("file")]
    key = "decks" if entries(source, "decks") else "file"
    if not all(isinstance(name, str) for name in names):
        return None, True
    before = len(document.mistakes)
    deck: OwnDeck | OwnDecks | None = None
    units = source.get("units")
    try:
        paths = [inside(folder, name) for name in names]
        if missing := [path.name for path in paths if not path.is_file()]:
            named = f"'{missing[0]}' " * (key == "decks")
            raise ValueError(f"{named}must be a file, there is none of this name")
        first = read_own_deck(paths[0], units if units in ("m", "mm") else None)
        source.setdefault("units", first.units)
        deck = _read(paths, source, first.units) if key == "decks" else first
        numbers = table(source, "numbers")
        given = {k: v for k, v in numbers.items() if isinstance(v, int | float)}
        idle = deck.idle if isinstance(deck, OwnDeck) else {}
        known = deck.section_numbers if isinstance(deck, OwnDeck) else deck.numbers
        for name in given:
            if name not in deck.marks and name not in known:
                hint = suggestion(name, [*deck.marks, *known], "")
                message = idle.get(name, f"is no mark and no number of the deck{hint}")
                document.add(("deck", "numbers", name), message)
        for variable in table(data, "variables").values():  # a mark's value may be its start
            given |= marked_numbers(deck.marks, given, variable)
        source["numbers"] = {**known, **given}
        for entry in (*table(data, "variables").values(), *table(data, "uncertainties").values()):
            if isinstance(sets := entry.get("sets") if isinstance(entry, dict) else None, list):
                entry["sets"] = [as_known(path, source["numbers"]) for path in sets]
        pressure = {PRESSURE_MARK} if isinstance(deck, OwnDecks) else set()
        lacking = [name for name in deck.marks if name not in {*given, *pressure}]
        for name in lacking:
            file, line = deck.marks[name].place
            message = f"the mark {name} has no number: give it in deck.numbers"
            mistake = Mistake(str(paths[0].parent / file), line, "", f"{{{{ {name} }}}}", message)
            document.mistakes.append(mistake)
        if lacking:
            pass
        elif isinstance(deck, OwnDeck):
            deck.flat(given)
        elif deck.crown.rpartition(".")[2] not in deck.node_sets:  # INSTANCE.SET
            hint = suggestion(deck.crown, deck.node_sets)
            document.add(("deck", "crown"), f"is no node set of the decks{hint}")
        else:
            deck.check(given)
    except OwnDeckError as error:
        place = error.place
        file = str(paths[0].parent / place.file)
        document.mistakes.append(Mistake(file, place.line, "", "", error.message))
    except ValueError as error:
        document.add(("deck", key), str(error))
    except OSError as error:
        document.add(("deck", key), f"cannot be read: {error.strerror}")
    return (None if len(document.mistakes) > before else deck), deck is not None


def lines_of_the_deck(deck: OwnDeck | OwnDecks | None, data: Mapping[str, Any]) -> dict[str, Any]:
    """Keys that a case of a deck may leave out, with values of the deck, or usual ones.

    A deck that is wrong (None) has values that only keep its case from being blamed for it.
    """
    source = table(data, "deck")
    name, kind = Path(str(source.get("file"))).stem, "bundled"
    pressure: dict[str, Any] = {"pressure_kPa": 200.0}
    rim: dict[str, Any] = {"reference_point_m": {"r": 0.0, "z": 0.0}}
    analysis: dict[str, Any] = {}
    if isinstance(deck, OwnDeck):
        flat = deck.flat(source["numbers"])
        pressure["pressure_kPa"] = flat.pressure_Pa / 1e3
        rim["reference_point_m"] = dict(zip("rz", flat.mesh.reference, strict=True))
        analysis = {"static_moduli": flat.static_moduli}
    elif deck is not None:  # they say how the rim is held, and what is computed
        name, kind = deck.path.stem, "abaqus"
        pressure = {"pressure_kPa": deck.pressure_Pa / 1e3} if deck.pressures else {}
    limit = 3600.0 if kind == "abaqus" else 300.0
    return {
        "name": name,
        "size": "not given",
        **pressure,
        "deck": {"units": source.get("units")},
        "rim": rim,
        "analysis": analysis,
        "solver": {"name": kind, "time_limit_s": limit},
    }


def completed(data: dict[str, Any], lines: Mapping[str, Any]) -> dict[str, Any]:
    """Put the ``lines`` that ``data`` lacks into it; those."""
    lacking: dict[str, Any] = {}
    for key, value in lines.items():
        if key not in data:
            data[key] = deepcopy(value)
            lacking[key] = value
        elif isinstance(value, dict) and isinstance(data[key], dict):
            lacking[key] = {k: deepcopy(v) for k, v in value.items() if k not in data[key]}
            data[key].update(lacking[key])
    return {key: value for key, value in lacking.items() if value != {}}


def _read(paths: Sequence[Path], source: dict[str, Any], units: Units) -> OwnDecks:
    crown = source.get("crown", DeckSource.model_fields["crown"].default)
    return read_own_decks(paths, units, crown if isinstance(crown, str) else "")


def section_of(deck: OwnDeck, data: dict[str, Any]) -> Section:
    """The section that a deck draws."""
    from ..own_deck.section_mesh import section

    return section(deck.flat(data["deck"]["numbers"]))
