"""The result of a fit: what happened, what moved, which bounds hold, the state it was fitted in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.studies.fit.build_result import StartReport, fit_result
from tyrecal.studies.fit.calibrate import history_csv
from tyrecal.studies.fit.problem import Problem

from ..calibrated import calibrate
from .fake import CASE, LABELS, POWERS, START, START_X, TARGETS, TRUTH, FakeEvaluator, evaluator


def test_says_that_it_did_not_move() -> None:
    """Frequencies that nothing changes: converged at once, and not moved."""
    fit = calibrate(CASE, evaluator(powers={n: 0 * p for n, p in POWERS.items()}))  # type: ignore[arg-type]
    assert fit.result["converged"] and not fit.result["moved"]
    assert not fit.found.is_good
    assert not fit.found.model_copy(update={"converged": False, "moved": True}).is_good
    assert fit.found.model_copy(update={"moved": True}).is_good
    assert fit.result["singular_values"] == [0.0, 0.0, 0.0]
    assert all(v["standard_error"] is None for v in fit.result["variables"].values())


def test_a_bound_that_holds_is_reported() -> None:
    fit = calibrate(CASE, evaluator({**TRUTH, "A_belt": 3e-8}))  # type: ignore[arg-type]
    belt = fit.result["variables"]["A_belt"]
    assert belt["at_bound"] and belt["value"] == belt["lower"]
    assert fit.result["converged"]


@pytest.mark.parametrize("held", [False, True])
def test_a_pressure_that_varies_is_told_as_it_was_fitted(held: bool) -> None:
    """The result has the fitted pressure with its frequencies and mass, not that of the case."""
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


def test_the_result_says_what_happened() -> None:
    """Points, failures, when the objective was near its end, and deviations, from the history."""
    fails = lambda values: values["A_belt"] > 1.005 * TRUTH["A_belt"]
    fit = calibrate(CASE, evaluator(fails=fails), starts=3, seed=1)  # type: ignore[arg-type]
    result, history = fit.result, fit.history
    objectives = [row["objective_Hz"] for row in history]
    assert [row["point"] for row in history] == list(range(1, len(history) + 1))
    assert [row["start"] for row in history] == sorted(row["start"] for row in history)
    assert {row["start"] for row in history} == {1, 2, 3}
    assert [s["evaluations"] for s in result["starts"]] == [
        sum(row["start"] == k for row in history) for k in (1, 2, 3)
    ]
    failed = [row for row in history if row["objective_Hz"] is None]
    assert result["failed_evaluations"] == len(failed) > 0 and result["replaced_starts"] > 0
    assert result["gradient_evaluations"] == len(history) - len(failed)
    assert all((row["failure"] is None) == (row["objective_Hz"] is not None) for row in history)
    near = [f is not None and f < result["objective_Hz"] + 0.05 for f in objectives]
    assert result["evaluations_to_0.05_Hz"] == near.index(True) + 1 > 2
    assert result["objective_Hz"] == min(s["objective_Hz"] for s in result["starts"])
    assert result["objective_Hz"] == fit.fitted.objective < result["initial_objective_Hz"]
    assert result["initial_objective_Hz"] == fit.initial.objective == objectives[0]
    for mode, label in zip(result["modes"], LABELS, strict=True):
        assert (mode["c"], mode["m"], mode["kind"]) == (label.c, label.m, label.kind)
        share = mode["fitted_Hz"] / mode["target_Hz"] - 1
        assert mode["deviation_percent"] == pytest.approx(100 * share)
        assert mode["initial_Hz"] == fit.initial.modes[label].frequency_Hz
        assert mode["fitted_Hz"] == mode["frequency_Hz"] == fit.fitted.modes[label].frequency_Hz
    for i, a in enumerate(result["variables"]):
        assert result["correlations"][a][a] == pytest.approx(1)
        one = result["variables"][a]
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
    variables = fit_result(problem, point, [report], history, 0, "slsqp").variables
    assert [one.at_bound for one in variables.values()] == [False, False, at_bound]


@pytest.mark.parametrize(("change", "moved"), [(1.1e-6, True), (-1.1e-6, True), (0.9e-6, False)])
def test_a_fit_has_moved_by_more_than_a_millionth(change: float, moved: bool) -> None:
    problem = Problem(CASE, evaluator())  # type: ignore[arg-type]
    first, last = problem.evaluate(START_X), problem.evaluate(START_X + change * np.eye(3)[1])
    report = StartReport({}, last, "", True, [])
    history = [{"objective_Hz": last.objective, "values": {}}]
    assert fit_result(problem, first, [report], history, 0, "slsqp").moved == moved
