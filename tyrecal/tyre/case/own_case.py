"""The case of a user's deck, ready to be written next to it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from ...errors import InputError
from ..own_deck.own_deck import OwnDeck
from ..own_deck.own_decks import OwnDecks
from ..own_deck.solver_deck import SolverDeck
from ..templates import TemplateNames, environment, render
from .case_text import plain_text

NO_NUMBERS: Mapping[str, float] = MappingProxyType({})
RANGE = 5.0  # bounds of a variable: its start divided and multiplied by this


def own_case(
    deck: OwnDeck,
    flat: SolverDeck,
    size: str,
    pressure_kPa: float | None,
    numbers: Mapping[str, float] = NO_NUMBERS,
) -> str:
    """YAML of a case whose deck is ``deck``: what a fit most often changes is a variable, the
    marks, the layers' areas and the rubbers' first constants. flat: the same deck as the solvers
    get it; pressure_kPa None: the deck's; numbers: of the marks. Variables of the deck's numbers
    are in its own units."""
    r, z = flat.mesh.reference  # node of the rim, m
    return _text(
        [deck],
        deck.numbers,
        numbers,
        size,
        flat.pressure_Pa / 1e3 if pressure_kPa is None else pressure_kPa,
        _variables(deck.numbers, {ply.name: ply.material for ply in flat.plies}, flat.materials),
        static_moduli=flat.static_moduli,
        r=r,
        z=z,
    )


def own_decks_case(
    decks: OwnDecks,
    size: str,
    pressure_kPa: float | None,
    numbers: Mapping[str, float] = NO_NUMBERS,
) -> str:
    """The case of decks in three dimensions. Raises InputError where they do not give the crown or
    the pressure."""
    if decks.crown.rpartition(".")[2] not in decks.node_sets:
        known = ", ".join(decks.node_sets)
        raise InputError(
            f"the decks have no node set {decks.crown}: name that of the crown's centre line by"
            f" --crown-set; they have {known or 'none'}"
        )
    decks.check(numbers)
    if pressure_kPa is None and not decks.pressures:
        raise InputError("the decks have a mark in place of the pressure: give --pressure-kPa")
    blocks = decks.blocks
    # fields of *REBAR LAYER: name, area, spacing, position, material, angle
    layers = {r.name(0): r.name(4) for b in blocks if b.name == "REBAR LAYER" for r in b.rows}
    materials = [b.get("NAME") for b in blocks if b.name == "MATERIAL"]
    return _text(
        decks.decks,
        decks.numbers,
        numbers,
        size,
        decks.pressure_Pa / 1e3 if pressure_kPa is None else pressure_kPa,
        _variables(decks.numbers, layers, materials),
        crown=decks.crown,
    )


def _text(
    decks: Sequence[OwnDeck],
    numbers: Mapping[str, float],
    marked: Mapping[str, float],
    size: str,
    pressure_kPa: float,
    variables: Mapping[str, Sequence[str]],
    **more: Any,
) -> str:
    """Text of the case file for a user's decks: plain ``numbers`` by path, ``marked`` ones by mark;
    ``crown`` in ``more`` if they are in three dimensions."""
    env = environment("case", None)
    env.filters["text"] = plain_text
    all_numbers = {**numbers, **{f"deck.numbers.{name}": x for name, x in marked.items()}}
    # a variable's scale is logarithmic: only positive numbers have one
    of_marks = {name: [f"deck.numbers.{name}"] for name, x in marked.items() if x > 0}
    names: TemplateNames = {
        "files": [deck.path.name for deck in decks],
        "decks": "crown" in more,
        "units": decks[0].units,
        "name": decks[-1].path.stem,
        "size": size,
        "pressure_kPa": pressure_kPa,
        "numbers": marked,
        "variables": [
            {
                "name": name,
                "sets": paths,
                "start": all_numbers[paths[0]],
                "lower": all_numbers[paths[0]] / RANGE,
                "upper": all_numbers[paths[0]] * RANGE,
            }
            for name, paths in {**of_marks, **variables}.items()
        ],
        **more,
    }
    return render(env, "own_deck.yaml.j2", names)


def _variables(
    numbers: Mapping[str, float], cords: Mapping[str, str], materials: Sequence[str]
) -> dict[str, list[str]]:
    """Paths by the name of the variable that sets them: layers of one cord and area are one.
    cords: the material of each layer. mu, mu1: shear moduli of Arruda-Boyce and Ogden."""
    by_name: dict[str, list[str]] = {}
    groups: dict[tuple[str, float], list[str]] = {}
    for path, value in numbers.items():
        head, _, field = path.rpartition(" / ")
        if field == "area":
            of = cords.get(head.rpartition("rebar ")[2], "")
            groups.setdefault((of, value), []).append(path)
    for (material, _), paths in groups.items():
        by_name[_name(f"A_{material}", by_name)] = paths
    for material in dict.fromkeys(materials):
        for field in ("C10", "mu", "mu1"):
            path = f"material {material} / HYPERELASTIC / {field}"
            if numbers.get(path, 0.0) > 0:
                by_name[_name(f"{field}_{material}", by_name)] = [path]
    return by_name


def _name(words: str, taken: dict[str, list[str]]) -> str:
    """A variable's name made of ``words``, numbered where it is taken."""
    plain = re.sub(r"\W", "_", words)[:50]
    count = sum(name.startswith(plain) for name in taken)
    return f"{plain}_{count + 1}" if plain in taken else plain
