"""A case calibrated to its targets or to a file of measurements: what `tyrecal fit` does, and the
same from Python and in a batch."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import InputError
from ...files import Json
from ...measured.case_modes import evaluate_case_modes
from ...measured.measurement import Measurement
from ...measured.shapes import SAME_PRESSURE_kPa
from ...measured.targets import in_set_state, readings_with_shapes, with_measured
from ...simulate.deck.decks_design import design_of
from ...simulate.evaluate.evaluator import Evaluator
from ...simulate.evaluate.failure import EvaluationFailed
from ...simulate.provenance import provenance
from ...tyre.case import LoadedCase, start_values
from ...tyre.state import TyreState
from ...tyre.values import with_values
from ..correlation import correlate
from ..labelling.label import label, labelled_shapes
from ..labelling.result import labels_posterior
from ..run_plan import DESIGNS_OF_FIT, PlannedState, RunPlan, plan_runs
from .calibrate import Fit, calibrate, check, history_csv
from .free import with_freed, without_freed
from .prior import PriorProblem
from .problem import FitNotify, Problem
from .targets import states_of

MAX_FITS = 5  # to frequencies without labels


class FitStudy:
    """A calibration that has been read and checked, and that `run` computes.

    case: with the targets that it is fitted to; left_out: what was measured and is not one of them;
    evaluator: of ``case``. Raises InputError, DeckRefused, OSError before anything is evaluated.

    >>> study = FitStudy(case, evaluator, fixed={"A_belt": 2e-7})
    >>> len(study.case.case.targets.modes)
    9
    """

    def __init__(
        self,
        case: LoadedCase,
        evaluator: Evaluator,
        measured: Path | None = None,
        fixed: Mapping[str, float] | None = None,
        free: Sequence[str] = (),
        prior: bool = False,
    ):
        """measured: takes the place of the case's targets; fixed: values of variables that are
        held; free: uncertain numbers to free, see `with_freed`; prior: see `calibrate`."""
        self.prior = prior
        self.measured, self.fixed = measured or case.measured, dict(fixed or {})
        case = with_freed(case, free)
        self._plain = with_values(case, {**start_values(case), **self.fixed})
        self.evaluator = evaluator.of(design_of(self._plain))
        file = self.measured
        self.readings, self.shapes = readings_with_shapes(self._plain, file) if file else ([], [])
        self.needs_labels = any(each.is_unlabelled for each in self.readings)
        self.used: Sequence[Measurement] = ()  # readings that targets are made of
        self.case, self.left_out = self._plain, list[str]()
        if not self.needs_labels:
            self._set_targets(self.readings)
            check(self._problem())

    def _set_targets(self, readings: Sequence[Measurement]) -> None:
        """Targets of the case, or ``readings`` of the measured file that have labels. Raises
        InputError."""
        self.used = readings
        if self.measured:
            self.case, self.left_out = with_measured(self._plain, self.measured, readings)
        else:
            self.case, self.left_out = in_set_state(self._plain, self.fixed)
        self.evaluator.design = design_of(self.case)

    def _problem(self, notify: FitNotify | None = None, jobs: int = 1) -> Problem:
        kind = PriorProblem if self.prior else Problem
        return kind(self.case, self.evaluator, self.fixed, notify, jobs)

    @property
    def evaluates_one_by_one(self) -> bool:
        """Whether one start runs the solver once at a time: in one state, with exact slopes."""
        if self.needs_labels:
            one_state = len({each.state.of(self._plain) for each in self.readings}) == 1
        else:
            problem = self._problem()
            exact = problem.exact_on_road == len(problem.road)
            on_road = {each.state.unloaded for each in problem.road}
            one_state = exact and len(problem.labels) == 1 and len(on_road) <= 1
        return one_state and self.evaluator.has_gradients

    def run_plan(self, method: str, starts: int, jobs: int) -> RunPlan:
        """Size, runs and likely time of the designs of a fit, in all states."""
        free = [name for name in self._plain.case.variables if name not in self.fixed]
        if self.needs_labels:
            loaded = [each for each in self.readings if each.load_N]
            places = {(each.state, each.label is not None) for each in loaded}
            states = {each.state.of(self._plain) for each in self.readings if not each.load_N}
            exact = False
        else:
            problem = self._problem()
            places = {(each.state, bool(each.member)) for each in problem.road}
            states = {*problem.labels}
            exact = problem.exact_on_road > 0
        loads = Counter((state.unloaded, modal) for state, modal in places)
        slopes = (len(free), 0) if self.evaluator.has_gradients else (0, len(free))
        # loads, modes at loads, variables with exact sensitivities, neighbours for differences
        planned = [PlannedState(0, False, *slopes) for _ in states]
        planned += [
            PlannedState(count, modal, *((len(free), 0) if exact and not modal else (0, len(free))))
            for (_, modal), count in loads.items()
        ]
        designs = DESIGNS_OF_FIT[method] * starts
        at_once = starts if starts > 1 else sum(1 + each.neighbours for each in planned)
        return plan_runs(self.case, self.evaluator, planned, designs, min(jobs, at_once), True)

    def run(
        self,
        method: str = "slsqp",
        starts: int = 1,
        seed: int = 0,
        jobs: int = 1,
        notify: FitNotify | None = None,
        finished: Callable[[int, int], None] = lambda done, starts: None,
    ) -> Fit:
        """Calibrate, as `calibrate` says; the result has its provenance.

        Frequencies without labels are fitted with the likeliest ones, which are found anew about
        the design that was fitted, until they are the same. Raises what `label` and `calibrate` do.
        """
        plan = self.run_plan(method, starts, jobs)
        jobs = plan.at_once if plan.on_road else jobs  # as the memory allows

        def calibrated() -> Fit:
            problem = self._problem(notify, jobs)
            return calibrate(problem, method, starts, seed, finished, self.used)

        fit = self._fit_with_labels(calibrated, jobs) if self.needs_labels else calibrated()
        self._compare_shapes(fit)
        fit.found, fit.left_out = fit.found.stamped(self.provenance), fit.left_out + self.left_out
        fit.found.with_files({"fit_history.csv": history_csv(fit.history)})
        return fit

    @property
    def provenance(self) -> Json:
        """The block ``provenance`` of the result."""
        files = [self.measured] if self.measured else []
        case = without_freed(self.case)
        return provenance(case, self.evaluator.solver, files, **states_of(self.case))

    def _compare_shapes(self, fit: Fit) -> None:
        """Add to the fit how measured shapes agree with the fitted ones, at its pressures; shapes
        that cannot be compared are left out with the reason."""
        compared = []
        states = [state.with_defaults(self.case) for state in fit.fitted.states]
        for test in self.shapes:
            off = lambda state, own=test.pressure_kPa: abs((state.pressure_kPa or 0.0) - own)
            nearest = min(states, key=off)
            if off(nearest) > SAME_PRESSURE_kPa:
                continue
            highest = max([c for mode in test.modes if (c := mode.c) is not None], default=0) + 1
            highest = max(highest, self.case.case.analysis.highest_harmonic)
            values = TyreState(nearest.pressure_kPa).design(self.case, fit.fitted.values)
            try:
                modes = evaluate_case_modes(self.case, self.evaluator, values, highest)
                compared.append(correlate(test, modes))
            except (InputError, EvaluationFailed) as error:
                fit.left_out.append(f"the shapes of {test.file}: {error}")
        if compared:
            fit.found = fit.found.model_copy(update={"shapes": compared})

    def _fit_with_labels(self, calibrated: Callable[[], Fit], jobs: int) -> Fit:
        """Label and fit in turn until the labels stay the same, at most `MAX_FITS` times."""
        case, evaluator, readings, fixed = self._plain, self.evaluator, self.readings, self.fixed
        shapes = self.shapes
        likeliest = label(case, evaluator, readings, fixed=fixed, jobs=jobs, shapes=shapes)
        for _ in range(MAX_FITS):
            used = likeliest
            self._set_targets(used.readings)
            fit = calibrated()
            about = fit.fitted.values
            likeliest = label(case, evaluator, readings, None, about, fixed, jobs, shapes)
            same = likeliest.labels == used.labels
            if same:
                break
        self.shapes = labelled_shapes(case, likeliest)
        last = replace(likeliest.found, settled=likeliest.found.settled and same)
        labels = labels_posterior(case, replace(likeliest, found=last))
        fit.found = fit.found.model_copy(update={"labels": labels})
        return fit
