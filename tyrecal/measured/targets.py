"""Measurements (CSV) as the targets of a case."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from math import hypot
from pathlib import Path

from ..errors import InputError
from ..simulate.modes.label import Label
from ..tyre.case import LoadedCase
from ..tyre.case.schema import MEASURED_SIGMA, TargetFootprint, TargetMode, Targets
from ..tyre.state import rim_of
from .measurement import Measurement
from .tables import read_measurements

SAME_PRESSURE_kPa = 0.5  # pressures that differ by less are one


def with_measured(case: LoadedCase, path: Path) -> tuple[LoadedCase, list[str]]:
    """The case with what was measured at its pressure as targets, and what was left out, why.

    Frequencies of the unloaded tyre, contact areas and vertical stiffnesses, with their sigmas;
    of a doublet with two members their mean. Raises InputError, OSError.
    """
    readings = read_measurements(path)
    pressure = case.case.pressure_kPa
    weighed = [r for r in readings if r.quantity == "mass_kg"]
    rest = [r for r in readings if r.quantity != "mass_kg"]
    here = [r for r in rest if abs(r.pressure_kPa - pressure) <= SAME_PRESSURE_kPa]
    modal = [r for r in here if r.label and not r.load_N]
    loaded = [r for r in here if r.label and r.load_N]
    pressed = [r for r in here if not r.label and r.load_N]
    other = sorted({r.pressure_kPa for r in rest} - {r.pressure_kPa for r in here})
    at = ", ".join(f"{p:g}" for p in other)
    if not modal and not pressed:
        elsewhere = f", only at {at} kPa; give --pressure-kPa" if other else ""
        raise InputError(f"{path}: no target was measured at {pressure:g} kPa{elsewhere}")
    targets = Targets(source=path.name, modes=_modes(modal), footprint=_footprint(pressed))
    analysis = case.case.analysis
    highest = max([analysis.highest_harmonic, *(target.c for target in targets.modes)])
    wanted = {
        "targets": targets,
        "analysis": analysis.model_copy(update={"highest_harmonic": highest}),
    }
    notes = [f"{len(rest) - len(here)} values at {at} kPa"] * bool(other)
    notes += [f"{len(loaded)} frequencies under load"] * bool(loaded)
    notes += ["the mass"] * bool(weighed)
    return replace(case, case=case.case.model_copy(update=wanted)), notes


def on_own_rim(
    case: LoadedCase, readings: Sequence[Measurement]
) -> tuple[list[Measurement], list[str]]:
    """What was measured on the rim that the case has, and what was on others, for studies of that
    one alone."""
    own = rim_of(case)
    here = [replace(each, rim=None) for each in readings if each.rim in (None, own)]
    others = Counter(each.rim for each in readings if each.rim not in (None, own))
    notes = [
        f"{count} values with the rim {rim}: a fit takes them; the rim of this case is {own},"
        " see --set rim.free=true"
        for rim, count in others.items()
    ]
    return here, notes


def _modes(readings: Sequence[Measurement]) -> list[TargetMode]:
    groups: dict[Label, list[Measurement]] = {}
    for each in readings:
        assert each.label is not None
        groups.setdefault(each.label, []).append(each)
    return [
        TargetMode(
            c=label.c,
            m=label.m,
            kind=label.kind,  # type: ignore[arg-type]
            frequency_Hz=sum(each.value for each in group) / len(group),
            sigma_Hz=hypot(*(each.sigma for each in group)) / len(group),
        )
        for label, group in groups.items()
    ]


def _footprint(readings: Sequence[Measurement]) -> list[TargetFootprint]:
    return [
        TargetFootprint.model_validate(
            {
                "load_N": each.load_N,
                each.quantity: each.value,
                MEASURED_SIGMA[each.quantity]: each.sigma,
            }
        )
        for each in readings
    ]
