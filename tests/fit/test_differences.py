"""Slopes by differences to neighbouring designs: which are asked for, how, and where one fails."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.fit.differences import differences
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.variable import DesignVariable

from ..solved import calibrate
from .fake import CASE, START, START_X, evaluator


def asked_slopes(ask: Any, start: dict[str, float], step: float = 0.1, **how: Any) -> Any:
    """Differences of two linear variables within -1 to 1, and the steps that were asked for."""
    variables = [DesignVariable(name, 0.0, -1.0, 1.0, log=False) for name in start]
    steps: list[dict[str, float]] = []

    def told(designs: Any) -> Any:
        steps.extend({n: round(v[n] - start[n], 9) for n in v if v[n] != start[n]} for v in designs)
        return [ask(v) for v in designs]

    return differences(variables, start, step, told, **how), steps


def test_slopes_are_differences_to_one_neighbour_that_has_room() -> None:
    """Per coordinate, which is half the value here; above, or below where a bound is too near."""
    values = lambda v: np.array([3 * v["a"] - v["b"], 2 * v["b"] + 5])
    for start, wanted in (
        ({"a": 0.0, "b": 0.2}, [{}, {"a": 0.2}, {"b": 0.2}]),
        ({"a": 0.8, "b": 0.81}, [{}, {"a": 0.2}, {"b": -0.2}]),
        ({"a": -1.0, "b": 1.0}, [{}, {"a": 0.2}, {"b": -0.2}]),
    ):
        (centre, slopes), steps = asked_slopes(values, start)
        assert steps == wanted and centre == pytest.approx(values(start))
        assert slopes == pytest.approx(np.array([[6.0, -2.0], [0.0, 4.0]]))
        _, steps = asked_slopes(values, start, centre=values(start))
        assert steps == wanted[1:]


def test_a_step_is_a_third_of_the_room_at_most() -> None:
    (_, slopes), steps = asked_slopes(lambda v: np.array([1 + v["a"]]), {"a": 0.0}, 0.9)
    assert steps == [{}, {"a": round(2 / 3, 9)}] and slopes == pytest.approx(np.array([[2.0]]))


def test_a_neighbour_without_a_solution_gives_way_to_the_other() -> None:
    """Without both neighbours there is no sensitivity; without a licence the solver does not
    run."""

    def failing(cause: str, both: bool) -> Any:
        failure = EvaluationFailed(cause, "not there")
        return lambda v: failure if v["a"] > 0 or (both and v["a"] < 0) else np.array([1 + v["a"]])

    (_, slopes), _ = asked_slopes(failing("no_equilibrium", False), {"a": 0.0})
    assert slopes == pytest.approx(np.array([[2.0]]))
    for ask, count in ((failing("no_equilibrium", True), 3), (failing("licence", False), 2)):
        seen: list[Any] = []
        with pytest.raises(EvaluationFailed, match="not there"):
            asked_slopes(lambda v, ask=ask, seen=seen: seen.append(v) or ask(v), {"a": 0.0})  # type: ignore[misc]
        assert len(seen) == count
    with pytest.raises(EvaluationFailed, match="not there"):
        asked_slopes(lambda v: EvaluationFailed("crashed", "not there"), {"a": 0.0})


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
    """A variable at a bound has one neighbour only; if that fails, no other replaces it."""
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
