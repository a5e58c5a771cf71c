"""SLSQP on the design variables, restarted in the Gauss-Newton metric of each point it reaches.

Raw variables of sizes 1e-7 and 1e6 stop SLSQP at its start, and its identity first Hessian sends
it to the bounds. So each restart works in coordinates in which the Hessian of F^2/2 is the identity
but for the residuals' curvature (`damped_step`; Nocedal and Wright, Numerical Optimization, ch. 10
and 18), and is SLSQP's first iteration; bounds become linear constraints.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...simulate.evaluate.failure import EvaluationFailed
from .crossing import MIXED, TELLING, Crossing, crossing, gap, order, pair_clarity
from .damped_step import damped_step
from .problem import Point, Problem

Array = np.ndarray
RESTARTS = 40
EXACT = 1e-3  # Hz, an objective below every measurement's resolution
DAMPING = 0.1  # mu over the mean diagonal of J^T J, at first
MOST_TRIALS = 11  # of a step, each shortened to the vertex of a parabola, as Kraft's search does
SMALLEST_PART = 0.1  # in one shortening
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
    damping, message = DAMPING, "restarts used up"
    edge: Crossing | None = None
    for _ in range(RESTARTS):
        if is_converged(problem, point, tolerance):
            return Descent(point, "converged")
        seen, full_step = _restart(problem, point, damping, edge)
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
        if reached.objective >= point.objective - 1e-9 * max(point.objective, 1e-3):
            if damping > 1e3 * DAMPING:
                return Descent(point, "no lower objective along the search direction", edge)
            damping *= 10
            continue
        damping *= 0.3 if full_step else 2.0
        point = reached
    return Descent(point, message, edge)


def _is_bounded(point: Point, edge: Crossing) -> bool:
    """Whether the labels are about to change places and the gradient is normal to where they do,
    as it is at any bound that holds."""
    normal = edge.slopes / max(float(np.linalg.norm(edge.slopes)), 1e-300)
    along = np.linalg.norm(point.gradient - (point.gradient @ normal) * normal)
    near = pair_clarity(point, edge.state) < TELLING
    return near and bool(along <= ALONG * np.linalg.norm(point.gradient))


def _restart(
    problem: Problem, point: Point, damping: float, edge: Crossing | None
) -> tuple[list[Point], bool]:
    """One SLSQP iteration on this side of ``edge``; the points seen and whether the first step,
    taken whole, was the best."""
    n = len(point.x)
    G, h = np.vstack([np.eye(n), -np.eye(n)]), [problem.lower - point.x, point.x - problem.upper]
    if edge:
        apart = gap(point, edge.state)
        side = np.sign(apart)
        G = np.vstack([G, side * edge.slopes])
        h.append(np.array([ROOM * abs(apart) - side * edge.at(point.x)]))
    step = damped_step(point.jacobian, point.residuals, damping, G, np.concatenate(h))
    slope = float((point.jacobian.T @ point.residuals) @ step)  # of F^2/2 along it
    seen, share, before = [point], 1.0, 0.5 * point.objective**2
    for _ in range(MOST_TRIALS):
        try:
            there = problem.evaluate(np.clip(point.x + share * step, problem.lower, problem.upper))
        except EvaluationFailed:  # worse than anything
            rise = np.inf
        else:
            seen.append(there)
            rise = 0.5 * there.objective**2 - before
        if rise <= 0.1 * share * slope:
            break
        share *= max(share * slope / (2 * (share * slope - rise)), SMALLEST_PART)
    best = min(seen, key=lambda p: p.objective)
    return seen, len(seen) > 1 and best is seen[1]


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
