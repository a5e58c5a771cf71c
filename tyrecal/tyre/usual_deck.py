"""Usual ranges of the numbers of a user's deck, in the deck's own units.

A slip of units in a deck, as cords of 172,200 Pa, is computed like any other number. The ranges are
those of a case's numbers (`usual.py`); ``load`` judges the deck's text with them, ``values`` what
--set gives. ``init --deck`` and every command on such a case so refuse the same numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import isclose, radians

from ..units import LENGTH
from .case.mistakes import Mistake
from .own_deck.numbers import acting_parameters, marks
from .own_deck.own_deck import UNIT_LENGTH, UNIT_MASS, OwnDeck
from .own_deck.scope import corner_areas
from .own_deck.solver_deck import RebarPly, SolverDeck
from .usual import (
    ALL_THE_SAME,
    BELT_ANGLE,
    CARCASS_ANGLE,
    RUBBER_DENSITY,
    STRESS,
    USUAL,
    CordLayer,
    Usual,
    constant_beside,
    cord_modulus,
    holds_angle,
    in_series,
    one_side,
)

RADIUS_m = Usual(0.1, 1.2, "m")  # of the outermost node
# Linear elastic materials that are no cords: rubber from 0.5 MPa, rims and bead wires of steel.
ELASTIC = Usual(5e5, 3e11, "Pa", STRESS)
OF_FIELD = {  # the end of a number's path: its range
    "ELASTIC / E": ELASTIC,
    "HYPERELASTIC / lambda_m": Usual(1, 30),
    "ELASTIC / nu": USUAL["materials.*.poissons_ratio"],
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
SHEAR_TERMS = {"C10": 2.0, "C01": 2.0, "mu": 1.0} | {f"mu{i}": 1.0 for i in range(1, 7)}
"""Constants of *HYPERELASTIC, and the factor with which each adds to the shear modulus."""
OVER_THE_CROWN = 0.35  # of a section's height: how far down from the crown a belt may reach
# degrees from the meridian; cords at less may be a piece of a carcass that is given in pieces
MIN_BELT_ANGLE = 10.0
EXPONENT = Usual(-50, 50, least=0.1)  # of Ogden's law
HIGHER_ORDER = 10.0  # times the constants of the shear modulus
REACH_OF_RADIUS = 0.7, 1.1  # of the section's, for one at which a spacing was measured
ANY_CONSTANT = Usual(-1e9, 1e9, "Pa", STRESS)
MEMBRANE = Usual(1e-7, 5e-3, "m", LENGTH)  # thin ones only bear cords
ANGULAR_SPACING = USUAL["rebar_layers.*.spacing_deg"]
UNITS_mm = {  # in a deck in mm, t, s: the unit's name, and SI in one of it
    "Pa": ("MPa", 1e6),
    "1/Pa": ("1/MPa", 1e-6),
    "kg/m3": ("t/mm3", 1e12),
    "m2": ("mm2", 1e-6),
    "m": ("mm", 1e-3),
}


def usual_numbers(deck: OwnDeck, flat: SolverDeck) -> dict[str, Usual]:
    """The usual ranges of a deck's plain numbers by path, of those that have one; ``flat`` is the
    deck that they make."""
    cords = {ply.material for ply in flat.plies}
    angular, angles = _angular(deck), _angles(flat)
    layers = _layers(flat, angles)
    shares = _shares(flat)
    ranges = {}
    for path in deck.numbers:
        *_, owner, last = words = [word.strip() for word in path.split("/")]
        first = words[0]
        material = first.removeprefix("material ")
        layer = owner.removeprefix("rebar ")
        field = re.sub(r"^material .*? / ", "", path)
        field = re.sub(r" / row \d+ / ", " / ", field)
        usual = OF_FIELD.get(field if first.startswith("material ") else last)
        if field == "ELASTIC / E" and material in cords:
            own = (layer for ply, layer in layers.items() if ply.material == material)
            usual = cord_modulus(_density(deck, first), own)
        if field.startswith("HYPERELASTIC") and material in cords:
            continue  # the solver refuses such cords
        if field.startswith("VISCOELASTIC"):
            usual = _in_series(usual, deck, path)
        if field == "DENSITY / density" and material not in cords and _shear_terms(deck, first):
            usual = RUBBER_DENSITY
        if field == f"HYPERELASTIC / {last}" and last in SHEAR_TERMS:
            share = shares.get(material, 0.0)
            usual = _beside_others(usual or ANY_CONSTANT, deck, first, last, share)
        elif field == f"HYPERELASTIC / {last}" and re.fullmatch(r"C\d\d", last):
            usual = _higher_order(deck, first)
        elif field == f"HYPERELASTIC / {last}" and last.startswith("alpha"):
            usual = EXPONENT
        if last == "spacing" and layer in angular:
            usual = ANGULAR_SPACING
        if last == "area":
            area = deck.numbers[path] * UNIT_LENGTH[deck.units] ** 2
            for ply, each in layers.items():
                if ply.name == layer.split()[0] and isclose(each.area, area):
                    usual = each.usual_area
        if last == "radius":
            usual = _radii(flat)
        if last == "angle":
            usual = angles.get((layer.split()[0], deck.numbers[path]))
        if usual and (first.startswith("material ") or owner.startswith("rebar ")):
            ranges[path] = _in_units(usual) if deck.units == "mm" else usual
    return ranges


def unusual_numbers(deck: OwnDeck, numbers: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Paths of the numbers that are outside their usual ranges, marks and parameters that give
    them, and what is usual."""
    plain = _plain(deck, numbers)
    defined = [block for block in deck.blocks if block.name == "PARAMETER"]
    for path, message in _unusual(plain, plain.flat({})):
        yield path, message
        if path:
            k, i, _ = plain.places[path]
            own = replace(deck.blocks[k], rows=[deck.blocks[k].rows[i]])
            acting = acting_parameters([*defined, own])
            names = (each for each in deck.numbers if each.startswith("parameter / "))
            given = [name for name in names if name.partition(" / ")[2].upper() in acting]
            yield from ((name, f"{path}: {message}") for name in (*marks([own]), *given))


