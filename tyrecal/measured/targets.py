"""Measurements (CSV) as the targets of a case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import hypot
from pathlib import Path

from ..errors import InputError
from ..simulate.modes.label import Label
from ..tyre.case import LoadedCase
from ..tyre.case.schema import MEASURED_SIGMA, TargetFootprint, TargetMass, TargetMode, Targets
from ..tyre.state import TyreState
from ..tyre.values import set_values
from .measurement import Measurement
from .tables import read_measurements

SAME_PRESSURE_kPa = 0.5  # pressures that differ by less are one


def with_measured(
    case: LoadedCase, path: Path, labelled: Sequence[Measurement] | None = None
) -> tuple[LoadedCase, list[str]]:
    """The case with what was measured as targets, each in its state, and what was left out, why.

    labelled: the file's measurements, where labels were found for those that had none. Of a doublet
    with two members of the unloaded tyre their mean. Where the user has set the pressure, or a
    variable sets it, only what was measured there is taken. Raises InputError where nothing is
    left, or the case cannot be in a state; OSError.
    """
    readings = read_measurements(path) if labelled is None else labelled
    own = case.case.pressure_kPa
    rest = [each for each in readings if each.quantity != "mass_kg"]
    known = [own]  # pressures that differ by little are one
    for each in rest:
        if all(abs(each.pressure_kPa - p) > SAME_PRESSURE_kPa for p in known):
            known.append(each.pressure_kPa)
    near = lambda p: min(known, key=lambda other: abs(other - p))
    placed = [replace(each, pressure_kPa=near(each.pressure_kPa)) for each in rest]
    varied = any("pressure_kPa" in v.sets for v in case.case.variables.values())
    here = [each for each in placed if each.pressure_kPa == own]
    others = [r for r, each in zip(rest, placed, strict=True) if each.pressure_kPa != own]
    notes = []
    if varied or "pressure_kPa" in case.overrides or (len(known) == 2 and not here):
        at = ", ".join(f"{p:g}" for p in sorted({each.pressure_kPa for each in others}))
        if not here:
            elsewhere = f", only at {at} kPa; give --pressure-kPa" if others else ""
            raise InputError(f"{path}: no target was measured at {own:g} kPa{elsewhere}")
        notes = [f"{len(others)} values at {at} kPa"] * bool(others)
        placed = here
    if not placed:
        raise InputError(f"{path}: no target but the mass was measured")
    _refuse_states(case, placed)
    analysis = case.case.analysis
    targets = Targets(
        source=path.name,
        modes=_modes(case, placed),
        footprint=_footprint(case, placed),
        mass=next((_mass(each) for each in readings if each.quantity == "mass_kg"), None),
    )
    highest = max([analysis.highest_harmonic, *(target.c for target in targets.modes)])
    wanted = {
        "targets": targets,
        "analysis": analysis.model_copy(update={"highest_harmonic": highest}),
    }
    return replace(case, case=case.case.model_copy(update=wanted)), notes


def _refuse_states(case: LoadedCase, readings: Sequence[Measurement]) -> None:
    """Raises InputError, a sentence a line of the file, where the case cannot be in a state."""
    mistakes = []
    for each in readings:
        try:
            numbers = each.state.numbers(case)
        except ValueError as error:
            mistakes.append(f"{each.place}: the rim {error}")
            continue
        try:
            set_values(case, numbers)
        except ValueError as error:
            mistakes.append(f"{each.place}: {error}")
    if mistakes:
        raise InputError("\n".join(mistakes))


def in_states(case: LoadedCase, readings: Sequence[Measurement]) -> list[Measurement]:
    """The same with a rim only where it is not held as the case has it. Raises InputError where the
    case cannot be in a state."""
    found = [replace(each, rim=each.state.of(case).rim) for each in readings]
    _refuse_states(case, [each for each in found if each.rim])
    return found


def _modes(case: LoadedCase, readings: Sequence[Measurement]) -> list[TargetMode]:
    groups: dict[tuple[Label, str, TyreState], list[Measurement]] = {}
    for each in readings:
        if each.label:
            symmetry = each.member if each.load_N else ""
            groups.setdefault((each.label, symmetry, each.state.of(case)), []).append(each)
    return [
        TargetMode(
            c=label.c,
            m=label.m,
            kind=label.kind,  # type: ignore[arg-type]
            frequency_Hz=sum(each.value for each in group) / len(group),
            sigma_Hz=hypot(*(each.sigma for each in group)) / len(group),
            pressure_kPa=state.pressure_kPa,
            rim=state.rim,
            load_N=state.load_N or None,
            symmetry=symmetry or None,  # type: ignore[arg-type]
        )
        for (label, symmetry, state), group in groups.items()
    ]


def _footprint(case: LoadedCase, readings: Sequence[Measurement]) -> list[TargetFootprint]:
    return [
        TargetFootprint.model_validate(
            {
                "load_N": each.load_N,
                "pressure_kPa": each.state.of(case).pressure_kPa,
                each.quantity: each.value,
                MEASURED_SIGMA[each.quantity]: each.sigma,
            }
        )
        for each in readings
        if not each.label
    ]


def _mass(reading: Measurement) -> TargetMass:
    return TargetMass(mass_kg=reading.value, sigma_kg=reading.sigma)
