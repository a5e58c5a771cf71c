"""The calibration loop: objective, optimisers, uncertainty, and what it says when it cannot."""

from __future__ import annotations

from contextlib import nullcontext
from copy import copy, deepcopy
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Counts, Evaluator, Question
from tyrecal.simulate.evaluate.executor import Here
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.studies.fit import calibrate as calibrate_module
from tyrecal.studies.fit.calibrate import calibrate, history_csv
from tyrecal.studies.fit.crossing import crossing, gap
from tyrecal.studies.fit.problem import Problem, objective
from tyrecal.studies.fit.result import StartReport, fit_result
from tyrecal.studies.fit.slsqp import _beyond_crossing
from tyrecal.studies.fit.targets import Target, read_targets
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.case.schema import Targets
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import AS_THE_CASE

from ..chance import Chance
from ..conftest import CASES
from .fake import LABELS, FakeEvaluator

CASE = load_case(CASES / "p235_75r17.yaml")
START = start_values(CASE)
START_X = np.log(list(START.values()))
TARGETS = {t.label: t.frequency_Hz for t in read_targets(CASE)}
POWERS = {
    "A_belt": np.array([-0.05, -0.05, -0.05, -0.05, -0.03, -0.05, -0.045, -0.03, -0.04]),
    "A_carcass": np.array([0.03, 0.01, 0.03, 0.04, 0.02, 0.03, 0.02, 0.01, 0.005]),
    "C10": np.array([0.04, 0.19, 0.07, 0.1, 0.11, 0.08, 0.08, 0.11, 0.08]),
}
TRUTH = {"A_belt": 4e-7, "A_carcass": 1.5e-7, "C10": 4.5e5}


def evaluator(truth: dict[str, float] = TRUTH, powers=POWERS, **options) -> FakeEvaluator:
    """A fake tyre that meets the targets exactly at ``truth``."""
    base = {
        label: TARGETS[label]
        * float(np.prod([(START[n] / truth[n]) ** p[i] for n, p in powers.items()]))
        for i, label in enumerate(LABELS)
    }
    return FakeEvaluator(base, powers, START, **options)


def test_objective_by_hand_from_the_papers_table_2() -> None:
    """Its columns give 33.13 and 8.603 Hz by equation (1), doublets counted twice."""
    initial = [36.85, 37.17, 43.85, 65.07, 76.33, 86.65, 104.36, 117.07, 122.65]
    optimised = [30.86, 35.85, 36.92, 58.75, 68.41, 78.67, 96.42, 107.9, 114.9]
    targets = [Target(label, TARGETS[label]) for label in LABELS]
    at = lambda column: objective(dict(zip(LABELS, column, strict=True)), targets)
    assert at(initial) == pytest.approx(33.13, abs=5e-3)
    assert at(optimised) == pytest.approx(8.603, abs=5e-4)
    assert at([TARGETS[label] for label in LABELS]) == 0.0


@pytest.mark.parametrize("method", ["slsqp", "least-squares"])
@pytest.mark.parametrize("has_gradients", [True, False])
def test_finds_the_truth(method: str, has_gradients: bool) -> None:
    fit = calibrate(CASE, evaluator(has_gradients=has_gradients), method)  # type: ignore[arg-type]
    assert fit.result["converged"] and fit.result["moved"] and "footprint" not in fit.result
    assert fit.result["objective_Hz"] < 0.02
    for name, value in TRUTH.items():
        assert fit.result["variables"][name]["value"] == pytest.approx(value, rel=1e-2)
        assert not fit.result["variables"][name]["at_bound"]


