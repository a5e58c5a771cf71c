"""Sequential least-squares quadratic programming on the design variables.

Each step minimises a model of second order of the residuals, with the curvature that the designs
seen so far tell (`curvature`), within the bounds, damped as Levenberg and Marquardt's are, by how
much of the promised decrease comes true (Nocedal and Wright, Numerical Optimization, ch. 10 and
18). Its first Hessian is Gauss and Newton's: raw variables of sizes 1e-7 and 1e6 would stop a
quasi-Newton method at its start, and an identity would send it to the bounds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...simulate.evaluate.failure import EvaluationFailed
from .crossing import MIXED, TELLING, Crossing, crossing, gap, order, pair_clarity
from .curvature import curved_step, foreseen, with_secant
from .problem import Point, Problem

Array = np.ndarray
MOST_DESIGNS = 100
EXACT = 1e-3  # Hz, an objective below every measurement's resolution
LEAST_GAIN = 1e-9  # of the squared objective, promised by a step: below, none is lower
DAMPING, LEAST_DAMPING = 0.01, 1e-6  # mu over the mean diagonal of J^T J, at first and at last
KEPT_WELL, KEPT_BADLY = 0.7, 0.25  # shares of a promised decrease: above mu falls, below it rises
HALVINGS = 5  # of a step towards a design without a solution
ROOM = 0.1  # of the gap of the [0, 0] modes, between a bounded step and where labels change places
CREEPING = 3e-4  # of the objective, less than ROOM costs: a gain that is not worth another step
ALONG = 0.1  # of the gradient: as much along the crossing counts as none
AT_CROSSING = "the two [0,0] modes meet: beyond, labels change places and the objective is higher"
CAME_BACK = "came back over the crossing of the two [0,0] modes"


@dataclass(frozen=True)
class Descent:
    """Where an optimiser stopped, in its own words why, and the crossing that bounds it."""

    point: Point
    message: str
    edge: Crossing | None = None


def minimise(problem: Problem, start: Array, tolerance: float) -> Descent:
    """Minimise the objective from ``start`` until the projected gradient is below ``tolerance``.

    Where the search ends with the two [0, 0] modes mixed, it is held by their crossing, at which
    the labels change places and the objective jumps; then the other side is searched too. Where
    that is higher, the design is a minimum: the jump bounds it.

    Raises EvaluationFailed when the start itself cannot be evaluated.
    """
    best = _descend(problem, problem.evaluate(start), tolerance)
    if pair_clarity(best.point) < MIXED:
        for across in _beyond_crossing(problem, best.point, best.edge):
            try:
                there = problem.evaluate(across)
            except EvaluationFailed:
                continue
            other = _descend(problem, there, tolerance, best.point)
            if other.message != CAME_BACK and other.point.objective < best.point.objective:
                best = other
                break
    return best


def projected_gradient(problem: Problem, point: Point) -> float:
    """Norm of dF/dx without what pushes against a bound, Hz per unit of x."""
    g = point.gradient.copy()
    g[(point.x <= problem.lower + 1e-9) & (g > 0)] = 0.0
    g[(point.x >= problem.upper - 1e-9) & (g < 0)] = 0.0
    return float(np.linalg.norm(g))


def is_converged(problem: Problem, point: Point, tolerance: float) -> bool:
    """Whether no admissible change lowers the objective, or the fit is exact for all purposes."""
    return point.objective <= EXACT or projected_gradient(problem, point) <= tolerance


def _descend(
    problem: Problem, point: Point, tolerance: float, known: Point | None = None
) -> Descent:
    """SLSQP from ``point`` to its end, or back on the side of ``known``, no lower."""
    damping, message = DAMPING, "designs used up"
    curvature = np.zeros((*point.jacobian.shape, len(point.x)))
    edge: Crossing | None = None
    for _ in range(MOST_DESIGNS):
        if is_converged(problem, point, tolerance):
            return Descent(point, "converged")
        step = _step(problem, point, curvature, damping, edge)
        if promised(point, curvature, step) <= LEAST_GAIN * max(point.objective, EXACT) ** 2:
            return Descent(point, "no lower objective along the search direction", edge)
        there = first_solvable(problem, point, step)
        if there is None:
            damping *= 4
            continue
        seen = [point, there]
        reached = min(seen, key=lambda p: p.objective)
        side = order(problem, reached)
        back = known is not None and side == order(problem, known)
        if known and back and reached.objective >= (1 - CREEPING) * known.objective:
            return Descent(reached, CAME_BACK)
        if side != order(problem, point):
            edge = None
        elif edge or (
            any(order(problem, p) != side for p in seen) and min(map(pair_clarity, seen)) < MIXED
        ):
            edge = crossing(problem, seen, reached) or edge
        creeping = point.objective - reached.objective <= CREEPING * point.objective
        if edge and creeping and _is_bounded(reached, edge):
            return Descent(reached, AT_CROSSING, edge)
        change, gain = there.x - point.x, point.objective**2 - there.objective**2
        wanted = promised(point, curvature, change)
        if not gain >= KEPT_BADLY * wanted:
            damping *= 4
        elif gain > KEPT_WELL * wanted:
            damping = max(0.1 * damping, LEAST_DAMPING)
        curvature = with_secant(curvature, change, there.jacobian - point.jacobian)
        point = reached
    return Descent(point, message, edge)


def _is_bounded(point: Point, edge: Crossing) -> bool:
    """Whether the labels are about to change places and the gradient is normal to where they do,
    as it is at any bound that holds."""
    normal = edge.slopes / max(float(np.linalg.norm(edge.slopes)), 1e-300)
    along = np.linalg.norm(point.gradient - (point.gradient @ normal) * normal)
    near = pair_clarity(point, edge.state) < TELLING
    return near and bool(along <= ALONG * np.linalg.norm(point.gradient))


def promised(point: Point, curvature: Array, change: Array) -> float:
    """By how much F^2 falls by the model."""
    r = foreseen(point.jacobian, point.residuals, curvature, change)
    return float(point.objective**2 - r @ r)


def first_solvable(problem: Problem, point: Point, step: Array) -> Point | None:
    """The first design with a solution on the way back along ``step``, halved each time."""
    for halvings in range(HALVINGS):
        x = point.x + step / 2**halvings
        try:
            return problem.evaluate(np.clip(x, problem.lower, problem.upper))
        except EvaluationFailed:
            continue
    return None


def _step(
    problem: Problem, point: Point, curvature: Array, damping: float, edge: Crossing | None
) -> Array:
    """The step on this side of ``edge``."""
    n = len(point.x)
    G, h = np.vstack([np.eye(n), -np.eye(n)]), [problem.lower - point.x, point.x - problem.upper]
    if edge:
        apart = gap(point, edge.state)
        side = np.sign(apart)
        G = np.vstack([G, side * edge.slopes])
        h.append(np.array([ROOM * abs(apart) - side * edge.at(point.x)]))
    J, r = point.jacobian, point.residuals
    return curved_step(J, r, curvature, damping, G, np.concatenate(h))


def _beyond_crossing(
    problem: Problem, point: Point, edge: Crossing | None = None
) -> Iterator[Array]:
    """Designs on the other side of the [0, 0] modes' crossing, the nearest in the metric first.

    d of the crossing, see there, is carried to the other side of 0 with the least change of the
    residuals: dx = -(d +- wanted) H^-1 grad d / (grad d . H^-1 grad d).
    """
    edge = edge or crossing(problem, [point], point)
    if edge is None:
        return
    side = np.sign(gap(point, edge.state))
    H = point.jacobian.T @ point.jacobian
    H[np.diag_indices(len(H))] += 1e-3 * np.trace(H) / len(H)
    direction = np.linalg.solve(H, edge.slopes)
    rise = float(edge.slopes @ direction)
    if rise < 1e-12 * (edge.slopes @ edge.slopes + 1e-300):
        return
    for wanted in (1.0, 2.0, 4.0):  # Hz beyond
        change = -(edge.at(point.x) + side * wanted) * direction / rise
        yield np.clip(point.x + change, problem.lower, problem.upper)
