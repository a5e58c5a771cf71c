"""Measurements (CSV) as the targets of a case.

A target has a state: pressure, load and rim. None in a state means "as the case has it"
(`TyreState.of` writes it so, `with_defaults` writes the case's own). The case that a user has
changed (`--set`, `LoadedCase.overrides`) keeps the file's own one as ``LoadedCase.as_read``.
`LoadedCase.measured` is the file of measurements that a case names, or None.

Fits and diagnoses call `readings_with_shapes` for the measurements of any file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import compress
from math import hypot, isnan
from pathlib import Path

from ..errors import InputError
from ..simulate.modes.label import Label
from ..tyre.case import LoadedCase, start_values
from ..tyre.case.parts import RimSupport
from ..tyre.case.schema import TargetFootprint, TargetMass, TargetMode, Targets
from ..tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ..tyre.state import AS_THE_CASE, PRESSURE_PATH, RIM_FREE, WHEEL_FREE, TyreState, pressure_name
from ..tyre.values import set_values
from .measurement import Measurement
from .repeats import mean_damping
from .shapes import SAME_PRESSURE_kPa, SensorShapes, read_shapes
from .tables import read_measurements
from .universal import is_universal

PRESSED_RIM: RimSupport = "fixed"  # footprints are computed with the rim clamped


def with_measured(
    case: LoadedCase, path: Path, labelled: Sequence[Measurement] | None = None
) -> tuple[LoadedCase, list[str]]:
    """The case with the measurements of a file as its targets, each in its state, and sentences on
    the values that are left out.

    labelled: the file's measurements, if labels were found for those that had none. If both modes
    of a pair of the unloaded tyre were measured, the target is their mean. If the user has set the
    pressure or the rim, or a variable sets the pressure, only values measured there are taken; so,
    too, if all values were measured at one pressure that is not the case's. Raises InputError if
    nothing is left, or the case cannot be in a state; OSError.
    """
    readings = readings_of(case, path) if labelled is None else labelled
    placed = _placed(case, readings)
    if not placed:
        raise InputError(f"{path}: no target but the mass was measured")
    pressures = {each.pressure_kPa for each in placed}
    one_other = len(pressures) == 1 and case.case.pressure_kPa not in pressures
    varied = pressure_name(case) != PRESSURE_PATH
    states = [
        each.state if each.quantity == "frequency_Hz" else replace(each.state, rim=PRESSED_RIM)
        for each in placed
    ]
    count, left_out = _in_set_state(case, str(path), states, varied or one_other)
    return _with_targets(case, path, list(compress(placed, count)), readings), left_out


def with_own_file(case: LoadedCase) -> LoadedCase:
    """The case with its file of measurements, where it names one, as targets, all that have labels,
    each in its state. Raises InputError, OSError."""
    if case.measured is None:
        return case
    readings = readings_of(case, case.measured, labelled=False)
    readings = [each for each in readings if not each.is_unlabelled]
    return _with_targets(case, case.measured, _placed(case, readings), readings)


def readings_of(case: LoadedCase, path: Path, labelled: bool = True) -> list[Measurement]:
    """The measurements of a file; labelled: each frequency needs a label. In the case's own file a
    value on the case's rim stays on the rim that the case file has, although its user has set
    another since. Raises as `read_measurements` does."""
    readings = read_measurements(path, labelled)
    if path != case.measured:
        return readings
    read = case.as_read or case
    return [replace(each, rim=each.state.kept(read, case).rim) for each in readings]


def _placed(case: LoadedCase, readings: Sequence[Measurement]) -> list[Measurement]:
    """All measurements but the mass, which has no state; pressures that differ by less than
    `SAME_PRESSURE_kPa` are made one."""
    rest = [each for each in readings if each.quantity != "mass_kg"]
    known = [case.case.pressure_kPa]
    for each in rest:
        if all(abs(each.pressure_kPa - p) > SAME_PRESSURE_kPa for p in known):
            known.append(each.pressure_kPa)
    near = lambda p: min(known, key=lambda other: abs(other - p))
    return [replace(each, pressure_kPa=near(each.pressure_kPa)) for each in rest]


def _with_targets(
    case: LoadedCase, path: Path, placed: Sequence[Measurement], readings: Sequence[Measurement]
) -> LoadedCase:
    """The case with the measurements ``placed``, and the mass among ``readings``, as its targets.
    Raises InputError if it cannot be in a state."""
    _refuse_states(case, placed)
    analysis, own = case.case.analysis, case.case.targets.source if path == case.measured else ""
    targets = Targets(
        source=own or path.name,
        modes=_modes(case, placed),
        footprint=_footprint(case, placed),
        mass=next((_mass(each) for each in readings if each.quantity == "mass_kg"), None),
    )
    highest = max([analysis.highest_harmonic, *(target.c for target in targets.modes)])
    wanted = {
        "targets": targets,
        "analysis": analysis.model_copy(update={"highest_harmonic": highest}),
    }
    return replace(case, case=case.case.model_copy(update=wanted))


def in_set_state(case: LoadedCase, held: Collection[str] = ()) -> tuple[LoadedCase, list[str]]:
    """The case with only the targets that were measured at the pressure and on the rim that its
    user has set, and sentences on those left out. held: names of variables that the fit keeps.

    Raises InputError if none was measured there.
    """
    targets, name = case.case.targets, pressure_name(case)
    stated = case.case.pressure_kPa
    if name in held:
        stated = start_values(case.as_read or case)[name]
    at = lambda p, rim: TyreState(stated if p is None else p, 0.0, rim)
    states = [at(t.pressure_kPa, t.rim) for t in targets.modes]
    states += [at(t.pressure_kPa, PRESSED_RIM) for t in targets.footprint]
    count, left_out = _in_set_state(case, f"{case.path}", states, name in held)
    modes = list(compress(targets.modes, count))
    footprint = list(compress(targets.footprint, count[len(targets.modes) :]))
    kept = targets.model_copy(update={"modes": modes, "footprint": footprint})
    return replace(case, case=case.case.model_copy(update={"targets": kept})), left_out


def _in_set_state(
    case: LoadedCase, source: str, states: Sequence[TyreState], at_pressure: bool
) -> tuple[list[bool], list[str]]:
    """Whether each target counts, by its state, and sentences on those that do not.

    A target counts if it was measured at the case's pressure, and with the wheel free or held as in
    the case. The first is checked if the user has set the pressure, or ``at_pressure``; the second
    if the user has set the rim. source: the file, for messages. Raises InputError if none counts.
    """
    set_by_user = case.overrides.keys()
    at_pressure = at_pressure or PRESSURE_PATH in set_by_user
    on_rim = not set_by_user.isdisjoint((RIM_FREE, WHEEL_FREE))
    own, whole = AS_THE_CASE.with_defaults(case), [state.with_defaults(case) for state in states]
    count = [
        (not at_pressure or state.pressure_kPa == own.pressure_kPa)
        and (not on_rim or (state.rim == "free") == (own.rim == "free"))
        for state in whole
    ]
    if all(count):
        return count, []
    words = lambda s: f"{s.pressure_kPa:g} kPa" + f" with the rim {s.rim}" * on_rim
    others = Counter(
        TyreState(state.pressure_kPa, 0.0, state.rim if on_rim else None)
        for state, counts in zip(whole, count, strict=True)
        if not counts
    )
    there = ", ".join(map(words, sorted(others, key=lambda s: (s.pressure_kPa, s.rim))))
    if any(count):
        return count, [f"{others.total()} values at {there}"]
    ((most, _),) = others.most_common(1)
    change = [f"{pressure_name(case)}={most.pressure_kPa:g}"] * at_pressure
    change += [f"rim.free={'true' if most.rim == 'free' else 'false'}"] * on_rim
    raise InputError(
        f"{source}: no target was measured at {words(own)}, only at {there}: set"
        f" {' and '.join(change)}, or give measurements at {words(own)} (--measured FILE)"
    )


def _refuse_states(case: LoadedCase, readings: Sequence[Measurement]) -> None:
    """Raise InputError, one sentence per measurement, if the case cannot be in its state."""
    mistakes = []
    for each in readings:
        try:
            numbers = each.state.numbers(case)
        except InputError as error:
            mistakes.append(f"{each.place}: the rim {error}")
            continue
        try:
            set_values(case, numbers)
        except InputError as error:
            mistakes.append(f"{each.place}: {error}")
    if mistakes:
        raise InputError("\n".join(mistakes))


def in_states(case: LoadedCase, readings: Sequence[Measurement]) -> list[Measurement]:
    """Measurements whose ``rim`` is stated only if it differs from the case's, and of frequencies
    and the mass alone: a tyre is pressed on a clamped rim. Raises InputError if the case cannot be
    in a state."""
    is_pressed = lambda each: each.load_N and each.quantity != "frequency_Hz"
    with_rims = [
        replace(each, rim=None if is_pressed(each) else each.state.of(case).rim)
        for each in readings
    ]
    _refuse_states(case, [each for each in with_rims if each.rim])
    return with_rims


def _modes(case: LoadedCase, readings: Sequence[Measurement]) -> list[TargetMode]:
    """Targets of modes; frequency and sigma of a pair are those of its members' mean, their errors
    being independent."""
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
            **{key: x for key, x in mean_damping(group).items() if not isnan(x)},
            pressure_kPa=state.pressure_kPa,
            rim=state.rim,
            load_N=state.load_N or None,
            symmetry=symmetry or None,  # type: ignore[arg-type]
        )
        for (label, symmetry, state), group in groups.items()
    ]


def _footprint(case: LoadedCase, readings: Sequence[Measurement]) -> list[TargetFootprint]:
    """Targets of the footprint, one quantity each."""
    return [
        TargetFootprint.model_validate(
            {
                "load_N": each.load_N,
                "pressure_kPa": each.state.of(case).pressure_kPa,
                each.quantity: each.value,
                FOOTPRINT_QUANTITIES[each.quantity].sigma: each.sigma,
            }
        )
        for each in readings
        if not each.label
    ]


def _mass(reading: Measurement) -> TargetMass:
    return TargetMass(mass_kg=reading.value, sigma_kg=reading.sigma)


def readings_with_shapes(
    case: LoadedCase, path: Path
) -> tuple[list[Measurement], list[SensorShapes]]:
    """Measurements of a file, with or without labels, and the shapes measured with them: of a
    universal file at the case's pressure `unlabelled`, else those that were imported with the file.

    Raises InputError, OSError.
    """
    if not is_universal(path):
        return readings_of(case, path, labelled=False), read_shapes(path)
    from .gather import unlabelled  # which identifies modes: SciPy is slow to import

    try:
        readings, shapes, _ = unlabelled(path, case.case.pressure_kPa)
    except InputError as error:
        way = "'tyrecal measured import --no-labels' has options for universal files"
        raise InputError(f"{error}; {way}") from None
    return readings, shapes