@pytest.mark.parametrize("method", ["slsqp", "least-squares"])
@pytest.mark.parametrize("margin", [0.005, 0.02])
def test_steps_back_from_designs_that_fail(method: str, margin: float) -> None:
    """The truth lies just before a cliff, beyond which there is no equilibrium."""
    fails = lambda values: values["A_belt"] / TRUTH["A_belt"] - 1 > margin
    fit = calibrate(CASE, evaluator(fails=fails), method)  # type: ignore[arg-type]
    assert fit.result["objective_Hz"] < 0.05
    failed = [row for row in fit.history if row["objective_Hz"] is None]
    assert all("inflation stopped" in row["failure"] for row in failed)
    assert fit.result["failed_evaluations"] == len(failed) > 0


@pytest.mark.parametrize("method", ["slsqp", "least-squares"])
def test_goes_round_designs_that_fail(method: str) -> None:
    """Where it would go first, and within 2 % of it, there is no equilibrium."""
    first = calibrate(CASE, evaluator(), method).history[1]["values"]  # type: ignore[arg-type]
    fails = lambda values: all(abs(np.log(values[n] / first[n])) < 0.02 for n in first)
    assert not fails(TRUTH)
    fit = calibrate(CASE, evaluator(fails=fails), method)  # type: ignore[arg-type]
    assert fit.result["objective_Hz"] < 0.05 and fit.result["failed_evaluations"] > 0


@pytest.mark.parametrize("method", ["slsqp", "least-squares"])
def test_converges_on_eigenvalues_of_seven_digits(method: str) -> None:
    """As CalculiX prints them; differences then leave noise in the gradient."""
    base = evaluator(has_gradients=False)
    base.solver = SimpleNamespace(difference_step=1e-3)  # type: ignore[assignment]
    base.round = lambda f: np.sqrt([float(f"{x:.6e}") for x in f**2])
    noisy = [TARGETS[label] * (1 + 0.02 * (-1) ** i) for i, label in enumerate(LABELS)]
    fit = calibrate(with_targets(frequency_Hz=noisy), base, method)  # type: ignore[arg-type]
    assert fit.result["converged"] and fit.result["evaluations"] <= 20
    exact = calibrate(with_targets(frequency_Hz=noisy), evaluator(), method)  # type: ignore[arg-type]
    assert fit.result["objective_Hz"] == pytest.approx(exact.result["objective_Hz"], abs=1e-3)


def test_a_start_that_fails_is_a_failure_not_a_number() -> None:
    with pytest.raises(EvaluationFailed, match="12 of 240 kPa"):
        calibrate(CASE, evaluator(fails=lambda values: True))  # type: ignore[arg-type]


def test_a_design_whose_deck_is_refused_ends_the_fit_and_is_no_point_of_it() -> None:
    """A refusal is a mistake of the case, not of the design."""
    refusing = evaluator()
    answer = refusing.evaluate

    def evaluate(question: Question) -> Evaluation:
        if question.values["C10"] != START["C10"]:
            raise DeckRefused("not honoured")
        return answer(question)

    refusing.evaluate = evaluate  # type: ignore[method-assign]
    with pytest.raises(DeckRefused, match="not honoured"):
        calibrate(CASE, refusing)  # type: ignore[arg-type]


def test_a_neighbour_that_fails_gives_way_to_the_one_on_the_other_side() -> None:
    edge = lambda values: values["C10"] > START["C10"] * 1.00005
    there = Problem(CASE, evaluator(has_gradients=False, fails=edge)).evaluate(START_X)  # type: ignore[arg-type]
    plain = Problem(CASE, evaluator(has_gradients=False)).evaluate(START_X)  # type: ignore[arg-type]
    assert there.jacobian == pytest.approx(plain.jacobian, rel=1e-4)
    assert not (there.jacobian == plain.jacobian).all()


def test_a_point_without_neighbours_fails() -> None:
    alone = lambda values: values["C10"] != START["C10"]
    problem = Problem(CASE, evaluator(has_gradients=False, fails=alone))  # type: ignore[arg-type]
    with pytest.raises(EvaluationFailed, match="12 of 240 kPa") as failure:
        problem.evaluate(START_X)
    assert failure.value.cause == "no_equilibrium"


