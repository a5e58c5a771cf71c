"""A case and its files of measurements, diagnosed: what the command does, for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp
from pathlib import Path

from ..case import LoadedCase
from ..case.mistakes import suggestion
from ..effects import catalogue
from ..evaluate.door import Door
from .diagnosis import Diagnosis, diagnose
from .evidence import NONE
from .measurements import BadMeasurements, Reading, read_measurements
from .observations import Observations, observe
from .problem import Assumed, Change
from .regions import regions
from .response import Answer, Point, Span
from .tyre_model import TyreModel
from .uncertainties import EFFECTS, Source, sources
from .under_load import UnderLoad, Values, compare
from .verdict import NO_GAP

ALIKE = 2.0  # factor between measured and computed frequency beyond which the unit is wrong


class BadChange(ValueError):
    """What was switched in a toggled run is not understood."""


@dataclass(frozen=True)
class Study:
    """A diagnosis with what it rests on: sources of error, whether they were assumed, effects
    that the solver cannot express, the model, and what was measured under load, None without."""

    diagnosis: Diagnosis
    sources: tuple[Source, ...]
    assumed_sources: bool
    inexpressible: tuple[str, ...]
    model: TyreModel
    under_load: UnderLoad | None = None


def study(
    case: LoadedCase,
    door: Door,
    measured: Path,
    repeats: Sequence[Path] = (),
    toggled: Sequence[tuple[Path, Change]] = (),
    assumed: Assumed = Assumed(),  # noqa: B008
    jobs: int = 1,
    effects: Sequence[str] | None = None,
    section_map: bool = True,
) -> Study:
    """Read the files and diagnose the case with them.

    effects: ids to consider, None = the whole catalogue. Raises BadMeasurements, BadChange,
    EvaluationFailed, and what ``Door.evaluate`` raises.
    """
    runs = [read_measurements(path) for path in (measured, *repeats)]
    observations = observe(
        runs[0],
        runs[1:],
        [read_measurements(path) for path, _ in toggled],
        assumed.split,
    )
    rows = list(dict.fromkeys((row.label, row.pressure_kPa) for row in observations.rows))
    if not any(label for label, _ in rows):
        raise BadMeasurements(f"{measured}: there is no frequency of the unloaded tyre in it")
    spans, inexpressible = spans_of(door, effects)
    found, assumed_sources = sources(case)
    model = TyreModel(case, door, rows, found, spans, jobs)
    _check_units(model, observations, measured)
    diagnosis = diagnose(
        model, rows, observations, tuple(change for _, change in toggled), assumed,
        parts=(lambda x: regions(model, x)) if section_map else None,
        further=lambda more: TyreModel(case, _same(door), more, found, spans, jobs),
    )  # fmt: skip
    loaded = _under_load(case, _same(door), runs, diagnosis, model)
    return Study(diagnosis, tuple(found), assumed_sources, tuple(inexpressible), model, loaded)


def _under_load(
    case: LoadedCase,
    door: Door,
    runs: Sequence[Sequence[Reading]],
    diagnosis: Diagnosis,
    model: TyreModel,
) -> UnderLoad | None:
    """What was measured on a road, against the calibrated tyre and the one with the effect that is
    named or, where there is a gap, likeliest."""
    readings = [each for run in runs for each in run if each.load_N]
    if not readings:
        return None
    verdict = diagnosis.verdict
    keys = [NONE, verdict.key or (diagnosis.best if verdict.kind != NO_GAP else None)]
    tyres: dict[str, Values] = {}
    for key in filter(None, keys):
        found = diagnosis.hypothesis(key)
        assert found.fitted is not None
        x = diagnosis.problem.expansion.x0 + found.fitted.d[found.best]
        effects = {EFFECTS + id: float(e[found.best]) for id, e in found.values.items()}
        tyres[key] = {**model.values(x), **effects}
    return compare(case, door, readings, tyres)


def spans_of(door: Door, ids: Sequence[str] | None = None) -> tuple[dict[str, Span], list[str]]:
    """Effects that the door's solver can express, and ids of those that it cannot.

    Raises ValueError where one of ``ids`` is no effect.
    """
    able, unable = {}, []
    for id in ids or ():
        if id not in catalogue():
            raise ValueError(f"'{id}' is not one of the effects{suggestion(id, catalogue())}")
    for id, effect in catalogue().items():
        if ids is not None and id not in ids:
            continue
        if not effect.within(door.solver.capabilities):
            unable.append(id)
        else:
            able[id] = Span(effect.low, effect.high, effect.unit, effect.title, effect.toggle)
    return able, unable


def parse_change(text: str) -> Change:
    """``EFFECT=VALUE`` or ``EFFECT*FACTOR``. Raises BadChange."""
    for mark in "=*":
        id, found, value = text.partition(mark)
        if found:
            break
    id = id.strip()
    known = catalogue()
    if not found or id not in known:
        raise BadChange(
            f"'{text}' must say what was switched: EFFECT=VALUE or EFFECT*FACTOR, EFFECT one of"
            f" {', '.join(known)}"
        )
    try:
        return Change(id, float(value), mark == "*")
    except ValueError:
        raise BadChange(f"'{text}': '{value.strip()}' is not a number") from None


def _same(door: Door) -> Door:
    """The same door with the same counts, for other rows of the same tyre."""
    other = door.worker()
    other.counts, other.heard = door.counts, door.heard
    return other


def _check_units(model: TyreModel, observations: Observations, path: Path) -> None:
    """Raises BadMeasurements where a frequency is not even near the model's start."""
    (answer,) = model.answers([Point(model.start)])
    if not isinstance(answer, Answer):
        raise answer
    at = dict(zip(model.rows, answer.eta.tolist(), strict=True))
    for row, y in zip(observations.rows, observations.y, strict=True):
        ratio = exp(y - at[row.label, row.pressure_kPa])
        if row.label and not 1 / ALIKE < ratio < ALIKE:
            raise BadMeasurements(
                f"{path}: {row} was measured {ratio:.2g} times as high as the model has it; is it"
                " the right unit, mode and pressure?"
            )