def deck_slips(deck: OwnDeck, numbers: Mapping[str, float]) -> Iterator[Mistake]:
    """The deck's radius and numbers that are not usual, each at its line of the deck."""
    plain = _plain(deck, numbers)
    flat = plain.flat({})
    radius = max(r for r, _ in flat.mesh.nodes.values())
    if message := RADIUS_m.refusal(radius):
        words = f"radius of the outermost node is {radius:.3g} m in these units: {message}"
        yield Mistake(str(deck.path), 0, "", "", words + ALL_THE_SAME)
    yield from _membranes(plain)
    for path, message in _unusual(plain, flat):
        block, row, _ = plain.places[path]
        place = plain.blocks[block].rows[row].place
        file = str(deck.path.parent / place.file)
        yield Mistake(file, place.line, path, f"{plain.numbers[path]:g}", message)


def _plain(deck: OwnDeck, numbers: Mapping[str, float]) -> OwnDeck:
    """The deck with numbers, marks and parameters set. Raises OwnDeckError."""
    return replace(deck, blocks=tuple(deck.with_numbers(numbers)))


def _unusual(deck: OwnDeck, flat: SolverDeck) -> Iterator[tuple[str, str]]:
    """`unusual_numbers` of a deck without marks, and of the deck that they make."""
    last_belt, judged = "", set[str]()  # materials whose shear modulus was refused
    for path, usual in usual_numbers(deck, flat).items():
        value = deck.numbers[path]
        if usual is BELT_ANGLE:
            last_belt = path
        material, is_of_sum = path.rpartition(" / ")[0], "shear modulus" in usual.reason
        if (path.endswith(" / C01") and value == 0) or (is_of_sum and material in judged):
            continue
        if not holds_angle(usual, value) and (message := usual.refusal(value)):
            judged.add(material)
            yield path, message + ALL_THE_SAME
    belts = [angle for (_, angle), usual in _angles(flat).items() if usual is BELT_ANGLE]
    if message := one_side(belts):
        yield last_belt, message + ALL_THE_SAME


def _key(ply: RebarPly) -> tuple[str, float]:
    """Name and angle: a layer may be given element by element, and a name serve two layers."""
    return ply.name, ply.angle_deg


def _angles(flat: SolverDeck) -> dict[tuple[str, float], Usual]:
    """Usual angles of layers: of belts, which lie over the crown alone, and of carcasses, which
    reach from there to a bead."""
    mesh = flat.mesh
    radii: dict[tuple[str, float], list[float]] = {}
    for ply in flat.plies:
        nodes = (n for element in ply.elements for n in mesh.plies[element])
        radii.setdefault(_key(ply), []).extend(mesh.nodes[n][0] for n in nodes)
    section = [mesh.nodes[n][0] for n in mesh.around]
    lowest, height = min(section), max(section) - min(section)
    spans = {
        key: [(r - lowest) / height for r in (min(those), max(those))]
        for key, those in radii.items()
    }
    carcasses = {
        key: CARCASS_ANGLE
        for key, (low, high) in spans.items()
        if low < OVER_THE_CROWN and high > 1 - OVER_THE_CROWN
    }
    belts = {
        key: BELT_ANGLE
        for key, (low, _) in spans.items()
        if low > 1 - OVER_THE_CROWN
        and (carcasses or abs((key[1] + 90) % 180 - 90) >= MIN_BELT_ANGLE)
    }
    return belts | carcasses


