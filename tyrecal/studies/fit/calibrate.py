"""The calibration of a case, from one start or many, and its result."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...errors import InputError
from ...files import Json
from ...measured.measurement import Measurement
from ...simulate.evaluate.evaluator import Counts
from ...simulate.evaluate.executor import executor, in_order
from ...simulate.evaluate.failure import EvaluationFailed
from ...tyre.case.schema import cannot_fit
from ...tyre.state import pressure_name
from ..inference.check_units import far_off
from ..notebook import Notebook
from ..result import csv_text
from . import gauss_newton, slsqp
from .build_result import StartReport, fit_result
from .judge import measured_rows
from .model_errors import needs_model_errors
from .problem import Point, Problem
from .result import FitResult
from .search import AT_CROSSING, CONVERGED, Descend, is_converged, minimise
from .verdict import FIT_VERDICT_WORDS

Array = np.ndarray
METHODS: dict[str, Descend] = {"slsqp": slsqp.descend, "gauss-newton": gauss_newton.descend}
TOLERANCE = 1e-3  # projected gradient, Hz per unit of a logarithm: 1e-5 Hz for a change of 1 %
SLOPE_NOISE_HZ = 50.0  # error of d f / d x by differences, over a step that suits the digits
SLOPE_ERROR = 1e-4  # error of d ln q / d x of patches and stiffnesses: curvature within a step
MAX_WEIGHINGS = 4  # times that a fit takes the weights anew, of the design where it ended
MAX_REPLACED = 20  # replaced starts per start asked for


@dataclass
class Fit(Notebook):
    """A finished fit."""

    found: FitResult  # what fit.json holds: `result` is its content
    history: list[Json]  # design points in order, rows of fit_history.csv
    initial: Point  # at the case's start values
    fitted: Point  # at the least objective of all starts
    left_out: list[str] = field(default_factory=list)  # sentences on measurements without a target

    def __repr__(self) -> str:
        result, before, after = self.found, self.initial.objective, self.fitted.objective
        ended = FIT_VERDICT_WORDS[result.verdict]
        values = ", ".join(f"{name}={each.value:.4g}" for name, each in result.variables.items())
        return f"Fit({ended}, {before:.4g} to {after:.4g} {result.objective_unit}: {values})"

    @property
    def shown(self) -> FitResult:
        return self.found

    @property
    def result(self) -> Json:
        """The content of fit.json."""
        return self.found.content()


def calibrate(
    problem: Problem,
    method: str = "slsqp",
    starts: int = 1,
    seed: int = 0,
    finished: Callable[[int, int], None] = lambda done, starts: None,
    readings: Sequence[Measurement] = (),
) -> Fit:
    """Fit the problem's variables to its targets.

    starts: the case's own start and ``starts - 1`` drawn uniformly within the bounds, in the
    variables' coordinates; drawn starts that cannot be evaluated are counted and replaced, and
    ``problem.jobs`` of them run at a time. finished: called for every start. readings: lines of the
    file that the targets are from. Raises what `check` does; EvaluationFailed if the case's own
    start cannot be evaluated; InputError if a target is far off it.

    >>> problem = Problem(case, evaluator, fixed={"A_belt": 2.6e-7, "A_carcass": 6.9e-8})
    >>> fit = calibrate(problem, method="gauss-newton")
    >>> f"{fit.initial.objective:.1f} to {fit.fitted.objective:.1f} Hz"
    '17.4 to 3.7 Hz'
    """
    check(problem)
    if problem.spread is not None:
        problem.noise_Hz = noise_Hz(problem)
    initial = problem.evaluate(problem.start())
    if not np.isfinite(initial.objective):
        raise InputError("the targets' weights and standard deviations leave no finite objective")
    _refuse_far_off(problem, initial, readings)
    reports = [_run(problem, problem.start(), method)]
    replaced = 0
    if starts > 1:
        more, replaced = _more_starts(problem, starts - 1, seed, method, finished)
        reports += more
    history = _joined([r.history for r in reports])
    result = fit_result(problem, initial, reports, history, replaced, method, readings)
    fitted = min((report.point for report in reports), key=lambda point: point.objective)
    return Fit(result, history, initial, fitted)


def noise_Hz(problem: Problem) -> float | None:
    """Standard deviation, Hz, that a fit without a prior leaves to targets without one; None where
    all have one.

    Raises InputError where too few targets are left over to tell.
    """
    if all(target.sigma for target in problem.targets if target.weight):
        return None
    plain, noise = Problem(problem.case, problem.evaluator, problem.fixed, jobs=problem.jobs), None
    if not cannot_fit([t.weight for t in plain.measured], len(plain.variables)):
        noise = calibrate(plain).found.noise_Hz
    if noise is None:
        raise InputError(
            "the targets have no sigma_Hz, and are too few to estimate it from the residuals:"
            " state sigma_Hz, or give measurements with --measured"
        )
    return noise


def check(problem: Problem) -> None:
    """Raise InputError for a problem that no fit can solve; DeckRefused if the solver has no road
    for targets on it, cannot express the state of a target, or lacks sensitivities that a prior
    needs."""
    if not len(problem.scale):
        raise InputError(
            "the case has no targets: there is nothing to fit to; add measured modes to it, as in"
            " targets: {modes: [{c: 2, m: 0, frequency_Hz: 79.5}, ...]}"
        )
    if not problem.variables:
        raise InputError("no variable is free: there is nothing to fit")
    needed = len(problem.variables) if problem.spread is None else 1
    if reason := cannot_fit([t.weight for t in problem.measured], needed):
        raise InputError(reason)
    if problem.spread is not None:
        needs_model_errors(problem)
    if problem.road:
        problem.evaluator.needs_road(modes=any(t.member for t in problem.road))
    for state in {t.state.unloaded for t in problem.measured}:
        own = state.numbers(problem.case)
        for each in problem.variables:
            if "pressure_kPa" in own and pressure_name(problem.case) == each.name:
                if each.name in problem.freed:
                    raise InputError(f"--free {each.name}: the targets state their pressure")
                raise InputError(
                    f"variable '{each.name}' sets pressure_kPa, which targets state: hold it with"
                    f" --fix {each.name}"
                )
        if own:
            problem.evaluator.refuse_lacking(problem.evaluator.design.at(own))


def _refuse_far_off(problem: Problem, initial: Point, readings: Sequence[Measurement]) -> None:
    """Raises InputError for a target that is not even near the model's start."""
    rows = measured_rows(problem, readings)
    for target, row in zip(problem.targets, rows, strict=False):
        mode = initial.states[target.state][target.label]
        if words := far_off(row.name, target.frequency_Hz, mode.frequency_Hz):
            raise InputError(f"{row.place}: {words}")


