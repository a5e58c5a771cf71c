"""The steps of both methods, where residuals are linear and every answer is known by hand."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from tyrecal.simulate.deck.tyre_design import NEAR_ZERO
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.fit import least_squares, slsqp
from tyrecal.studies.fit.calibrate import _tolerance
from tyrecal.studies.fit.crossing import AXIAL, TORSIONAL, Crossing, crossing
from tyrecal.studies.fit.differences import differences
from tyrecal.studies.fit.problem import Point
from tyrecal.studies.fit.targets import Target
from tyrecal.studies.fit.uncertainty import uncertainty
from tyrecal.studies.fit.variable import DesignVariable, read_variable
from tyrecal.tyre.case.schema import Variable
from tyrecal.tyre.state import AS_THE_CASE

from ..chance import generator

Array = np.ndarray
MINIMISE = {"slsqp": slsqp.minimise, "least-squares": least_squares.minimise}


def pair(difference: float, clarity: float) -> dict:
    """The two [0, 0] modes, the axial one ``difference`` Hz above."""
    hertz = {AXIAL: 40.0 + difference, TORSIONAL: 40.0}
    modes = {k: SimpleNamespace(frequency_Hz=f, clarity=clarity) for k, f in hertz.items()}
    return {AS_THE_CASE: modes}


def point(x: Any, r: Any, J: Any, modes: dict | None = None) -> Point:
    x, r, J = (np.array(each, float) for each in (x, r, J))
    return Point({}, x, r, J, modes or {}, 1.0, 1.0, np.empty(0))


class Linear:
    """Residuals J x - y within a box; ``wall``: x that have no solution."""

    targets: tuple[Target, ...] = ()

    def __init__(self, J: Array, y: Array, box: float = 10.0):
        self.J, self.y = J, y
        self.asked: list[Array] = []
        self.lower, self.upper = np.full(J.shape[1], -box), np.full(J.shape[1], box)
        self.wall = lambda x: False
        self.added = lambda x: 0.0  # to the residuals, and to no slope

    def evaluate(self, x: Array) -> Point:
        self.asked.append(x)
        assert (x >= self.lower).all() and (x <= self.upper).all()
        if self.wall(x):
            raise EvaluationFailed("no_equilibrium", "beyond the wall")
        return point(x, self.J @ x - self.y + self.added(x), self.J)


def linear(key: object = 0, box: float = 10.0, rows: int = 7, columns: int = 3) -> Any:
    random = generator("linear", key)
    J = random.normal(size=(rows, columns))
    return Linear(J, J @ random.normal(size=columns) + 0.3 * random.normal(size=rows), box)


@pytest.mark.parametrize("method", MINIMISE)
@pytest.mark.parametrize("box", [10.0, 0.3])
def test_a_linear_problem_in_a_box_is_solved_in_a_few_steps(method: str, box: float) -> None:
    """At the least sum of squares in the box, whether its sides hold or not."""
    counts = []
    for key in range(5):
        problem = linear(key, box)
        found = MINIMISE[method](problem, np.zeros(3), 1e-3)
        exact = lsq_linear(problem.J, problem.y, (problem.lower, problem.upper), method="bvls").x
        assert found.message == "converged"
        assert found.point.x == pytest.approx(exact, abs=2e-3)
        lowest = np.linalg.norm(problem.J @ exact - problem.y)
        assert found.point.objective == pytest.approx(lowest, abs=1e-6)
        assert slsqp.projected_gradient(problem, found.point) <= 1e-3
        counts.append(len(problem.asked))
    assert max(counts) <= 15, counts


@pytest.mark.parametrize("method", MINIMISE)
def test_an_exact_fit_is_enough(method: str) -> None:
    """An objective of 1e-3 Hz is below every resolution: no step is taken from there."""
    for size, steps in ((0.99e-3, False), (1.01e-3, True)):
        problem: Any = Linear(np.eye(3), np.array([size, 0, 0]))
        MINIMISE[method](problem, np.zeros(3), 1e-12)
        assert (len(problem.asked) > 1) == steps


@pytest.mark.parametrize("method", MINIMISE)
def test_where_nothing_is_lower_the_search_ends_and_says_so(method: str) -> None:
    """Slopes that promise what no step holds: it stops before its steps are used up, where it
    began."""
    problem = linear()
    problem.added = lambda x: 1e3 * bool(x.any())
    found = MINIMISE[method](problem, np.zeros(3), 1e-6)
    assert "no lower objective along" in found.message
    assert not found.point.x.any()
    assert min(np.linalg.norm(x) for x in problem.asked if x.any()) < 1e-3  # however short


@pytest.mark.parametrize("method", MINIMISE)
def test_what_is_as_high_as_before_is_not_lower(method: str) -> None:
    """Residuals that stay what they are, to the last bit, whatever their slopes promise."""
    problem = linear()
    answer = problem.evaluate
    problem.evaluate = lambda x: replace(answer(x), residuals=-problem.y)
    found = MINIMISE[method](problem, np.zeros(3), 1e-6)
    assert "no lower objective along" in found.message and not found.point.x.any()


@pytest.mark.parametrize("method", MINIMISE)
def test_a_step_beyond_what_has_a_solution_is_taken_back(method: str) -> None:
    """To its sixteenth at least: the wall stands at a tenth of the way."""
    problem: Any = Linear(np.eye(3), np.array([0.8, 0.4, 0.2]))
    problem.wall = lambda x: x[0] > 0.08
    found = MINIMISE[method](problem, np.zeros(3), 1e-6)
    assert 0 < found.point.x[0] <= 0.08
    assert found.point.objective < np.linalg.norm(problem.y) - 0.04


def test_a_damped_step_is_that_of_its_equations() -> None:
    """min |r + J d|^2 + mu |d|^2 tr(J^T J) / v, in the box: where a side holds, the slope pushes
    against it, and vanishes along all others."""
    mu = 0.7
    for key in range(3):
        problem = linear(key)
        x = generator("damped", key).uniform(-0.1, 0.1, 3)
        at, weight = problem.evaluate(x), mu * np.sum(problem.J**2) / 3
        free = np.linalg.solve(
            problem.J.T @ problem.J + weight * np.eye(3), -problem.J.T @ at.residuals
        )
        assert least_squares._step(problem, at, mu) == pytest.approx(free, rel=1e-6)
        problem.lower, problem.upper = x - 0.5 * abs(free).max(), x + 0.5 * abs(free).max()
        d = least_squares._step(problem, at, mu)
        slope = problem.J.T @ (at.residuals + problem.J @ d) + weight * d
        low, high = x + d <= problem.lower + 1e-9, x + d >= problem.upper - 1e-9
        assert (low | high).any()
        assert abs(slope[~low & ~high]).max(initial=0) < 1e-6
        assert (slope[low] > 0).all() and (slope[high] < 0).all()


def test_damping_falls_with_success_so_that_steps_become_whole() -> None:
    """Each leaves a smaller share of what is left than the one before: 11, 5, 1.3 and 0.3 %."""
    J = np.vstack([np.diag([1.0, 2.0, 3.0]), np.ones(3)])
    problem: Any = Linear(J, np.array([1.0, -1.0, 2.0, 0.5]))
    least_squares.minimise(problem, np.full(3, 9.0), 1e-3)
    exact = np.linalg.lstsq(problem.J, problem.y, rcond=None)[0]
    off = [np.linalg.norm(x - exact) for x in problem.asked]
    left = [b / a for a, b in pairwise(off)]
    assert len(left) >= 4 and all(b < 0.5 * a for a, b in pairwise(left))


def test_the_first_step_is_gauss_and_newtons_damped() -> None:
    problem = linear()
    at, none = problem.evaluate(np.zeros(3)), np.zeros((7, 3, 3))
    for damping in (0.1, 3.0):
        step = slsqp._step(problem, at, none, damping, None)
        H = problem.J.T @ problem.J
        H += damping * np.trace(H) / 3 * np.eye(3)
        assert step == pytest.approx(np.linalg.solve(H, problem.J.T @ problem.y), abs=1e-6)
        gain = at.objective**2 - problem.evaluate(step).objective ** 2
        assert slsqp.promised(at, none, step) == pytest.approx(gain)


def test_a_step_that_promised_too_much_is_taken_shorter() -> None:
    """Were it taken whole, it would be far worse than a part of it."""
    problem: Any = Linear(np.eye(1), np.array([1.0]))
    problem.added = lambda x: 20 * x * abs(x)
    found = slsqp.minimise(problem, np.zeros(1), 1e-3)
    assert 0 < found.point.x[0] < 0.3 and found.point.objective < 1


def test_steps_learn_the_curvature() -> None:
    """Residuals J x + x . H x / 2 - y that do not vanish at the optimum, where Gauss
    and Newton converge linearly: with the curvature learnt it takes far fewer designs."""

    class Curved(Linear):
        def evaluate(self, x: Array) -> Point:
            self.asked.append(x)
            return point(x, self.J @ x + H @ x @ x / 2 - self.y, self.J + H @ x)

    asked: dict[str, list[int]] = {method: [] for method in MINIMISE}
    for key in range(5):
        random = generator("curved", key)
        H = random.normal(size=(7, 3, 3))
        H = 0.2 * (H + H.swapaxes(1, 2))
        J, y = random.normal(size=(7, 3)), 2 * random.normal(size=7)
        ends = []
        for method, minimise in MINIMISE.items():
            problem: Any = Curved(J, y)
            found = minimise(problem, np.zeros(3), 1e-6)
            ends.append(found.point.objective)
            asked[method].append(len(problem.asked))
        assert ends[0] == pytest.approx(ends[1], rel=1e-9)
    assert sum(asked["slsqp"]) < 0.7 * sum(asked["least-squares"]), asked


def test_what_pushes_against_a_bound_does_not_count() -> None:
    """At a bound, to 1e-9 of a coordinate, the gradient counts where it leads inside alone."""
    problem: Any = SimpleNamespace(lower=np.full(2, -1.0), upper=np.full(2, 1.0))
    norm = lambda x, g: slsqp.projected_gradient(problem, point(x, [1.0], [g]))
    assert norm([0.0, 0.0], [3.0, 4.0]) == pytest.approx(5.0)
    for side in (-1.0, 1.0):
        held = side * (1 - 0.9e-9), 0.0
        assert norm(held, [-3.0 * side, 4.0]) == pytest.approx(4.0)  # lower only outside
        assert norm(held, [3.0 * side, 4.0]) == pytest.approx(5.0)
        assert norm((side * (1 - 1.1e-8), 0.0), [-3.0 * side, 4.0]) == pytest.approx(5.0)


def test_a_crossing_bounds_where_the_gradient_is_normal_to_it() -> None:
    """To a tenth, and where the labels are mixed."""
    edge = Crossing(np.zeros(2), 0.0, np.array([3.0, 4.0]))
    normal, along = np.array([0.6, 0.8]), np.array([-0.8, 0.6])

    def bounded(share: float, clarity: float) -> bool:
        g = np.sqrt(1 - share**2) * normal + share * along
        return slsqp._is_bounded(point([0, 0], [7.0], [7.0 * g], pair(0.1, clarity)), edge)

    assert bounded(0.09, 0.29) and bounded(-0.09, 0.0)
    assert not bounded(0.11, 0.29) and not bounded(-0.11, 0.29) and not bounded(0.09, 0.31)


class Paired(Linear):
    """With both [0, 0] modes among the targets."""

    targets = (Target(AXIAL, 40.0), Target(TORSIONAL, 40.0))


def test_no_crossing_is_looked_for_where_no_design_lies_beyond(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """However mixed the labels are."""

    class OneSided(Paired):
        def evaluate(self, x: Array) -> Point:
            return replace(super().evaluate(x), states=pair(3.0, 0.1))

    monkeypatch.setattr(slsqp, "crossing", lambda *asked: pytest.fail("looked for one"))
    plain = linear()
    problem: Any = OneSided(plain.J, plain.J @ [1.0, 2.0, 3.0] - 0.3)
    assert slsqp._descend(problem, problem.evaluate(np.zeros(3)), 1e-3).message == "converged"


def test_a_step_that_meets_the_crossing_leaves_it_some_room() -> None:
    """A tenth of the gap of the point that it starts from, on whichever side that is."""
    for side in (1.0, -1.0):
        problem: Any = Paired(np.eye(2), np.array([-4.0 * side, 1.0]))
        at = point([side, 0.0], problem.J @ [side, 0.0] - problem.y, problem.J, pair(2 * side, 0.1))
        edge = Crossing(at.x, 2 * side, np.array([2.0, 0.0]))
        step = slsqp._step(problem, at, np.zeros((2, 2, 2)), 1e-6, edge)
        assert side * edge.at(at.x + step) == pytest.approx(0.1 * 2, abs=1e-6)
        free = slsqp._step(problem, at, np.zeros((2, 2, 2)), 1e-6, None)
        assert side * (at.x + free)[0] == pytest.approx(-4, rel=1e-3)


def test_designs_beyond_a_crossing_are_reached_by_the_least_change_of_the_residuals() -> None:
    """d = -1, -2 and -4 Hz; the change is J^T J's steepest along d: (J^T J) dx is parallel to its
    slopes."""
    for side in (1.0, -1.0):
        problem: Any = Paired(linear().J, np.zeros(7))
        at = point([0.1, 0.2, 0.3], np.ones(7), problem.J, pair(3 * side, 0.1))
        edge = Crossing(np.zeros(3), 2.5 * side, np.array([1.0, -2.0, 3.0]))
        found = list(slsqp._beyond_crossing(problem, at, edge))
        assert [side * edge.at(x) for x in found] == pytest.approx([-1.0, -2.0, -4.0])
        for x in found:
            push = problem.J.T @ problem.J @ (x - at.x)
            cosine = push @ edge.slopes / np.linalg.norm(push) / np.linalg.norm(edge.slopes)
            assert abs(cosine) > 1 - 1e-4
        problem.upper = problem.lower + 10.3
        assert all((x <= problem.upper).all() for x in slsqp._beyond_crossing(problem, at, edge))
    nowhere = Crossing(np.zeros(3), 2.5, np.zeros(3))
    assert list(slsqp._beyond_crossing(problem, at, nowhere)) == []


def test_slopes_are_taken_from_where_labels_are_clear() -> None:
    """From 0.3 on: the nearest such point, or none."""
    problem: Any = Paired(np.eye(2), np.zeros(2))
    problem.scale = np.ones(2)
    near, far, farther = (
        point([x, 0.0], [0.0, 0.0], [[x, 1.0], [0.0, 2.0]], pair(1.0, clarity))
        for x, clarity in ((0.1, 0.29), (0.5, 0.31), (-0.7, 0.9))
    )
    assert crossing(problem, [near], near) is None
    found = crossing(problem, [farther, near, far], near)
    assert found and found.x is far.x and found.value == pytest.approx(0.31)
    assert found.slopes == pytest.approx(np.array([0.5, -1.0]) / 0.31)


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


def test_a_variable_stays_next_to_0_where_it_moves_effects_alone() -> None:
    """Most effects leave the deck at 0, and have no slope there; other numbers have one."""

    def made(sets: list[str], lower: float, upper: float, start: float = 0.0) -> DesignVariable:
        told = Variable(sets=sets, lower=lower, upper=upper, start=start, scale="linear")
        return read_variable("x", told)

    both, other = ["effects.a", "effects.b"], ["effects.a", "pressure_kPa"]
    near = made(both, 0.0, 2.0)
    assert near.lower == near.start == 2 * NEAR_ZERO > 0 and near.upper == 2.0
    near = made(both, -3.0, 0.0)
    assert near.upper == near.start == -3 * NEAR_ZERO and near.lower == -3.0
    far = made(both, -3.0, 2.0, 0.5)
    assert (far.lower, far.start, far.upper) == (-3.0, 0.5, 2.0)
    for sets in (other, other[::-1], other[1:]):
        assert made(sets, 0.0, 2.0).lower == made(sets, 0.0, 2.0).start == 0.0


def test_uncertainty_by_its_formula() -> None:
    """B diag(sigma^2) B^T with B = (J^T J)^-1 J^T W^(1/2), unequal weights and sigmas; the noise is
    the root mean square of the frequencies' sigmas."""
    random = generator("uncertainty")
    slopes, scale = random.normal(size=(5, 2)), np.array([1.0, 4.0, 0.5, 0.0, 2.0])
    sigmas = np.array([0.1, 0.4, 0.2, 0.3])
    targets = [SimpleNamespace(sigma_Hz=s) for s in sigmas]
    variables = [DesignVariable("a", 3.0, 1.0, 9.0), DesignVariable("b", 0.0, -1.0, 3.0, log=False)]
    problem: Any = SimpleNamespace(
        scale=scale, targets=targets, variables=variables, others=[SimpleNamespace(sigma=0.05)]
    )
    J, y = scale[:, None] * slopes, random.normal(size=5)
    at = Point({"a": 3.0, "b": 0.5}, np.zeros(2), scale * y, J, {}, 1.0, 1.0, np.empty(0))
    found = uncertainty(problem, at)
    B = np.linalg.inv(J.T @ J) @ J.T * scale
    covariance = (B * np.append(sigmas, 0.05) ** 2) @ B.T
    spread = np.sqrt(np.diag(covariance))
    assert found.standard_errors == pytest.approx(spread * [3.0, 4.0])
    assert found.correlations == pytest.approx(covariance / np.outer(spread, spread))
    assert found.singular_values == pytest.approx(np.linalg.svd(J, compute_uv=False))
    assert found.noise_Hz == pytest.approx(np.sqrt(np.mean(sigmas[:3] ** 2)))


