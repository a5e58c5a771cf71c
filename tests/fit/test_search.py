"""Steps of both methods by hand, the crossing of [0, 0], the nearest point of a polyhedron."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear, minimize

from tyrecal.studies.fit import gauss_newton, search, slsqp
from tyrecal.studies.fit.calibrate import METHODS, _tolerance
from tyrecal.studies.fit.crossing import AXIAL, TORSIONAL, Crossing, crossing, gap
from tyrecal.studies.fit.gauss_newton import (
    curved_step,
    foreseen,
    nearest,
    quadratic_step,
    with_secant,
)
from tyrecal.studies.fit.problem import Point, Problem
from tyrecal.studies.fit.search import CrossingWatch, _designs_beyond
from tyrecal.studies.fit.targets import Target
from tyrecal.tyre.state import AS_THE_CASE

from ..chance import generator
from .fake import START_X, Linear, evaluator, linear, point, with_targets

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
@pytest.mark.parametrize("added", [1e3, -0.001])
def test_a_step_that_gains_little_ends_a_search_with_nothing_left_to_tell(
    method: str, added: float
) -> None:
    """0.04 standard deviations are no reason to go on, 0.06 are, and 0.04 Hz."""
    for size, in_sigmas, ends in ((0.04, True, True), (0.06, True, False), (0.04, False, False)):
        problem: Any = Linear(np.zeros((1, 3)), np.array([-size]))
        problem.J[0, 0], problem.in_sigmas = 1.0, in_sigmas
        problem.added = lambda x: added * bool(x.any()) - x[0]
        end = minimise(method, problem, np.zeros(3), 1e-6)
        assert not ends or end.message == "converged"
        assert (len({x.tobytes() for x in problem.asked}) == 2) == ends


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


@pytest.mark.parametrize("method", METHODS)
def test_a_curved_valley_is_followed_in_few_designs(method: str) -> None:
    """Rosenbrock's. SLSQP by its own Hessian alone takes 25 designs."""
    problem: Any = Linear(np.eye(2), np.zeros(2), 3.0)
    evaluated = set()

    def evaluate(x: Array) -> Point:
        evaluated.add(tuple(x))
        a, b = x
        return point(x, [10 * (b - a * a), 1 - a], [[-20 * a, 10], [-1, 0]])

    problem.evaluate = evaluate
    end = minimise(method, problem, np.array([0.0, 2.5]), 1e-3)
    assert end.message == "converged" and end.point.x == pytest.approx(1.0, abs=2e-3)
    assert len(evaluated) <= 15


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


def test_the_nearest_point_is_that_of_its_conditions() -> None:
    """y - to = G^T u with u >= 0 that vanish where G y > h: pushed by the sides that hold alone."""
    held = set()
    for key in range(40):
        random = generator("nearest", key)
        G, to = random.normal(size=(7, 3)), 2 * random.normal(size=3)
        h = G @ random.normal(size=3) - random.uniform(0, 1, 7)  # one point at least is inside
        y = nearest(to, G, h)
        slack = G @ y - h
        assert slack.min() > -1e-9
        on = slack < 1e-9
        held.add(int(on.sum()))
        u = np.linalg.lstsq(G[on].T, y - to, rcond=None)[0]
        assert G[on].T @ u == pytest.approx(y - to, abs=1e-9) and (u > -1e-9).all()
    assert {0, 1, 2} <= held


def test_no_step_is_taken_where_no_point_is_inside() -> None:
    """y >= 1 and y <= -1."""
    assert nearest(np.array([3.0]), np.array([[1.0], [-1.0]]), np.ones(2)).tolist() == [0.0]