def _run(problem: Problem, start: Array, method: str) -> StartReport:
    """One search from ``start`` (v,), and whether it converged."""
    first = problem.evaluate(start)
    tolerance = _tolerance(problem)
    outcome = minimise(problem, start, tolerance, METHODS[method])
    for _ in range(MAX_WEIGHINGS):
        if problem.is_settled(outcome.point):
            break
        problem.weigh(outcome.point)
        outcome = minimise(problem, outcome.point.x, tolerance, METHODS[method])
    converged = is_converged(problem, outcome.point, max(10 * TOLERANCE, tolerance))
    converged = converged or outcome.message in (CONVERGED, AT_CROSSING)
    values, history = dict(first.values), _history(problem)
    return StartReport(values, outcome.point, outcome.message, converged, history)


def _tolerance(problem: Problem) -> float:
    """Largest projected gradient that counts as 0, given how exact the slopes are."""
    modal = SLOPE_NOISE_HZ * (problem.difference_step or 0.0)
    sigma = min((t.sigma_Hz or 1.0 for t in problem.targets), default=1.0)
    pressed = SLOPE_ERROR * float(np.linalg.norm([t.scale * t.value for t in problem.road]))
    return max(TOLERANCE, modal / sigma + pressed)


def _more_starts(
    problem: Problem, count: int, seed: int, method: str, finished: Callable[[int, int], None]
) -> tuple[list[StartReport], int]:
    """Searches from ``count`` random starts, and how many starts without a solution were
    replaced."""
    generator = np.random.default_rng(seed)
    reports: list[StartReport] = []
    replaced = 0
    finished(1, count + 1)
    while len(reports) < count:
        drawn = [
            generator.uniform(problem.lower, problem.upper) for _ in range(count - len(reports))
        ]
        for answer in _run_all(problem, drawn, method):
            if isinstance(answer, EvaluationFailed):
                replaced += 1
            else:
                reports.append(answer)
                finished(len(reports) + 1, count + 1)
        if replaced > MAX_REPLACED * count:
            raise EvaluationFailed(
                "no_equilibrium",
                f"{replaced} drawn starts could not be evaluated: the bounds hold too few tyres",
            )
    return reports, replaced


def _run_all(
    problem: Problem, starts: list[Array], method: str
) -> Iterator[StartReport | EvaluationFailed]:
    """Answers in the order of the starts; ``jobs`` at a time, or by the evaluator's scheduler."""
    if problem.jobs <= 1 and not problem.evaluator.scheduler:
        yield from (_start_here(problem, x, method) for x in starts)
        return
    evaluator = problem.evaluator.worker()
    tasks = [(problem.again(evaluator), x, method) for x in starts]
    with executor(problem.jobs, problem.evaluator.scheduler) as workers:
        for answer in in_order(workers.each(_start_alone, tasks)):
            if isinstance(answer, EvaluationFailed):  # its process died
                raise answer
            report, counts = answer
            problem.evaluator.counts.add(counts)
            yield report


def _start_here(problem: Problem, start: Array, method: str) -> StartReport | EvaluationFailed:
    """One search in this process, or why its start has no solution."""
    alone = problem.again(problem.evaluator, problem.notify)
    try:
        return _run(alone, start, method)
    except EvaluationFailed as failure:
        return failure


def _start_alone(task: tuple[Problem, Array, str]) -> tuple[StartReport | EvaluationFailed, Counts]:
    problem, start, method = task
    return _start_here(problem, start, method), problem.evaluator.counts


def _history(problem: Problem) -> list[Json]:
    """Entries of fit_history.csv: objective, or failure, and values of each design point."""
    names = list(problem.fixed) + [v.name for v in problem.variables]
    return [
        {
            "objective_Hz": p.objective if isinstance(p, Point) else None,
            "failure": None if isinstance(p, Point) else p.words,
            "values": dict(zip(names, key, strict=True)),
        }
        for key, p in problem.points.items()
    ]


def _joined(histories: list[list[Json]]) -> list[Json]:
    """Histories of all starts in one list, with number of point and start."""
    rows: list[Json] = []
    for start, history in enumerate(histories, start=1):
        for row in history:
            rows.append({"point": len(rows) + 1, "start": start, **row})
    return rows


def history_csv(history: list[Json]) -> str:
    """All design points as CSV: point, start, variables, objective_Hz, failure."""
    names = list(history[0]["values"])
    keys = ["point", "start", *names, "objective_Hz", "failure"]
    return csv_text(keys, ({**row["values"], **row} for row in history), end="\r\n")