@pytest.mark.parametrize("bound", ["lower", "upper"])
def test_differences_stay_within_the_bounds(bound: str) -> None:
    """At a bound there is one neighbour only, and where it fails no other takes its place."""
    at = getattr(CASE.case.variables["C10"], bound)
    within = lambda values: not 1e5 <= values["C10"] <= 1e7
    x = np.log([START["A_belt"], START["A_carcass"], at])
    differ = Problem(CASE, evaluator(has_gradients=False, fails=within)).evaluate(x)  # type: ignore[arg-type]
    exact = Problem(CASE, evaluator()).evaluate(x)  # type: ignore[arg-type]
    assert differ.jacobian == pytest.approx(exact.jacobian, rel=1e-4)
    alone = lambda values: values["C10"] != at
    with pytest.raises(EvaluationFailed):
        Problem(CASE, evaluator(has_gradients=False, fails=alone)).evaluate(x)  # type: ignore[arg-type]


def test_jobs_go_to_the_neighbours_of_the_first_start() -> None:
    tyre = evaluator(has_gradients=False)
    plain = calibrate(CASE, tyre)  # type: ignore[arg-type]
    assert set(tyre.jobs) == {1}
    tyre = evaluator(has_gradients=False)
    assert calibrate(CASE, tyre, jobs=8).result == plain.result  # type: ignore[arg-type]
    assert set(tyre.jobs) == {1, 3}  # a point, and its three neighbours


def test_says_that_it_did_not_move() -> None:
    """Frequencies that nothing changes: converged at once, and not moved."""
    fit = calibrate(CASE, evaluator(powers={n: 0 * p for n, p in POWERS.items()}))  # type: ignore[arg-type]
    assert not fit.result["moved"]
    assert fit.result["singular_values"] == [0.0, 0.0, 0.0]
    assert all(v["standard_error"] is None for v in fit.result["variables"].values())


def test_a_bound_that_holds_is_reported() -> None:
    fit = calibrate(CASE, evaluator({**TRUTH, "A_belt": 3e-8}))  # type: ignore[arg-type]
    belt = fit.result["variables"]["A_belt"]
    assert belt["at_bound"] and belt["value"] == belt["lower"]
    assert fit.result["converged"]


def test_a_direction_that_the_data_do_not_see() -> None:
    """Two variables with one pattern: their sum is seen, their difference is not."""
    powers = {**POWERS, "A_carcass": POWERS["A_belt"]}
    fit = calibrate(CASE, evaluator(powers=powers))  # type: ignore[arg-type]
    values = fit.result["singular_values"]
    assert values[-1] < 1e-9 * values[0]
    assert fit.result["variables"]["A_carcass"]["standard_error"] is None
    assert fit.result["variables"]["C10"]["standard_error"] is not None


def test_fixed_variables_stay_and_others_move() -> None:
    fit = calibrate(CASE, evaluator(), fixed={"C10": START["C10"]})  # type: ignore[arg-type]
    assert set(fit.result["variables"]) == {"A_belt", "A_carcass"}
    assert fit.result["fixed"] == {"C10": START["C10"]}
    with pytest.raises(InputError):
        calibrate(CASE, evaluator(), fixed=START)  # type: ignore[arg-type]
    without = replace(CASE, case=CASE.case.model_copy(update={"targets": Targets()}))
    with pytest.raises(InputError):
        calibrate(without, evaluator())  # type: ignore[arg-type]


def test_bounds_that_hold_too_few_tyres_end_the_drawing_of_starts() -> None:
    """Twenty are replaced for each that is asked for."""
    asked: list[tuple[int, int]] = []
    with pytest.raises(EvaluationFailed, match="the bounds hold too few") as failure:
        calibrate(
            CASE,
            evaluator(fails=lambda values: values != START),  # type: ignore[arg-type]
            starts=4,
            finished=lambda *done: asked.append(done),
        )
    assert failure.value.words.startswith("63 drawn starts") and asked == [(1, 4)]


