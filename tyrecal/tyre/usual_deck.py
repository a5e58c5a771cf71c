"""Usual ranges of the numbers of a user's deck, in the deck's own units.

A slip of units in a deck, as cords of 172,200 Pa, is computed like any other number. The ranges are
those of a case's numbers (`usual.py`); ``load`` judges the deck's text with them, ``values`` what
--set gives. ``init --deck`` and every command on such a case so refuse the same numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from .case.mistakes import Mistake
from .own_deck.own_deck import OwnDeck
from .usual import ALL_THE_SAME, STRESS, USUAL, Usual

RADIUS_m = Usual(0.1, 1.2, "m")  # of the outermost node
# Linear elastic materials that are no cords: rubber from 0.5 MPa, rims and bead wires of steel.
ELASTIC = Usual(5e5, 3e11, "Pa", STRESS)
OF_FIELD = {  # the end of a number's path: its range
    "ELASTIC / E": ELASTIC,
    "HYPERELASTIC / C10": USUAL["materials.*.C10_Pa"],
    "HYPERELASTIC / C01": USUAL["materials.*.C01_Pa"],
    "HYPERELASTIC / D1": USUAL["materials.*.D1_per_Pa"],
    "DENSITY / density": USUAL["materials.*.density_kg_per_m3"],
    "VISCOELASTIC / g": USUAL["materials.*.prony.*.g"],
    "VISCOELASTIC / k": USUAL["materials.*.prony.*.k"],
    "VISCOELASTIC / tau": USUAL["materials.*.prony.*.tau_s"],
    "area": USUAL["rebar_layers.*.area_m2"],
    "spacing": USUAL["rebar_layers.*.spacing_m"],
}
CORD_MODULUS = USUAL["materials.*.youngs_modulus_Pa"]
ANGULAR_SPACING = USUAL["rebar_layers.*.spacing_deg"]
UNITS_mm = {  # in a deck in mm, t, s: the unit's name, and SI in one of it
    "Pa": ("MPa", 1e6),
    "1/Pa": ("1/MPa", 1e-6),
    "kg/m3": ("t/mm3", 1e12),
    "m2": ("mm2", 1e-6),
    "m": ("mm", 1e-3),
}


def usual_numbers(deck: OwnDeck) -> dict[str, Usual]:
    """The usual ranges of a deck's plain numbers by path, of those that have one."""
    cords, angular = _cords(deck), _angular(deck)
    ranges = {}
    for path in deck.numbers:
        *_, owner, last = words = [word.strip() for word in path.split("/")]
        first = words[0]
        field = re.sub(r"^material .*? / ", "", path)
        field = re.sub(r" / row \d+ / ", " / ", field)
        usual = OF_FIELD.get(field if first.startswith("material ") else last)
        if field == "ELASTIC / E" and first.removeprefix("material ") in cords:
            usual = CORD_MODULUS
        if last == "spacing" and owner.removeprefix("rebar ") in angular:
            usual = ANGULAR_SPACING
        if usual and (first.startswith("material ") or owner.startswith("rebar ")):
            ranges[path] = _in_units(usual) if deck.units == "mm" else usual
    return ranges


def unusual_numbers(deck: OwnDeck, numbers: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Paths of the numbers that are outside their usual ranges, and what is usual."""
    for path, usual in usual_numbers(deck).items():
        if path in numbers and (message := usual.refusal(numbers[path])):
            yield path, message + ALL_THE_SAME


def deck_slips(deck: OwnDeck, numbers: Mapping[str, float]) -> Iterator[Mistake]:
    """The deck's radius and numbers that are not usual, each at its line of the deck."""
    radius = max(r for r, _ in deck.flat(numbers).mesh.nodes.values())
    if message := RADIUS_m.refusal(radius):
        words = f"radius of the outermost node is {radius:.3g} m in these units: {message}"
        yield Mistake(str(deck.path), 0, "", "", words + ALL_THE_SAME)
    for path, message in unusual_numbers(deck, numbers):
        block, row, _ = deck.places[path]
        place = deck.blocks[block].rows[row].place
        file = str(deck.path.parent / place.file)
        yield Mistake(file, place.line, path, f"{numbers[path]:g}", message)


def _cords(deck: OwnDeck) -> set[str]:
    """Materials of the deck's layers of rebar."""
    rows = (row for block in deck.blocks if block.name == "REBAR LAYER" for row in block.rows)
    return {row.name(4) for row in rows} | {
        block.get("MATERIAL") for block in deck.blocks if block.name == "REBAR"
    }


def _angular(deck: OwnDeck) -> set[str]:
    """Layers whose spacing is an angle."""
    blocks = (block for block in deck.blocks if block.name == "REBAR LAYER")
    return {
        row.name(0)
        for block in blocks
        if block.parameters.get("GEOMETRY", "").upper() == "ANGULAR"
        for row in block.rows
    }


def _in_units(usual: Usual) -> Usual:
    """A range in SI as that of a deck in mm, t, s."""
    if usual.unit not in UNITS_mm:
        return usual
    name, size = UNITS_mm[usual.unit]
    slips = {
        unit: slip / size
        for unit, slip in usual.slips.items()
        if not callable(slip) and unit != name
    }
    return replace(
        usual,
        low=usual.low / size,
        high=usual.high / size,
        least=usual.least / size,
        unit=name,
        slips={usual.unit: 1 / size, **slips},
    )
