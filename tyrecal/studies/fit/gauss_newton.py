"""A damped Gauss-Newton method that learns the residuals' curvature: for solvers that take minutes.

Each step minimises a model of second order of the residuals, with the curvature that the designs
seen so far show (`curvature`), within the bounds. Steps are damped as Levenberg and Marquardt's
are, by how much of the promised decrease comes true (Nocedal and Wright, Numerical Optimization,
ch. 10). An ``edge`` bounds steps where the two [0, 0] modes change labels (`crossing`). With three
variables it needs a third of the designs of SLSQP, or fewer, because it knows each residual's
slopes and not their sum alone.
"""

from __future__ import annotations

import numpy as np

from ...simulate.evaluate.failure import EvaluationFailed
from .crossing import Crossing, crossing
from .curvature import curved_step, foreseen, with_secant
from .problem import Point, Problem
from .search import (
    CONVERGED,
    DAMPING,
    EXACT,
    MAX_DESIGNS,
    MIN_OBJECTIVE_GAIN,
    NO_LOWER,
    USED_UP,
    CrossingWatch,
    Descent,
    has_nothing_to_gain,
    is_converged,
    room_to_move,
)

Array = np.ndarray
MIN_DAMPING = 1e-6  # mu over the mean diagonal of J^T J, at last
GOOD_GAIN, POOR_GAIN = 0.7, 0.25  # shares of a promised decrease: above mu falls, below it rises
HALVINGS = 5  # of a step towards a design without a solution


def descend(
    problem: Problem, point: Point, tolerance: float, known: Point | None = None
) -> Descent:
    """Lower the objective F from ``point`` until the norm of its projected gradient is below
    ``tolerance``; known: the end of an earlier search beyond the crossing, or None."""
    damping, watch = DAMPING, CrossingWatch(problem, known)
    curvature = np.zeros((*point.jacobian.shape, len(point.x)))  # C of `curvature`
    for _ in range(MAX_DESIGNS):
        if is_converged(problem, point, tolerance):
            return Descent(point, CONVERGED)
        step = _step(problem, point, curvature, damping, watch.edge)
        if (
            promised(point, curvature, step)
            <= MIN_OBJECTIVE_GAIN * max(point.objective, EXACT) ** 2
        ):
            end = CONVERGED if has_nothing_to_gain(problem, point) else NO_LOWER
            return Descent(point, end, watch.edge)
        there = _first_solvable(problem, point, step)
        if there is None:
            damping *= 4
            continue
        end = watch.judge(point, there)
        reached = min(point, there, key=lambda p: p.objective)
        if end:
            return Descent(reached, end, watch.edge)
        if watch.edge:  # its sensitivities are best known where the search is
            watch.edge = crossing(problem, (point, there), reached) or watch.edge
        change, gain = there.x - point.x, point.objective**2 - there.objective**2
        wanted = promised(point, curvature, change)
        if not gain >= POOR_GAIN * wanted:
            damping *= 4
        elif gain > GOOD_GAIN * wanted:
            damping = max(0.1 * damping, MIN_DAMPING)
        curvature = with_secant(curvature, change, there.jacobian - point.jacobian)
        point = reached
    return Descent(point, USED_UP, watch.edge)


def promised(point: Point, curvature: Array, change: Array) -> float:
    """Fall of F^2, the sum of squared residuals, that the model promises."""
    r = foreseen(point.jacobian, point.residuals, curvature, change)
    return float(point.objective**2 - r @ r)


def _first_solvable(problem: Problem, point: Point, step: Array) -> Point | None:
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
    """The step (variables,) on this side of ``edge``."""
    G, h = room_to_move(problem, point, edge)  # G step >= h
    return curved_step(point.jacobian, point.residuals, curvature, damping, G, h)
