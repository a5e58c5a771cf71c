"""A case and its files of measurements, diagnosed: what the command does, for other programs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import Json
from ...measured.measurement import Measurement
from ...measured.targets import in_states, readings_of, readings_with_shapes
from ...simulate.evaluate.evaluator import Evaluator
from ...tyre.case import LoadedCase
from ...tyre.case.mistakes import suggestion
from ...tyre.effects import catalogue
from ...tyre.number_units import EFFECT_PATH
from ...units import read_number
from ..fit.targets import rims_of
from ..inference.check_units import check_units
from ..inference.effect_ranges import effect_ranges
from ..inference.expansion import first_points
from ..inference.inverse_problem import Assumed, Toggle
from ..inference.model import EffectRange, Query
from ..inference.observations import Observations, observe
from ..inference.run_estimate import estimate, model_of
from ..inference.tyre_model import TyreModel
from ..inference.uncertainties import Source, calibrated, sources
from ..labelling.label import label
from ..labelling.result import labels_posterior
from ..labels import Labels
from ..run_plan import PlannedState, RunPlan, runs_in_words
from ..variable import read_variables
from .diagnosis import Diagnosis, diagnose
from .evidence import NONE
from .labelings import Reading, likely, rows_if_exchanged, with_probabilities
from .next_measurement import OtherStates
from .posteriors import calibrated_variables, section_posterior
from .result import DiagnosisResult, diagnosis_result
from .under_load import UnderLoad, Values, compare
from .where import FieldValue

LIKELIEST = 3  # effects that are evaluated again, as a rule


@dataclass(frozen=True)
class DiagnosedCase:
    """A diagnosis with what it rests on."""

    diagnosis: Diagnosis
    sources: tuple[Source, ...]  # of error
    assumed_sources: bool  # whether they were assumed
    inexpressible: Mapping[str, str]  # effects that solver or case cannot have, and why
    calibrated: tuple[str, ...]  # effects that variables of the case calibrate
    model: TyreModel
    under_load: UnderLoad | None = None  # what was measured there
    labels: Labels | None = None  # of frequencies that came without

    @property
    def variables(self) -> Json:
        """See `calibrated_variables`."""
        return calibrated_variables(self.diagnosis, self.model)

    @property
    def section(self) -> list[FieldValue]:
        """See `section_posterior`."""
        stated = any(source.field for source in self.sources)
        return section_posterior(self.model.case, self.sources, self.diagnosis) if stated else []

    @property
    def result(self) -> DiagnosisResult:
        """The content of diagnosis.json."""
        return diagnosis_result(
            self.diagnosis, self.under_load, self.variables, self.section, self.labels
        )

    @property
    def asked_for(self) -> tuple[str, ...] | None:
        """The effects considered, where they are not all of the catalogue."""
        known = {*self.diagnosis.problem.ranges, *self.inexpressible, *self.calibrated}
        return None if known == set(catalogue()) else tuple(self.diagnosis.problem.ranges)


def study(
    case: LoadedCase,
    evaluator: Evaluator,
    measured: Path,
    repeats: Sequence[Path] = (),
    toggled: Sequence[tuple[Path, Toggle]] = (),
    assumed: Assumed = Assumed(),  # noqa: B008
    jobs: int = 1,
    effects: Sequence[str] | None = None,
    section_map: bool = True,
    stage: Callable[[str], None] = lambda stage: None,
    first_guess: Mapping[str, float] | None = None,
    say: Callable[[str], None] = lambda words: None,
) -> DiagnosedCase:
    """Read the files and diagnose the case with them.

    effects: ids to consider, None = the whole catalogue; one that a variable of the case sets is
    none; stage: hears of each of ``diagnosis.STAGES``; first_guess: values of the
    variables at which the calibration begins, None: their starts; say: hears how long it takes
    where the solver gives no exact sensitivities. Then other pressures and modes to measure next,
    which take many runs, are left out. Raises InputError, EvaluationFailed, and
    what ``Evaluator.evaluate`` raises.
    """
    switched = [path for path, _ in toggled]
    paths = [measured, *repeats, *switched]
    given, shapes = readings_with_shapes(case, measured)
    runs = {path: in_states(case, readings_of(case, path)) for path in paths[1:]}
    runs[measured] = in_states(case, given)
    _check_copies(paths, runs)
    elsewhere = {
        f"{path.name}: what was measured under load with the rim {each.rim}: not compared": None
        for path in paths
        for each in runs[path]
        if each.load_N and each.rim
    }

    def observed(run: Sequence[Measurement]) -> Observations:
        again, toggles = ([runs[path] for path in group] for group in (repeats, switched))
        observations = observe(run, again, toggles, assumed.split)
        return replace(observations, left_out=(*observations.left_out, *elsewhere))

    if not any(each.quantity == "frequency_Hz" and not each.load_N for each in given):
        raise InputError(
            f"{measured}: it has no frequency of the unloaded tyre, which a diagnosis needs"
        )
    ids = list(catalogue()) if effects is None else list(effects)
    fitted = tuple(id for id in ids if EFFECT_PATH + id in calibrated(case))
    if "pressure_kPa" in calibrated(case):
        raise InputError(
            "a variable of the case sets pressure_kPa, which a diagnosis takes from the"
            " measurements: consider the effect pressure_offset instead"
        )
    labelled, readings = None, [Reading(observed(runs[measured]))]
    if any(each.is_unlabelled for each in given):
        labelled = label(case, evaluator, given, jobs=jobs, shapes=shapes)
        readings = likely(labelled, lambda run: observed(in_states(case, run)))
    per_reading = [rows_if_exchanged(each.observations) for each in readings]
    rows = list(dict.fromkeys(row for each in per_reading for row in each))
    ranges, inexpressible = effect_ranges(case, evaluator, [id for id in ids if id not in fitted])
    changes = tuple(_counted_from(change, ranges) for _, change in toggled)
    for change in changes:
        ranges[change.id] = _reaching(ranges[change.id], change)
    own_sources, assumed_sources = sources(case)
    damped = any(each.observations.damping.rows for each in readings)
    model = TyreModel(case, evaluator, rows, own_sources, ranges, jobs, damped)
    variables = read_variables(case)
    begin = None
    if first_guess:
        begin = np.array([v.scaled(first_guess[v.name]) for v in variables])
    if not (is_exact := evaluator.has_gradients):
        say(runs_in_words(evaluator, model.first_design, _runs(model), jobs))
    check_units(model, readings[0].observations, [str(measured), *map(str, switched)], changes)
    diagnosis = diagnose(
        model,
        rows,
        readings if labelled else readings[0].observations,
        changes,
        assumed,
        parts=model.parts if section_map and (is_exact or model.has_uncertain_compounds) else None,
        further=OtherStates(
            lambda more: TyreModel(case, evaluator, more, own_sources, ranges, jobs),
            case.case.pressure_kPa,
        )
        if is_exact
        else None,
        stage=stage,
        begin=begin,
    )
    own = [runs[path] for path in (measured, *repeats)]
    return DiagnosedCase(
        diagnosis,
        tuple(own_sources),
        assumed_sources,
        inexpressible,
        fitted,
        model,
        _under_load(case, evaluator, own, diagnosis, model),
        labels_posterior(case, with_probabilities(labelled, diagnosis.readings))
        if labelled
        else None,
    )


def planned(
    case: LoadedCase, evaluator: Evaluator, measured: Path, effects: Sequence[str], jobs: int
) -> RunPlan:
    """About how often the solver runs, before it does."""
    readings = in_states(case, readings_with_shapes(case, measured)[0])
    model = model_of(case, evaluator, readings, effects)
    loaded = [each for each in readings if each.load_N and not each.rim]
    pressed = [
        PlannedState(len({each.load_N for each in loaded if each.pressure_kPa == kPa}))
        for kPa in sorted({each.pressure_kPa for each in loaded})
    ]
    return estimate(model, _runs(model), jobs, pressed)


def _runs(model: TyreModel) -> int:
    """About how many runs a diagnosis takes: the calibration, the expansion about it, and the
    likeliest effects again at one more size and at their re-fits."""
    x = model.start
    likely = [Query(x, {id: span.high or span.low}) for id, span in model.ranges.items()]
    again = 2 * model.runs([replace(each, near=x) for each in likely[:LIKELIEST]])
    return model.runs_of_calibration + model.runs(first_points(model, x)) + again


def states_measured(case: LoadedCase, measured: Path, others: Sequence[Path] = ()) -> Json:
    """The states of all that is ``measured``, and in ``others`` too, as `provenance` takes them.
    Raises InputError where the case cannot be in one of them; OSError."""
    readings = in_states(case, readings_with_shapes(case, measured)[0])
    for path in others:
        readings += in_states(case, readings_of(case, path))
    states = [each.state for each in readings]
    return {
        "pressure_kPa": sorted({each.pressure_kPa for each in readings}),
        "load_N": sorted({each.load_N for each in readings}),
        "rim": rims_of(case, states) if any(each.rim for each in states) else (),
    }


def _under_load(
    case: LoadedCase,
    evaluator: Evaluator,
    runs: Sequence[Sequence[Measurement]],
    diagnosis: Diagnosis,
    model: TyreModel,
) -> UnderLoad | None:
    """Measurements on a road against the calibrated tyre and the one with the effect that is named
    or, where there is a gap, likeliest."""
    readings = [each for run in runs for each in run if each.load_N and not each.rim]
    if not readings:
        return None
    tyres: dict[str, Values] = {}
    for key in filter(None, (NONE, diagnosis.leading)):
        hypothesis = diagnosis.hypothesis(key)
        x = diagnosis.problem.expansion.x0 + hypothesis.fitted.d[hypothesis.best]
        effects = {id: float(e[hypothesis.best]) for id, e in hypothesis.values.items()}
        tyres[key] = model.designs.at(x, effects)
    return compare(case, evaluator, readings, tyres)


def parse_change(text: str) -> Toggle:
    """``EFFECT=VALUE`` or ``EFFECT*FACTOR``. Raises InputError."""
    mark = "=" if "=" in text else "*"
    id, separator, value = text.partition(mark)
    id, known = id.strip(), catalogue()
    if not separator:
        raise InputError(
            f"'{text}' must state what was changed: EFFECT=VALUE or EFFECT*FACTOR, as in"
            " spindle_lateral=0"
        )
    if id not in known:
        raise InputError(f"'{text}': there is no effect '{id}'{suggestion(id, known)}")
    try:
        number = read_number(value, known[id].unit if mark == "=" else "")
    except InputError as error:
        raise InputError(f"'{text}': {error}") from None
    if mark == "*" and number == 1:
        raise InputError(f"'{text}': a factor of 1 changes nothing")
    return Toggle(id, number, mark == "*")


def _counted_from(change: Toggle, ranges: Mapping[str, EffectRange]) -> Toggle:
    """The change, from what the case has of its effect. Raises InputError."""
    if change.id not in ranges:
        raise InputError(
            f"'{change.id}' was changed in a toggled run, but is not among the effects that are"
            " considered: add it with --effect, or leave --without; the solver has to express it,"
            " and no variable may set it"
        )
    return replace(change, base=ranges[change.id].base)


def _reaching(span: EffectRange, change: Toggle) -> EffectRange:
    """The span with a node where the toggled run was measured, beyond the range if need be."""
    e = change.value - change.base
    if change.times or span.low <= e <= span.high or e in (0.0, *span.extra_nodes):
        return span
    return replace(span, extra_nodes=(*span.extra_nodes, e))


def _check_copies(paths: Sequence[Path], runs: Mapping[Path, Sequence[Measurement]]) -> None:
    """Raises InputError where two runs are the same to the last digit."""
    contents = [[(*r.key, r.value) for r in runs[path]] for path in paths]
    for k, path in enumerate(paths):
        if contents[k] in contents[:k]:
            first = paths[contents.index(contents[k])]
            raise InputError(
                f"{path}: has the same values as {first}; a copy is not a second measurement"
            )
