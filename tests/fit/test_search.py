"""The steps of both methods where residuals are linear and every answer is known by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from tyrecal.studies.fit import gauss_newton, search
from tyrecal.studies.fit.calibrate import METHODS, _tolerance
from tyrecal.studies.fit.crossing import AXIAL, TORSIONAL
from tyrecal.studies.fit.problem import Point
from tyrecal.studies.fit.targets import Target

from ..chance import generator
from .linear import Linear, linear, point

Array = np.ndarray


def minimise(method: str, problem: Any, start: Array, tolerance: float) -> search.Descent:
    return search.minimise(problem, start, tolerance, METHODS[method])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("box", [10.0, 0.3])
def test_a_linear_problem_in_a_box_is_solved_in_a_few_steps(method: str, box: float) -> None:
    """The solution is the least sum of squares in the box, with active sides or none."""
    counts = []
    for key in range(5):
        problem = linear(key, box)
        end = minimise(method, problem, np.zeros(3), 1e-3)
        exact = lsq_linear(problem.J, problem.y, (problem.lower, problem.upper), method="bvls").x
        assert end.message == "converged"
        assert end.point.x == pytest.approx(exact, abs=2e-3)
        lowest = np.linalg.norm(problem.J @ exact - problem.y)
        assert end.point.objective == pytest.approx(lowest, abs=1e-6)
        assert search.projected_gradient(problem, end.point) <= 1e-3
        counts.append(len(problem.asked))
    assert max(counts) <= 15, counts


@pytest.mark.parametrize("method", METHODS)
def test_an_exact_fit_is_enough(method: str) -> None:
    """An objective of 1e-3 Hz is below every resolution: no step is taken from there."""
    for size, steps in ((0.99e-3, False), (1.01e-3, True)):
        problem: Any = Linear(np.eye(3), np.array([size, 0, 0]))
        minimise(method, problem, np.zeros(3), 1e-12)
        assert (len(problem.asked) > 1) == steps


@pytest.mark.parametrize("method", METHODS)
def test_where_nothing_is_lower_the_search_ends_and_says_so(method: str) -> None:
    """Slopes that promise what no step holds: it stops before its steps are used up, where it
    began."""
    problem = linear()
    problem.added = lambda x: 1e3 * bool(x.any())
    end = minimise(method, problem, np.zeros(3), 1e-6)
    assert "no lower objective along" in end.message
    assert not end.point.x.any()
    assert min(np.linalg.norm(x) for x in problem.asked if x.any()) < 1e-3  # however short


@pytest.mark.parametrize("method", METHODS)
def test_what_is_as_high_as_before_is_not_lower(method: str) -> None:
    """Residuals that stay what they are, to the last bit, whatever their slopes promise."""
    problem = linear()
    answer = problem.evaluate
    problem.evaluate = lambda x: replace(answer(x), residuals=-problem.y)
    end = minimise(method, problem, np.zeros(3), 1e-6)
    assert "no lower objective along" in end.message and not end.point.x.any()


@pytest.mark.parametrize("method", METHODS)
def test_a_step_beyond_what_has_a_solution_is_taken_back(method: str) -> None:
    """The step is reduced to a sixteenth at least: the wall is at a tenth of the way."""
    problem: Any = Linear(np.eye(3), np.array([0.8, 0.4, 0.2]))
    problem.wall = lambda x: x[0] > 0.08
    end = minimise(method, problem, np.zeros(3), 1e-6)
    assert 0 < end.point.x[0] <= 0.08
    assert end.point.objective < np.linalg.norm(problem.y) - 0.04


def test_the_first_step_is_gauss_and_newtons_damped() -> None:
    problem = linear()
    at, none = problem.evaluate(np.zeros(3)), np.zeros((7, 3, 3))
    for damping in (0.1, 3.0):
        step = gauss_newton._step(problem, at, none, damping, None)
        H = problem.J.T @ problem.J
        H += damping * np.trace(H) / 3 * np.eye(3)
        assert step == pytest.approx(np.linalg.solve(H, problem.J.T @ problem.y), abs=1e-6)
        gain = at.objective**2 - problem.evaluate(step).objective ** 2
        assert gauss_newton.promised(at, none, step) == pytest.approx(gain)


@pytest.mark.parametrize("method", METHODS)
def test_a_step_that_promised_too_much_is_taken_shorter(method: str) -> None:
    """Were it taken whole, it would be far worse than a part of it."""
    problem: Any = Linear(np.eye(1), np.array([1.0]))
    problem.added = lambda x: 20 * x * abs(x)
    end = minimise(method, problem, np.zeros(1), 1e-3)
    assert 0 < end.point.x[0] < 0.3 and end.point.objective < 1


def test_steps_learn_the_curvature() -> None:
    """Residuals J x + x . H x / 2 - y that do not vanish at the optimum, where Gauss
    and Newton converge linearly: with the curvature learnt it takes far fewer designs."""

    class Curved(Linear):
        def evaluate(self, x: Array) -> Point:
            self.asked.append(x)
            return point(x, self.J @ x + H @ x @ x / 2 - self.y, self.J + H @ x)

    designs: dict[str, list[int]] = {method: [] for method in METHODS}
    for key in range(5):
        random = generator("curved", key)
        H = random.normal(size=(7, 3, 3))
        H = 0.2 * (H + H.swapaxes(1, 2))
        J, y = random.normal(size=(7, 3)), 2 * random.normal(size=7)
        ends = []
        for method in METHODS:
            problem: Any = Curved(J, y)
            end = minimise(method, problem, np.zeros(3), 1e-6)
            ends.append(end.point.objective)
            designs[method].append(len(problem.asked))
        assert ends[0] == pytest.approx(ends[1], rel=1e-9)
    assert sum(designs["gauss-newton"]) < 0.7 * sum(designs["slsqp"]), designs


def test_what_pushes_against_a_bound_does_not_count() -> None:
    """The gradient within 1e-9 of a bound counts only if it leads inside."""
    problem: Any = SimpleNamespace(lower=np.full(2, -1.0), upper=np.full(2, 1.0))
    norm = lambda x, g: search.projected_gradient(problem, point(x, [1.0], [g]))
    assert norm([0.0, 0.0], [3.0, 4.0]) == pytest.approx(5.0)
    for side in (-1.0, 1.0):
        held = side * (1 - 0.9e-9), 0.0
        assert norm(held, [-3.0 * side, 4.0]) == pytest.approx(4.0)  # lower only outside
        assert norm(held, [3.0 * side, 4.0]) == pytest.approx(5.0)
        assert norm((side * (1 - 1.1e-8), 0.0), [-3.0 * side, 4.0]) == pytest.approx(5.0)


def test_the_tolerance_is_what_slopes_can_tell() -> None:
    """1e-3 where they are exact; of differences 50 Hz times the step over the least sigma; of
    areas and stiffnesses 1e-4 of their weighted size."""
    modal = [Target(AXIAL, 40.0), Target(TORSIONAL, 40.0, sigma_Hz=0.5)]
    pressed = [SimpleNamespace(scale=100.0, value=v) for v in (3.0, 4.0)]
    of = lambda step, targets, road=(): _tolerance(
        SimpleNamespace(difference_step=step, targets=targets, road=road)  # type: ignore[arg-type]
    )
    assert of(None, modal) == of(1e-6, modal) == 1e-3
    assert of(1e-3, modal) == pytest.approx(0.1) and of(1e-3, modal[:1]) == pytest.approx(0.05)
    assert of(1e-3, []) == pytest.approx(0.05)
    assert of(None, [], pressed) == pytest.approx(0.05)
    assert of(1e-3, modal, pressed) == pytest.approx(0.15)