class Counting(FakeEvaluator):
    """With counts of its own, wherever it is copied to."""

    counts = Counts()

    def evaluate(self, question: Question) -> Evaluation:
        self.counts.add(Counts(1, 0))
        return super().evaluate(question)

    def worker(self) -> Counting:
        other = copy(self)
        other.counts = Counts()
        return other


def test_starts_of_other_processes_tell_how_often_the_solver_ran(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each has counts of its own, which are added."""

    class Elsewhere(Here):
        def each(self, function: Any, tasks: Any) -> Any:
            return super().each(function, map(deepcopy, tasks))  # type: ignore[arg-type]

    monkeypatch.setattr(calibrate_module, "executor", lambda *asked: nullcontext(Elsewhere()))
    told: list[tuple[int, int]] = []
    results, counts = [], []
    for jobs in (1, 2):
        tyre = Counting(evaluator().base, POWERS, START).worker()
        fit = calibrate(
            CASE,
            tyre,  # type: ignore[arg-type]
            starts=3,
            jobs=jobs,
            finished=lambda *done: told.append(done),
        )
        results.append(fit.result)
        counts.append(tyre.counts)
    assert results[0] == results[1] and counts[0] == counts[1]
    assert counts[0].runs == len(fit.history) and told == [(1, 3), (2, 3), (3, 3)] * 2


def test_a_start_whose_process_dies_ends_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    class Dying(Here):
        def each(self, function: Any, tasks: Any) -> Any:
            yield from (
                (i, EvaluationFailed("crashed", "its process died, twice"))
                for i in range(len(tasks))
            )

    monkeypatch.setattr(calibrate_module, "executor", lambda *asked: nullcontext(Dying()))
    tyre = Counting(evaluator().base, POWERS, START)
    with pytest.raises(EvaluationFailed, match="its process died, twice") as failure:
        calibrate(CASE, tyre, starts=3, jobs=2)  # type: ignore[arg-type]
    assert failure.value.cause == "crashed"


def test_one_start_is_nothing_to_count() -> None:
    told: list[tuple[int, int]] = []
    fit = calibrate(CASE, evaluator(), finished=lambda *done: told.append(done))  # type: ignore[arg-type]
    assert told == [] and len(fit.result["starts"]) == 1 and fit.result["replaced_starts"] == 0


def test_starts_are_drawn_replaced_and_reproducible() -> None:
    fails = lambda values: values["C10"] > 4e6 or values["C10"] < 1.2e5
    first, second = (
        calibrate(CASE, evaluator(fails=fails), starts=8, seed=3)  # type: ignore[arg-type]
        for _ in range(2)
    )
    assert first.result == second.result
    assert first.result["replaced_starts"] > 0
    assert len(first.result["starts"]) == 8
    assert max(s["objective_Hz"] for s in first.result["starts"]) < 0.02
    assert first.result["evaluations"] == len(first.history)


@pytest.mark.parametrize(
    ("name", "level", "expected", "tolerance"),
    [
        ("p235_75r17", "default", 3.115, 0.01),
        pytest.param("p235_75r17", "refined", 3.08, 0.1, marks=pytest.mark.slow),
        ("p235_75r17_narrow_rim", "default", 1.794, 0.01),
        pytest.param("p235_75r17_narrow_rim", "refined", 1.79, 0.1, marks=pytest.mark.slow),
    ],
)
def test_the_papers_case(name: str, level: str, expected: float, tolerance: float) -> None:
    """An independent implementation ends at 3.08 and 1.79 Hz; the paper at 8.59 Hz."""
    case = load_case(CASES / f"{name}.yaml")
    mesh = case.case.mesh.model_copy(update={"level": level})
    case = replace(case, case=case.case.model_copy(update={"mesh": mesh}))
    fit = calibrate(case, Evaluator(TyreDesign(case)))
    result = fit.result
    assert result["objective_Hz"] == pytest.approx(expected, abs=tolerance)
    assert result["evaluations_to_0.05_Hz"] <= 12
    assert result["converged"] and result["projected_gradient_norm"] <= 1e-2
    assert sum(mode["multiplicity"] for mode in result["modes"]) == 16
    assert max(abs(m["deviation_percent"]) for m in result["modes"]) < 5.06


@pytest.mark.slow
def test_both_methods_agree_on_the_real_tyre() -> None:
    slsqp = calibrate(CASE, Evaluator(TyreDesign(CASE))).result
    other = calibrate(CASE, Evaluator(TyreDesign(CASE)), "least-squares").result
    assert other["objective_Hz"] == pytest.approx(slsqp["objective_Hz"], abs=1e-4)
    for name, variable in slsqp["variables"].items():
        assert other["variables"][name]["value"] == pytest.approx(variable["value"], rel=1e-2)


def with_targets(**changes: list) -> LoadedCase:
    """The case with a field of its targets replaced, target by target."""
    modes = [
        t.model_copy(update={name: values[i] for name, values in changes.items()})
        for i, t in enumerate(CASE.case.targets.modes)
    ]
    targets = CASE.case.targets.model_copy(update={"modes": modes})
    return replace(CASE, case=CASE.case.model_copy(update={"targets": targets}))


@pytest.mark.slow
def test_standard_errors_are_those_of_the_fit_that_was_made(chance: Chance) -> None:
    """Unequal sigmas and weights: the scatter of 200 fits to noisy targets is the stated error.

    False failures: 6e-7.
    """
    sigma = np.array([0.05, 0.3, 0.1, 0.2, 0.1, 0.3, 0.05, 0.2, 0.4])
    exact = [t.frequency_Hz for t in CASE.case.targets.modes]
    for weights in ([1.0] * 9, [100.0, 1.0, 1.0, 0.0, 1.0, 5.0, 1.0, 0.2, 1.0]):
        found, stated = [], []
        for _ in range(200):
            noisy = list(exact + sigma * chance.random.normal(size=9))
            case = with_targets(frequency_Hz=noisy, sigma_Hz=list(sigma), weight=weights)
            variables = calibrate(case, evaluator()).result["variables"].values()  # type: ignore[arg-type]
            found.append([np.log(v["value"]) for v in variables])
            stated.append([v["standard_error"] / v["value"] for v in variables])
        for values, error in zip(np.transpose(found), np.mean(stated, axis=0), strict=True):
            chance.scatter(values, error)


def test_targets_that_do_not_count_are_none() -> None:
    with pytest.raises(InputError, match="every target has the weight 0"):
        calibrate(with_targets(weight=[0.0] * 9), evaluator())  # type: ignore[arg-type]


@pytest.mark.parametrize("held", [False, True])
def test_a_pressure_that_varies_is_told_as_it_was_fitted(held: bool) -> None:
    """With the frequencies and the mass that belong to it, not as the case has it."""
    pressure = CASE.case.variables["C10"].model_copy(
        update={"sets": ["pressure_kPa"], "start": 200.0, "lower": 100.0, "upper": 400.0}
    )
    variables = {"C10": CASE.case.variables["C10"], "pressure": pressure}
    case = replace(CASE, case=CASE.case.model_copy(update={"variables": variables}))
    powers = {"C10": POWERS["C10"], "pressure": POWERS["A_belt"]}
    start = {"C10": START["C10"], "pressure": 200.0}
    tyre = FakeEvaluator({label: 1.05 * f for label, f in TARGETS.items()}, powers, start)
    fixed = {"pressure": 250.0} if held else {}
    fit = calibrate(case, tyre, fixed=fixed)  # type: ignore[arg-type]
    assert fit.result["pressure_kPa"] == fit.fitted.values["pressure"] != 240.0


def test_as_many_variables_as_data_tell_nothing_of_the_noise() -> None:
    weights = [1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    result = calibrate(with_targets(weight=weights), evaluator()).result  # type: ignore[arg-type]
    assert result["noise_Hz"] is None
    assert all(v["standard_error"] is None for v in result["variables"].values())


def test_fewer_data_than_variables_are_said_to_be_too_few() -> None:
    one = [1.0] + [0.0] * 8
    with pytest.raises(InputError, match="1 target cannot determine 3 free variables"):
        calibrate(with_targets(weight=one), evaluator())  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_design_that_the_case_cannot_have_is_stepped_back_from() -> None:
    """C10 + C01 must be positive, which the bounds of C01 alone do not say."""
    variable = CASE.case.variables["C10"].model_copy(
        update={
            "sets": ["materials.rubber.C01_Pa"],
            "scale": "linear",
            "start": 0.0,
            "lower": -9e5,
            "upper": 9e5,
        }
    )
    variables = {"A_belt": CASE.case.variables["A_belt"], "C01": variable}
    rubber = CASE.case.materials["rubber"].model_copy(update={"C10_Pa": 5e5})
    materials = {**CASE.case.materials, "rubber": rubber}
    changed = {"variables": variables, "materials": materials}
    changed["mesh"] = CASE.case.mesh.model_copy(update={"level": "coarse"})
    case = replace(CASE, case=CASE.case.model_copy(update=changed))
    result = calibrate(case, Evaluator(TyreDesign(case)), starts=4, seed=0).result
    assert result["replaced_starts"] > 0
    assert len(result["starts"]) == 4


def test_no_crossing_is_looked_for_where_the_pair_has_no_weight() -> None:
    problem = Problem(with_targets(weight=[0.0, 0.0] + [1.0] * 7), evaluator())  # type: ignore[arg-type]
    assert list(_beyond_crossing(problem, problem.evaluate(problem.start()))) == []


def test_an_objective_that_no_computer_holds_is_refused() -> None:
    targets = CASE.case.targets
    heavy = [mode.model_copy(update={"sigma_Hz": 1e-300}) for mode in targets.modes]
    update = {"targets": targets.model_copy(update={"modes": heavy})}
    case = replace(CASE, case=CASE.case.model_copy(update=update))
    with np.errstate(over="ignore"), pytest.raises(InputError, match="no finite objective"):
        calibrate(case, evaluator())


@pytest.mark.parametrize("weights", [[1.0] * 9, [4.0, 0.25, *[1.0] * 7]])
def test_slopes_at_a_crossing_are_those_of_the_difference(weights: list[float]) -> None:
    """Of axial less torsional frequency in Hz, whatever the targets weigh, on distinct modes."""
    problem = Problem(with_targets(weight=weights), evaluator())  # type: ignore[arg-type]
    far, point = problem.evaluate(START_X + 0.2), problem.evaluate(START_X)
    found = crossing(problem, [far, point], point)
    assert found is not None and found.x is point.x
    assert found.value == pytest.approx(gap(point, AS_THE_CASE), rel=1e-6)
    h = 1e-4
    for k, e in enumerate(h * np.eye(len(START_X))):
        wanted = gap(problem.evaluate(START_X + e), AS_THE_CASE) - gap(
            problem.evaluate(START_X - e), AS_THE_CASE
        )
        assert found.slopes[k] == pytest.approx(wanted / (2 * h), rel=1e-5)
    assert found.at(point.x + e) == pytest.approx(
        gap(problem.evaluate(point.x + e), AS_THE_CASE), abs=1e-6
    )


def test_the_result_says_what_happened() -> None:
    """Points, failures, when the objective was near its end, and deviations, from the history."""
    fails = lambda values: values["A_belt"] > 1.005 * TRUTH["A_belt"]
    fit = calibrate(CASE, evaluator(fails=fails), starts=3, seed=1)  # type: ignore[arg-type]
    told, history = fit.result, fit.history
    objectives = [row["objective_Hz"] for row in history]
    assert [row["point"] for row in history] == list(range(1, len(history) + 1))
    assert [row["start"] for row in history] == sorted(row["start"] for row in history)
    assert {row["start"] for row in history} == {1, 2, 3}
    assert [s["evaluations"] for s in told["starts"]] == [
        sum(row["start"] == k for row in history) for k in (1, 2, 3)
    ]
    failed = [row for row in history if row["objective_Hz"] is None]
    assert told["failed_evaluations"] == len(failed) > 0 and told["replaced_starts"] > 0
    assert told["gradient_evaluations"] == len(history) - len(failed)
    assert all((row["failure"] is None) == (row["objective_Hz"] is not None) for row in history)
    near = [f is not None and f < told["objective_Hz"] + 0.05 for f in objectives]
    assert told["evaluations_to_0.05_Hz"] == near.index(True) + 1 > 2
    assert told["objective_Hz"] == min(s["objective_Hz"] for s in told["starts"])
    assert told["objective_Hz"] == fit.fitted.objective < told["initial_objective_Hz"]
    assert told["initial_objective_Hz"] == fit.initial.objective == objectives[0]
    for mode, label in zip(told["modes"], LABELS, strict=True):
        assert (mode["c"], mode["m"], mode["kind"]) == (label.c, label.m, label.kind)
        share = mode["fitted_Hz"] / mode["target_Hz"] - 1
        assert mode["deviation_percent"] == pytest.approx(100 * share)
        assert mode["initial_Hz"] == fit.initial.modes[label].frequency_Hz
        assert mode["fitted_Hz"] == mode["frequency_Hz"] == fit.fitted.modes[label].frequency_Hz
    for i, a in enumerate(told["variables"]):
        assert told["correlations"][a][a] == pytest.approx(1)
        one = told["variables"][a]
        assert one["initial"] == START[a] and one["value"] == fit.fitted.values[a]
        assert (one["lower"], one["upper"]) == (
            CASE.case.variables[a].lower,
            CASE.case.variables[a].upper,
        )
        assert fit.fitted.x[i] == pytest.approx(np.log(one["value"]))
    lines = history_csv(history).splitlines()
    assert lines[0] == "point,start,A_belt,A_carcass,C10,objective_Hz,failure"
    assert len(lines) == len(history) + 1
    first = lines[1].split(",")
    assert [float(cell) for cell in first[:-1]] == [1, 1, *START.values(), objectives[0]]
    assert first[-1] == "" and any("inflation stopped" in line for line in lines)


@pytest.mark.parametrize(("gap", "at_bound"), [(0.9e-6, True), (1.1e-6, False)])
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_variable_is_at_a_bound_to_a_millionth(gap: float, at_bound: bool, side: str) -> None:
    problem = Problem(CASE, evaluator())  # type: ignore[arg-type]
    x = START_X.copy()
    x[2] = problem.lower[2] + gap if side == "lower" else problem.upper[2] - gap
    point = problem.evaluate(x)
    report = StartReport({}, point, "", True, [])
    history = [{"objective_Hz": point.objective, "values": {}}]
    found = fit_result(problem, point, report, [report], history, 0, "slsqp").variables
    assert [one.at_bound for one in found.values()] == [False, False, at_bound]


@pytest.mark.parametrize(("change", "moved"), [(1.1e-6, True), (-1.1e-6, True), (0.9e-6, False)])
def test_a_fit_has_moved_by_more_than_a_millionth(change: float, moved: bool) -> None:
    problem = Problem(CASE, evaluator())  # type: ignore[arg-type]
    first, last = problem.evaluate(START_X), problem.evaluate(START_X + change * np.eye(3)[1])
    report = StartReport({}, last, "", True, [])
    history = [{"objective_Hz": last.objective, "values": {}}]
    assert fit_result(problem, first, report, [report], history, 0, "slsqp").moved == moved