def test_noise_is_what_is_left_over_the_freedom_that_is_left() -> None:
    """Of four frequencies without sigma and two variables: two degrees; a fifth, known one takes
    its leverage. Weights are none of the noise."""
    random = generator("noise")
    J, y = random.normal(size=(5, 2)), random.normal(size=5)
    scale = np.array([1.0, 4.0, 0.5, 2.0, 3.0])
    J = scale[:, None] * J
    variables = [DesignVariable("a", 3.0, 1.0, 9.0), DesignVariable("b", 3.0, 1.0, 9.0)]
    point_of = lambda n: Point(
        {"a": 3.0, "b": 3.0}, np.zeros(2), (scale * y)[:n], J[:n], {}, 1.0, 1.0, np.empty(0)
    )
    none = [SimpleNamespace(sigma_Hz=None)] * 4
    told: dict[str, Any] = {"variables": variables, "others": []}
    problem: Any = SimpleNamespace(scale=scale[:4], targets=none, **told)
    found = uncertainty(problem, point_of(4))
    assert found.noise_Hz == pytest.approx(np.linalg.norm(y[:4]) / np.sqrt(2))
    known = [*none, SimpleNamespace(sigma_Hz=0.3)]
    problem = SimpleNamespace(scale=scale, targets=known, **told)
    leverage = J[4] @ np.linalg.inv(J.T @ J) @ J[4]
    noise = np.linalg.norm(y[:4]) / np.sqrt(4 - (2 - leverage))
    sigma = np.sqrt((4 * noise**2 + 0.3**2) / 5)
    assert uncertainty(problem, point_of(5)).noise_Hz == pytest.approx(sigma)