def _shear_terms(deck: OwnDeck, material: str) -> dict[str, float]:
    """Paths of a material's constants that make its shear modulus, and their factors."""
    start = f"{material} / HYPERELASTIC / "
    return {
        start + name: factor for name, factor in SHEAR_TERMS.items() if start + name in deck.numbers
    }


def _beside_others(usual: Usual, deck: OwnDeck, material: str, name: str, share: float) -> Usual:
    """Range, Pa, of a constant of rubber beside the others of its shear modulus."""
    stress = UNIT_MASS[deck.units] / UNIT_LENGTH[deck.units]
    others = 0.0
    for path, factor in _shear_terms(deck, material).items():
        if not path.endswith(f" / {name}"):
            others += factor * deck.numbers[path] * stress
    return constant_beside(usual, SHEAR_TERMS[name], others, share)


def _higher_order(deck: OwnDeck, material: str) -> Usual:
    """Range, Pa, of a constant that counts at large strain, by those of the shear modulus."""
    stress = UNIT_MASS[deck.units] / UNIT_LENGTH[deck.units]
    most = (
        HIGHER_ORDER
        * sum(abs(deck.numbers[path]) for path in _shear_terms(deck, material))
        * stress
    )
    reason = f", {HIGHER_ORDER:g} times the first constants"
    return replace(ANY_CONSTANT, low=-most, high=most, reason=reason)


def _layers(
    flat: SolverDeck, angles: Mapping[tuple[str, float], Usual]
) -> dict[RebarPly, CordLayer]:
    """Cords of each layer, those at an angle to each other at the layer's mean radius."""
    layers = {}
    for ply in flat.plies:
        nodes = [n for element in ply.elements for n in flat.mesh.plies[element]]
        radius = sum(flat.mesh.nodes[n][0] for n in nodes) / len(nodes)
        spacing = radians(ply.spacing) * radius if ply.angular else ply.spacing
        layers[ply] = CordLayer(ply.area_m2, spacing, ply.angle_deg, angles.get(_key(ply)))
    return layers


def _shares(flat: SolverDeck) -> dict[str, float]:
    """Share of each compound in the area of the section."""
    areas: dict[str, float] = {}
    for material, section in zip(flat.materials, flat.model.solids, strict=True):
        for n in section.elements:
            corners = corner_areas(flat.model.elements[n], flat.model.nodes)
            area = corners.mean() * (len(corners) - 2) / 2
            areas[material] = areas.get(material, 0.0) + float(area)
    return {material: area / sum(areas.values()) for material, area in areas.items()}


def _radii(flat: SolverDeck) -> Usual:
    """Range of a radius at which a layer's spacing was measured, m; 0 is none."""
    radii = [r for r, _ in flat.mesh.nodes.values()]
    low, high = (f * r for f, r in zip(REACH_OF_RADIUS, (min(radii), max(radii)), strict=True))
    return Usual(0, high, "m", LENGTH, least=low, reason=" in this section")


def _in_series(usual: Usual | None, deck: OwnDeck, path: str) -> Usual | None:
    """Range of a number of a Prony series beside those of its other terms."""
    start, _, last = path.rpartition(" / ")
    series = start.partition(" / VISCOELASTIC")[0] + " / VISCOELASTIC / "
    others = [
        deck.numbers[each]
        for each in deck.numbers
        if each != path and each.startswith(series) and each.endswith(f" / {last}")
    ]
    return usual and in_series(usual, last, deck.numbers[path], others)


def _membranes(deck: OwnDeck) -> Iterator[Mistake]:
    """Membranes that are thicker or thinner than a tyre's."""
    usual = _in_units(MEMBRANE) if deck.units == "mm" else MEMBRANE
    for block in deck.blocks:
        for row in block.rows if block.name == "MEMBRANE SECTION" else ():
            if row.text(0) and (message := usual.refusal(row.number(0))):
                file = str(deck.path.parent / row.place.file)
                key = f"thickness of the membranes {block.get('ELSET')}"
                value = f"{row.number(0):g}"
                yield Mistake(file, row.place.line, key, value, message + ALL_THE_SAME)


def _density(deck: OwnDeck, material: str) -> float | None:
    """kg/m3 of a material; None where it has none."""
    value = deck.numbers.get(f"{material} / DENSITY / density")
    per_volume = UNIT_MASS[deck.units] / UNIT_LENGTH[deck.units] ** 3
    return None if value is None else value * per_volume


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