@pytest.mark.parametrize("key", range(5))
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e6])
def test_a_step_is_the_first_of_slsqp(size: float, key: int) -> None:
    """The step is in the metric of its own matrix, for residuals of any size and bounds on both
    sides."""
    random = generator("first of slsqp", key)
    J, r = random.normal(size=(7, 3)), random.normal(size=7)
    H = J.T @ J + 0.2 * np.trace(J.T @ J) / 3 * np.eye(3)
    G, h = np.vstack([np.eye(3), -np.eye(3)]), -random.uniform(0, 0.5, 6)
    turn = np.linalg.inv(np.linalg.cholesky(H)).T
    value = lambda y: (0.5 * y @ y + (turn.T @ J.T @ r) @ y, y + turn.T @ J.T @ r)
    inside = {"type": "ineq", "fun": lambda y: G @ turn @ y - h, "jac": lambda y: G @ turn}
    first = minimize(
        value,
        np.zeros(3),
        jac=True,
        method="SLSQP",
        constraints=[inside],
        options={"maxiter": 1, "ftol": 1e-15},
    )
    step = quadratic_step(H * size**2, J.T @ r * size**2, size * np.linalg.norm(r), G, h)
    assert step == pytest.approx(turn @ first.x, abs=1e-9)


def drawn(key: int) -> tuple[Array, Array, Array]:
    """Slopes J (6, 3), residuals r and curvatures C (6, 3, 3), symmetric."""
    random = generator("curvature", key)
    C = random.normal(size=(6, 3, 3))
    return random.normal(size=(6, 3)), random.normal(size=6), 0.1 * (C + C.swapaxes(1, 2))


def test_a_secant_holds_and_changes_as_little_as_it_must() -> None:
    """C' s = change and C' = C'^T; C' - C is normal to every symmetric matrix with A s = 0."""
    for key in range(5):
        change, _, C = drawn(key)
        random = generator("secant", key)
        s = random.normal(size=3)
        new = with_secant(C, s, change)
        assert new @ s == pytest.approx(change) and new == pytest.approx(new.swapaxes(1, 2))
        across = random.normal(size=3)
        across -= across @ s / (s @ s) * s
        assert np.einsum("mij,i,j->m", new - C, across, across) == pytest.approx(0, abs=1e-12)


def test_curvatures_of_quadratics_are_found_after_as_many_steps_as_variables() -> None:
    """Conjugate to none, along the axes: each step tells a column for good."""
    _, _, C = drawn(0)
    curvature = np.zeros_like(C)
    for s in np.eye(3):
        curvature = with_secant(curvature, s, C @ s)
    assert curvature == pytest.approx(C)


def test_a_step_without_curvature_is_the_damped_one() -> None:
    for key in range(5):
        J, r, C = drawn(key)
        G, h = np.vstack([np.eye(3), -np.eye(3)]), np.full(6, -0.3)
        d = curved_step(J, r, 0 * C, 0.2, G, h)
        H = J.T @ J + 0.2 * np.sum(J**2) / 3 * np.eye(3)
        damped = quadratic_step(H, J.T @ r, float(np.linalg.norm(r)), G, h)
        assert d == pytest.approx(damped, abs=1e-7)
        assert foreseen(J, r, 0 * C, d) == pytest.approx(r + J @ d)


@pytest.mark.parametrize("bound", [10.0, 0.2])
def test_a_curved_step_is_a_minimum_of_its_model(bound: float) -> None:
    """Inside, the gradient of |r(x + d)|^2 + mu |d|^2 tr(J^T J) / 3 vanishes; where a side holds it
    pushes against it."""
    held = 0
    for key in range(5):
        J, r, C = drawn(key)
        G, h = np.vstack([np.eye(3), -np.eye(3)]), np.full(6, -bound)
        d = curved_step(J, r, C, 0.2, G, h)
        at = foreseen(J, r, C, d)
        assert at == pytest.approx(
            [ri + Ji @ d + d @ Ci @ d / 2 for ri, Ji, Ci in zip(r, J, C, strict=True)]
        )
        g = (J + C @ d).T @ at + 0.2 * np.sum(J**2) / 3 * d
        low, high = d <= -bound + 1e-9, d >= bound - 1e-9
        held += int((low | high).sum())
        assert abs(g[~low & ~high]).max(initial=0) < 1e-4
        assert (g[low] > 0).all() and (g[high] < 0).all()
    assert (held > 0) == (bound < 1)


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
