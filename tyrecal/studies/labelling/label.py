"""Labels of measured frequencies by a case: what is known of its variables, its modes in the states
that they were measured in, and the readings with their likeliest labels."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import ceil

import numpy as np

from ...measured.case_modes import PER_HARMONIC, CaseModes, ln_shape_odds, require_harmonic_shapes
from ...measured.measurement import Measurement
from ...measured.shapes import SensorShapes
from ...simulate.deck.tyre_design import TyreDesign
from ...simulate.evaluate.evaluator import Evaluator, Question
from ...simulate.modes.find import LabelledModes, find_modes
from ...simulate.modes.label import Label, Mode
from ...tyre.case import LoadedCase
from ...tyre.state import TyreState
from ..fit.problem import Problem
from ..fit.result import FitResult
from ..variable import DesignVariable, read_variable
from .expansion import LabelSearch, ModesNearDesign, Prior, admissible, find_labels
from .tree import Frequencies

Array = np.ndarray

BAND_ABOVE = 1.25  # of the highest measured frequency, up to which modes are looked for
MAX_EXPANDED_HARMONICS = 20  # c of the modes that may have been measured
MODES_PER_HARMONIC = 3  # at least: both families, and one across the belt that comes between


@dataclass(frozen=True)
class Labelled:
    """Readings with the labels that the search found."""

    given: Sequence[Measurement]  # all readings as they came
    # those of the unloaded tyre, rising, in the order of the labelings of ``found``, each a reading
    # or the two of a doublet
    frequencies: list[list[Measurement]]
    found: LabelSearch
    start: ModesNearDesign  # the model where the variables are expected
    states: Sequence[TyreState]  # of the modes of ``found`` and ``start``, by number
    shapes: Sequence[SensorShapes] = ()  # that were measured with the readings

    @property
    def labels(self) -> list[Label | None]:
        """Labels of ``frequencies``."""
        return self.found.labels()

    @property
    def readings(self) -> list[Measurement]:
        """Readings with the likeliest labels, see `under`."""
        return self.under(0)

    def under(self, place: int) -> list[Measurement]:
        """The readings with the labels of the labeling at a place, less those that are foreign."""
        modes = self.found.labelings.modes[place].tolist()
        pairs = {j for j, count in Counter(modes).items() if j >= 0 and count > 1}
        by_reading, seen = dict[int, Measurement | None](), set[int]()
        for each, j, own in zip(self.frequencies, modes, self.found.labels(place), strict=True):
            for r in each:
                member = str(1 + (j in seen)) if j in pairs else r.member
                by_reading[id(r)] = replace(r, label=own, member=member) if own else None
            seen.add(j)
        return [new for r in self.given if (new := by_reading.get(id(r), r))]


def start_prior(variables: Sequence[DesignVariable]) -> Prior:
    """About the case's start values."""
    root = np.diag([v.spread for v in variables])
    return _prior(variables, {v.name: v.start for v in variables}, root)


def fitted_prior(case: LoadedCase, fit: FitResult) -> Prior:
    """Prior that a fit of the case leaves for the variables that it did not hold: values, standard
    errors and correlations; for those that it did not determine as far as `start_prior` says."""
    values = {name: each.value for name, each in fit.variables.items()}
    variables = [read_variable(case, name) for name in values]
    wide = np.diag(start_prior(variables).root)
    spread = np.zeros(len(variables))
    alike = np.eye(len(variables))
    for i, v in enumerate(variables):
        error = fit.variables[v.name].standard_error
        spread[i] = wide[i] if error is None else min(error / v.slope(values[v.name]), wide[i])
        for j, other in enumerate(variables[:i]):
            alike[i, j] = alike[j, i] = fit.correlations.get(v.name, {}).get(other.name) or 0.0
    power, vectors = np.linalg.eigh(np.outer(spread, spread) * alike)
    return _prior(variables, values, vectors * np.sqrt(np.maximum(power, 0.0)))


