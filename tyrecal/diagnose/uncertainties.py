"""Sources of error: numbers of the case that nobody calibrates, and how far they may be off."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pydantic import BaseModel

from ..case import LoadedCase
from ..case.checks import find
from ..case.schema import Cord, Rubber
from ..effects import catalogue
from ..units import in_engineers_units

DENSITY, MODULUS, SPACING, GAUGE, ANGLE_deg, PRESSURE_kPa = 1.5, 3.0, 1.0, 3.0, 1.0, 1.0
EFFECTS = "effects."
UNITS = {  # by a key's end, the longer first
    "kg_per_m3": "kg/m3",
    "kg_m2": "kg m2",
    "m_per_N": "m/N",
    "Pa_per_m": "Pa/m",
    "N_per_m": "N/m",
    "rad_per_N_m": "rad/(N m)",
    "rad_per_s": "rad/s",
    "kPa": "kPa",
    "Pa": "Pa",
    "deg": "degrees",
    "m": "m",
    "m2": "m2",
    "kg": "kg",
    "Hz": "Hz",
    "C": "C",
}


@dataclass(frozen=True)
class Source:
    """steps: by path of a number, its change (in its unit) at one standard deviation of the
    source; words: the same for people."""

    name: str
    steps: dict[str, float]
    words: str


def sources(case: LoadedCase) -> tuple[list[Source], bool]:
    """The case's own sources, else the assumed ones; whether they are assumed. A number that a
    design variable sets is none: the fit finds it.

    Assumed, a standard deviation each: rubber densities 1.5 %, moduli of cords 3 %, spacings 1 %,
    gauges that the case has 3 %, cord angles 1 degree, pressure 1 kPa.
    """
    stated = case.case.uncertainties
    if not stated:
        return list(_assumed(case)), True
    result, taken = [], calibrated(case)
    for name, each in stated.items():
        signs = each.signs or [1] * len(each.sets)
        steps = {
            path: sign * (each.absolute or _value(case, path) * (each.percent or 0) / 100)
            for path, sign in zip(each.sets, signs, strict=True)
            if path not in taken
        }
        if not steps:
            continue
        size = (
            f"{each.percent:g} %"
            if each.percent
            else f"{in_engineers_units(each.absolute or 0.0, unit_of(next(iter(steps))))}"
        )
        result.append(Source(name, steps, f"{name.replace('_', ' ')} {size}"))
    return result, False


def _assumed(case: LoadedCase) -> Iterator[Source]:
    taken = calibrated(case)

    def source(name: str, path: str, percent: float = 0.0, absolute: float = 0.0) -> Source | None:
        if path in taken:
            return None
        step = absolute or _value(case, path) * percent / 100
        size = f"{percent:g} %" if percent else f"{in_engineers_units(absolute, unit_of(path))}"
        return Source(name, {path: step}, f"{name.replace('_', ' ')} {size}")

    found = [source("pressure", "pressure_kPa", absolute=PRESSURE_kPa)]
    for name, material in case.case.materials.items():
        path = f"materials.{name}."
        if isinstance(material, Rubber):
            found.append(source(f"{name}_density", path + "density_kg_per_m3", DENSITY))
        elif isinstance(material, Cord):
            found.append(source(f"{name}_modulus", path + "youngs_modulus_Pa", MODULUS))
    for name, layer in case.case.rebar_layers.items():
        path = f"rebar_layers.{name}."
        spacing = "spacing_m" if layer.spacing_m is not None else "spacing_deg"
        found.append(source(f"{name}_spacing", path + spacing, SPACING))
        found.append(source(f"{name}_angle", path + "angle_deg", absolute=ANGLE_deg))
    for i, gauge in enumerate(case.case.section.gauges or []):
        path = f"section.gauges.{i}.factor"
        found.append(source(f"gauge_{'_'.join(gauge.between)}_{i}", path, GAUGE))
    yield from (each for each in found if each)


def unit_of(path: str) -> str:
    """The unit of the number at a dotted path, "" where it has none."""
    if path.startswith(EFFECTS):
        return catalogue()[path.removeprefix(EFFECTS)].unit
    return next((unit for end, unit in UNITS.items() if path.endswith(f"_{end}")), "")


def calibrated(case: LoadedCase) -> set[str]:
    """Paths that the design variables set."""
    return {path for variable in case.case.variables.values() for path in variable.sets}


def _value(case: LoadedCase, path: str) -> float:
    """The number at a dotted path; 0 for an effect that the case does not name."""
    if path.startswith(EFFECTS):
        return case.case.effects.get(path.removeprefix(EFFECTS), 0.0)
    here: object = case.case
    for key in find(case.case, path):
        here = getattr(here, str(key)) if isinstance(here, BaseModel) else here[key]  # type: ignore[index]
    assert isinstance(here, int | float)
    return float(here)


def values_of(case: LoadedCase, found: list[Source]) -> dict[str, float]:
    """The case's own numbers at every path of the sources, effects aside."""
    paths = [path for source in found for path in source.steps if not path.startswith(EFFECTS)]
    return {path: _value(case, path) for path in paths}