@pytest.mark.parametrize("log", [True, False])
def test_a_variables_coordinate_and_back(log: bool) -> None:
    """A logarithm, or the share of the way between the bounds; values stay within them, and the
    start is met to the last bit."""
    v = DesignVariable("x", 0.7, 0.3, 2.3, log)
    for value in (0.3, 0.5, 0.7, 1.9, 2.3):
        x = v.scaled(value)
        assert x == pytest.approx(np.log(value) if log else (value - 0.3) / 2.0)
        assert v.value(x) == pytest.approx(value, rel=1e-14)
        rise = (v.value(x + 1e-6) - v.value(x - 1e-6)) / 2e-6
        if 0.3 < value < 2.3:
            assert v.slope(value) == pytest.approx(rise, rel=1e-6)
    assert v.value(v.scaled(0.7)) == 0.7
    assert v.value(v.scaled(2.3) + 1) == 2.3 and v.value(v.scaled(0.3) - 1) == 0.3


def test_how_well_a_start_is_known() -> None:
    """As stated, else by 0.5 of a logarithm; never worse than uniformly within the bounds, as of a
    linear variable that says nothing."""
    spread = lambda log, lower, upper, percent=None: (
        DesignVariable("x", 2.0, lower, upper, log, percent).spread
    )
    assert spread(True, 0.2, 20.0) == 0.5
    assert spread(True, 0.2, 20.0, 20.0) == pytest.approx(np.log(1.2))
    assert spread(True, 0.2, 20.0, 900.0) == pytest.approx(np.log(100) / 12**0.5)
    assert spread(True, 1.9, 2.1) == pytest.approx(np.log(2.1 / 1.9) / 12**0.5)
    assert spread(False, 1.0, 5.0) == pytest.approx(1 / 12**0.5)
    assert spread(False, 1.0, 5.0, 10.0) == pytest.approx(0.2 / 4)
    assert (
        read_variable("x", Variable(sets=["a"], start=2, lower=1, upper=5, percent=7)).percent == 7
    )


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
    """Without either neighbour there is no slope, and without a licence no question."""

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
