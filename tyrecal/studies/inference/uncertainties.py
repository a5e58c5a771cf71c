"""Sources of error: uncalibrated numbers of the case, with their standard deviations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from ...tyre.case import LoadedCase, number_at
from ...tyre.case.schema import Cord, Rubber
from ...tyre.number_units import EFFECT_PATH, unit_of
from ...units import in_engineers_units
from .section_fields import SectionField, fields, known_from, words

# standard deviations of numbers for which a case states none
DENSITY_PERCENT, MODULUS_PERCENT, SPACING_PERCENT, GAUGE_PERCENT = 1.5, 3.0, 1.0, 3.0
ANGLE_deg, PRESSURE_kPa = 1.0, 1.0
RIM_WIDTH = EFFECT_PATH + "rim_width"
# standard deviation, m, of the distance between the places where the rim holds the beads, by the
# section's origin (`known_from`); by judgement, 2.5 mm on each side between makers of one size
BEAD_SEAT_DISTANCE = {"exact": 0.0, "measured": 0.5e-3, "drawing": 1e-3, "size_code": 5e-3}


@dataclass(frozen=True)
class Source:
    """One source of error: numbers that are off together, or a field of the section."""

    name: str
    steps: dict[str, float]  # change of numbers by path, in their units, at one standard deviation
    words: str  # the same in words
    field: SectionField | None = None  # at one standard deviation; steps are then empty


def sources(case: LoadedCase) -> tuple[list[Source], bool]:
    """The case's own sources, else the assumed ones; whether they are assumed. Numbers that design
    variables set are not among them, because the fit finds them.

    Assumed standard deviations: rubber densities 1.5 %, moduli of cords 3 %, spacings 1 %, gauges
    of the case 3 %, cord angles 1 degree, pressure 1 kPa. If the section is not exact, its fields
    are added, and the distance between the beads' seats unless the case states `effects.rim_width`.
    """
    constants, assumed = _constants(case)
    of_section = [Source(name, {}, "", field) for name, field in fields(case).items()]
    if of_section:
        of_section[0] = replace(of_section[0], words=words(case))
        if not any(RIM_WIDTH in source.steps for source in constants):
            seat = BEAD_SEAT_DISTANCE[known_from(case)]
            constants.append(_source("bead_seat_distance", {RIM_WIDTH: seat}, 0.0, seat))
    return [*constants, *of_section], assumed


def _constants(case: LoadedCase) -> tuple[list[Source], bool]:
    """Uncertain constants of a case, and whether they are assumed because the case states none."""
    stated, taken = case.case.uncertainties, calibrated(case)
    if not stated:
        return list(_assumed(case, taken)), True
    result = []
    for name, each in stated.items():
        signs = each.signs or [1] * len(each.sets)
        steps = {
            path: sign * (each.absolute or number_at(case, path) * (each.percent or 0) / 100)
            for path, sign in zip(each.sets, signs, strict=True)
            if path not in taken
        }
        if steps:
            result.append(_source(name, steps, each.percent or 0.0, each.absolute or 0.0))
    return result, False


def _assumed(case: LoadedCase, taken: set[str]) -> Iterator[Source]:
    """Assumed sources, without the paths ``taken`` by variables."""
    for name, path, percent, absolute in _usual(case):
        if path not in taken:
            step = absolute or number_at(case, path) * percent / 100
            yield _source(name, {path: step}, percent, absolute)


def _usual(case: LoadedCase) -> Iterator[tuple[str, str, float, float]]:
    """Name, path, standard deviation in per cent (else 0), and absolute one (else 0)."""
    yield "pressure", "pressure_kPa", 0.0, PRESSURE_kPa
    yield from _of_deck(case.deck_numbers)
    for name, material in case.case.materials.items():
        path = f"materials.{name}."
        if isinstance(material, Rubber):
            yield f"{name}_density", path + "density_kg_per_m3", DENSITY_PERCENT, 0.0
        elif isinstance(material, Cord):
            yield f"{name}_modulus", path + "youngs_modulus_Pa", MODULUS_PERCENT, 0.0
    for name, layer in case.case.rebar_layers.items():
        path = f"rebar_layers.{name}."
        spacing = "spacing_m" if layer.spacing_m is not None else "spacing_deg"
        yield f"{name}_spacing", path + spacing, SPACING_PERCENT, 0.0
        yield f"{name}_angle", path + "angle_deg", 0.0, ANGLE_deg
    for i, gauge in enumerate(case.case.section.gauges or []):
        name = f"gauge_{'_'.join(gauge.between)}_{i}"
        yield name, f"section.gauges.{i}.factor", GAUGE_PERCENT, 0.0


def _of_deck(numbers: Mapping[str, float]) -> Iterator[tuple[str, str, float, float]]:
    """As `_usual`, for the numbers of a user's deck."""
    rubbers = {path.split(" / ")[0] for path in numbers if " / HYPERELASTIC / " in path}
    for path in numbers:
        *heads, field = path.split(" / ")
        name = "_".join(head.partition(" ")[2] for head in heads if " " in head)
        if field == "density" and heads[0] in rubbers:
            yield f"{name}_density", path, DENSITY_PERCENT, 0.0
        elif field == "E":
            yield f"{name}_modulus", path, MODULUS_PERCENT, 0.0
        elif field == "spacing":
            yield f"{name}_spacing", path, SPACING_PERCENT, 0.0
        elif field == "angle":
            yield f"{name}_angle", path, 0.0, ANGLE_deg


def _source(name: str, steps: dict[str, float], percent: float, absolute: float) -> Source:
    unit = unit_of(next(iter(steps)))
    size = f"{percent:g} %" if percent else in_engineers_units(absolute, unit)
    return Source(name, steps, f"{name.replace('_', ' ')} {size}")


def calibrated(case: LoadedCase) -> set[str]:
    """Paths that the design variables set."""
    return {path for variable in case.case.variables.values() for path in variable.sets}


def values_of(case: LoadedCase, own_sources: list[Source]) -> dict[str, float]:
    """The case's numbers at the paths of the sources, without effects."""
    paths = [
        path for source in own_sources for path in source.steps if not path.startswith(EFFECT_PATH)
    ]
    return {path: float(number_at(case, path)) for path in paths}