def _prior(variables: Sequence[DesignVariable], values: Mapping[str, float], root: Array) -> Prior:
    """Prior of the variables about ``values``, in their coordinates; ``root`` (v, v) of its
    covariance."""
    mean, lower, upper = (
        np.array([v.scaled(value) for v, value in zip(variables, own, strict=True)])
        for own in (
            [values[v.name] for v in variables],
            [v.lower for v in variables],
            [v.upper for v in variables],
        )
    )
    return Prior(mean, root, lower, upper)


def label(
    case: LoadedCase,
    evaluator: Evaluator,
    readings: Sequence[Measurement],
    prior: Prior | None = None,
    about: Mapping[str, float] | None = None,
    fixed: Mapping[str, float] | None = None,
    jobs: int = 1,
    shapes: Sequence[SensorShapes] = (),
) -> Labelled:
    """The readings with the likeliest labels, all frequencies of the unloaded tyre labelled
    together.

    prior: of the variables that are not ``fixed``, by default `start_prior`; about: the design at
    which the model is expanded first, by default the prior's mean; shapes: measured with the
    readings. Raises EvaluationFailed, DeckRefused; InputError where a sensor is not on the tyre,
    or the solver has no shapes to compare.
    """
    problem = Problem(case, evaluator, fixed)
    prior = prior or start_prior(problem.variables)
    frequencies = _of_unloaded(case, readings)
    states = list(dict.fromkeys(each[0].state.of(case) for each in frequencies))
    place = np.array([states.index(each[0].state.of(case)) for each in frequencies])
    highest_Hz = max(each[0].value for each in frequencies)
    model = LabelledModel(problem, states, highest_Hz, jobs, across=bool(shapes))
    values = [float(np.mean([r.value for r in each])) for each in frequencies]
    relative = [
        float(np.hypot.reduce([r.sigma for r in each])) / len(each) / value
        for each, value in zip(frequencies, values, strict=True)
    ]
    known = [each[0].label for each in frequencies]

    def measured(at: ModesNearDesign) -> Frequencies:
        allowed = admissible(known, place, at)
        is_labelled = np.array([own is not None for own in known])
        return Frequencies(
            np.log(values),
            np.array(relative),
            place,
            allowed,
            allowed.any(1) & is_labelled,
            ln_shape(case, shapes, [each[0] for each in frequencies], place, at),
        )

    start = model.expand(prior.mean)
    first = prior.mean
    if about:
        first = np.array([v.scaled(about[v.name]) for v in problem.variables])
    result = find_labels(model.expand, measured, prior, first)
    return Labelled(readings, frequencies, result, start, states, shapes)


def _places(case: LoadedCase, readings: Sequence[Measurement]) -> tuple[Array, Array]:
    """Frequencies (n,), Hz, and their pressures (n,), kPa."""
    states = [each.state.with_defaults(case) for each in readings]
    return np.array([each.value for each in readings]), np.array([s.pressure_kPa for s in states])


def labelled_shapes(case: LoadedCase, labelled: Labelled) -> list[SensorShapes]:
    """The measured shapes with the likeliest labels."""
    readings = [each for each in labelled.readings if each.label and not each.load_N]
    tests = []
    for test in labelled.shapes:
        modes = [mode.model_copy(update={"c": None, "m": None}) for mode in test.modes]
        for i, j in test.nearest(*_places(case, readings)).items():
            label = readings[i].label
            assert label
            own = {**asdict(label), "member": readings[i].member}
            modes[j] = modes[j].model_copy(update=own)
        tests.append(test.model_copy(update={"modes": modes}))
    return tests


def ln_shape(
    case: LoadedCase,
    shapes: Sequence[SensorShapes],
    frequencies: Sequence[Measurement],
    states: Array,
    at: ModesNearDesign,
) -> Array | None:
    """ln of the odds (m, n) of m frequencies, in ``states`` (m,), as each of n modes by their
    measured shapes; 0 without a shape. None if there are no shapes."""
    if not shapes:
        return None
    odds = np.zeros((len(frequencies), len(at.modes)))
    places = _places(case, frequencies)
    for test in shapes:
        own = test.nearest(*places)
        for state in np.unique(states[[*own]]):
            rows = np.array([i for i in own if states[i] == state])
            columns = np.flatnonzero(at.states == state)
            measured = np.array([test.modes[own[i]].values for i in rows.tolist()]).T
            modes = CaseModes([at.modes[j] for j in columns])
            odds[np.ix_(rows, columns)] += ln_shape_odds(modes, test.sensors, measured)
    return odds


