"""The search where the two [0, 0] modes cross: slopes, what bounds a step, designs beyond."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.studies.fit import gauss_newton, search, slsqp
from tyrecal.studies.fit.crossing import AXIAL, TORSIONAL, Crossing, crossing, gap
from tyrecal.studies.fit.problem import Point, Problem
from tyrecal.studies.fit.search import CrossingWatch, _designs_beyond
from tyrecal.studies.fit.targets import Target
from tyrecal.tyre.state import AS_THE_CASE

from .fake import START_X, evaluator, with_targets
from .linear import Linear, linear, point

Array = np.ndarray


def pair(difference: float, clarity: float) -> dict:
    """The two [0, 0] modes, the axial one ``difference`` Hz above."""
    hertz = {AXIAL: 40.0 + difference, TORSIONAL: 40.0}
    modes = {k: SimpleNamespace(frequency_Hz=f, clarity=clarity) for k, f in hertz.items()}
    return {AS_THE_CASE: modes}


def test_a_crossing_bounds_where_the_gradient_is_normal_to_it() -> None:
    """The gradient is normal to a tenth, and labels are mixed."""
    edge = Crossing(np.zeros(2), 0.0, np.array([3.0, 4.0]))
    watch = CrossingWatch(Paired(np.eye(2), np.zeros(2)), None, edge)  # type: ignore[arg-type]
    normal, along = np.array([0.6, 0.8]), np.array([-0.8, 0.6])

    def bounded(share: float, clarity: float) -> bool:
        g = np.sqrt(1 - share**2) * normal + share * along
        return watch.bounds(point([0, 0], [7.0], [7.0 * g], pair(0.1, clarity)))

    assert bounded(0.09, 0.29) and bounded(-0.09, 0.0)
    assert not bounded(0.11, 0.29) and not bounded(-0.11, 0.29) and not bounded(0.09, 0.31)


class Paired(Linear):
    """Problem with both [0, 0] modes among its targets."""

    targets = (Target(AXIAL, 40.0), Target(TORSIONAL, 40.0))


@pytest.mark.parametrize("method", [slsqp, gauss_newton])
def test_no_crossing_is_looked_for_where_no_design_lies_beyond(
    method: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However mixed the labels are."""

    class OneSided(Paired):
        def evaluate(self, x: Array) -> Point:
            return replace(super().evaluate(x), states=pair(3.0, 0.1))

    for module in (search, gauss_newton):
        monkeypatch.setattr(module, "crossing", lambda *given: pytest.fail("looked for one"))
    plain = linear()
    problem: Any = OneSided(plain.J, plain.J @ [1.0, 2.0, 3.0] - 0.3)
    assert method.descend(problem, problem.evaluate(np.zeros(3)), 1e-3).message == "converged"


def test_a_step_that_meets_the_crossing_leaves_it_some_room() -> None:
    """A tenth of the gap of the point that it starts from, on whichever side that is."""
    for side in (1.0, -1.0):
        problem: Any = Paired(np.eye(2), np.array([-4.0 * side, 1.0]))
        at = point([side, 0.0], problem.J @ [side, 0.0] - problem.y, problem.J, pair(2 * side, 0.1))
        edge = Crossing(at.x, 2 * side, np.array([2.0, 0.0]))
        step = gauss_newton._step(problem, at, np.zeros((2, 2, 2)), 1e-6, edge)
        assert side * edge.at(at.x + step) == pytest.approx(0.1 * 2, abs=1e-6)
        free = gauss_newton._step(problem, at, np.zeros((2, 2, 2)), 1e-6, None)
        assert side * (at.x + free)[0] == pytest.approx(-4, rel=1e-3)


def test_designs_beyond_a_crossing_are_reached_by_the_least_change_of_the_residuals() -> None:
    """d = -1, -2 and -4 Hz; the change is J^T J's steepest along d: (J^T J) dx is parallel to its
    slopes."""
    for side in (1.0, -1.0):
        problem: Any = Paired(linear().J, np.zeros(7))
        at = point([0.1, 0.2, 0.3], np.ones(7), problem.J, pair(3 * side, 0.1))
        edge = Crossing(np.zeros(3), 2.5 * side, np.array([1.0, -2.0, 3.0]))
        designs = list(_designs_beyond(problem, at, edge))
        assert [side * edge.at(x) for x in designs] == pytest.approx([-1.0, -2.0, -4.0])
        for x in designs:
            push = problem.J.T @ problem.J @ (x - at.x)
            cosine = push @ edge.slopes / np.linalg.norm(push) / np.linalg.norm(edge.slopes)
            assert abs(cosine) > 1 - 1e-4
        problem.upper = problem.lower + 10.3
        assert all((x <= problem.upper).all() for x in _designs_beyond(problem, at, edge))
    nowhere = Crossing(np.zeros(3), 2.5, np.zeros(3))
    assert list(_designs_beyond(problem, at, nowhere)) == []


def test_slopes_are_taken_from_where_labels_are_clear() -> None:
    """Clarity from 0.3 on suffices: the nearest such point is taken, or none."""
    problem: Any = Paired(np.eye(2), np.zeros(2))
    problem.scale = np.ones(2)
    near, far, farther = (
        point([x, 0.0], [0.0, 0.0], [[x, 1.0], [0.0, 2.0]], pair(1.0, clarity))
        for x, clarity in ((0.1, 0.29), (0.5, 0.31), (-0.7, 0.9))
    )
    assert crossing(problem, [near], near) is None
    edge = crossing(problem, [farther, near, far], near)
    assert edge and edge.x is far.x and edge.value == pytest.approx(0.31)
    assert edge.slopes == pytest.approx(np.array([0.5, -1.0]) / 0.31)


def test_no_crossing_is_looked_for_where_the_pair_has_no_weight() -> None:
    problem = Problem(with_targets(weight=[0.0, 0.0] + [1.0] * 7), evaluator())  # type: ignore[arg-type]
    assert list(_designs_beyond(problem, problem.evaluate(problem.start()))) == []


@pytest.mark.parametrize("weights", [[1.0] * 9, [4.0, 0.25, *[1.0] * 7]])
def test_slopes_at_a_crossing_are_those_of_the_difference(weights: list[float]) -> None:
    """The difference is axial less torsional frequency in Hz, whatever the targets weigh, on
    distinct modes."""
    problem = Problem(with_targets(weight=weights), evaluator())  # type: ignore[arg-type]
    far, point = problem.evaluate(START_X + 0.2), problem.evaluate(START_X)
    edge = crossing(problem, [far, point], point)
    assert edge is not None and edge.x is point.x
    assert edge.value == pytest.approx(gap(point, AS_THE_CASE), rel=1e-6)
    h = 1e-4
    for k, e in enumerate(h * np.eye(len(START_X))):
        wanted = gap(problem.evaluate(START_X + e), AS_THE_CASE) - gap(
            problem.evaluate(START_X - e), AS_THE_CASE
        )
        assert edge.slopes[k] == pytest.approx(wanted / (2 * h), rel=1e-5)
    assert edge.at(point.x + e) == pytest.approx(
        gap(problem.evaluate(point.x + e), AS_THE_CASE), abs=1e-6
    )