def _of_unloaded(case: LoadedCase, readings: Sequence[Measurement]) -> list[list[Measurement]]:
    """Frequencies by rising value; the two of a doublet with a label together."""
    groups: dict[tuple[object, ...], list[Measurement]] = {}
    for i, each in enumerate(readings):
        across = each.label and each.label.family is None
        if each.quantity == "frequency_Hz" and not each.load_N and not across:
            own = each.label or i
            groups.setdefault((own, each.state.of(case)), []).append(each)
    return sorted(groups.values(), key=lambda group: group[0].value)


class LabelledModel:
    """The modes of a case in ``states``, by its variables, up to above ``highest_Hz``."""

    def __init__(
        self,
        problem: Problem,
        states: Sequence[TyreState],
        highest_Hz: float,
        jobs: int = 1,
        across: bool = False,
    ):
        self.problem, self.states, self.jobs = problem, states, jobs
        # whether shapes are compared, those across the belt and of overtones, too
        self.across = across
        self.top_Hz = BAND_ABOVE * highest_Hz
        self.top_across_Hz = BAND_ABOVE * self.top_Hz  # of those across the belt
        self.harmonics = problem.case.case.analysis.highest_harmonic

    def expand(self, x: Array) -> ModesNearDesign:
        """The model at coordinates x (v,). Raises EvaluationFailed, DeckRefused."""
        while True:
            by_state = self._evaluated(x)
            tops = [
                min((m.frequency_Hz for m in modes if m.label.c == self.harmonics), default=0.0)
                for modes, _ in by_state
            ]
            if min(tops) > self.top_Hz or self.harmonics == MAX_EXPANDED_HARMONICS:
                break
            more = ceil(self.harmonics * self.top_Hz / max(min(tops), 0.5 * self.top_Hz))
            self.harmonics = min(max(more, self.harmonics + 1), MAX_EXPANDED_HARMONICS)
        every = [
            (i, mode, row)
            for i, (modes, rows) in enumerate(by_state)
            for mode, row in zip(modes, rows, strict=True)
            if (mode.label.family or (self.across and mode.frequency_Hz < self.top_across_Hz))
            and np.isfinite(row).all()
        ]
        hertz = np.array([mode.frequency_Hz for _, mode, _ in every])
        slopes = np.array([row for *_, row in every]) / hertz[:, None]
        labels = tuple(mode.label for _, mode, _ in every)
        modes = tuple(mode for _, mode, _ in every)
        if self.across:
            require_harmonic_shapes(modes, self.problem.evaluator.solver.name)
        states = np.array([i for i, *_ in every])
        return ModesNearDesign(labels, states, np.log(hertz), slopes, modes)

    def _evaluated(self, x: Array) -> list[tuple[list[Mode], Array]]:
        """Modes of each state, and d f / d x (modes, variables)."""
        problem = self.problem
        case = problem.case
        analysis = case.case.analysis.model_copy(update={"highest_harmonic": self.harmonics})
        wide = replace(case, case=case.case.model_copy(update={"analysis": analysis}))
        evaluator = problem.evaluator.of(TyreDesign(wide))
        values = problem.values(x)
        names = tuple(v.name for v in problem.variables)
        least = PER_HARMONIC if self.across else MODES_PER_HARMONIC
        count = max(case.case.analysis.modes_per_harmonic, least)
        questions = [
            Question(*problem.question(values, state, names), count) for state in self.states
        ]
        result = []
        answers = dict(find_modes(evaluator, questions, [], self.jobs))
        for place in range(len(questions)):
            answer = answers[place]
            if not isinstance(answer, LabelledModes):
                raise answer
            modes, gradients = answer.modes, answer.evaluation.gradients
            rows = np.zeros((len(modes), len(names)))
            for j, v in enumerate(problem.variables):
                if v.name in gradients:
                    own = np.asarray(gradients[v.name])[[m.position for m in modes]]
                    rows[:, j] = own * v.slope(values[v.name])
            result.append((modes, rows))
        return result
