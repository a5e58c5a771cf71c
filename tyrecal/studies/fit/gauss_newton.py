"""A damped Gauss-Newton method that learns the residuals' curvature: for solvers that take minutes.

Each step minimises a model of second order of the residuals, with the curvature that the designs
seen so far show, within the bounds. Steps are damped as Levenberg and Marquardt's
are, by how much of the promised decrease comes true (Nocedal and Wright, Numerical Optimization,
ch. 10). An ``edge`` bounds steps where the two [0, 0] modes change labels (`crossing`). With three
variables it needs half the designs of SLSQP, because it knows each residual's slopes at every step.

    r(x + d) ~ r + J d + d^T C d / 2

C (m, v, v) of m residuals and v variables is 0 at first. Each design that is seen changes it as
little as it must for C s = J(x + s) - J(x): Powell's symmetric form of Broyden's secant, residual
by residual (Dennis and Schnabel, Numerical Methods for Unconstrained Optimization, sec. 9.1 and
10.3). What Gauss and Newton leave out of the Hessian of |r|^2 / 2, sum of r_i C_i, costs a third of
the designs where a fit starts far off or its residuals do not vanish.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from ...simulate.evaluate.failure import EvaluationFailed
from .crossing import Crossing, crossing
from .problem import Point, Problem
from .search import (
    CONVERGED,
    DAMPING,
    EXACT,
    MAX_DESIGNS,
    MIN_DAMPING,
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
GOOD_GAIN, POOR_GAIN = 0.7, 0.25  # shares of a promised decrease: above mu falls, below it rises
HALVINGS = 5  # of a step towards a design without a solution


def descend(
    problem: Problem, point: Point, tolerance: float, known: Point | None = None
) -> Descent:
    """Lower the objective F from ``point`` until the norm of its projected gradient is below
    ``tolerance``; known: the end of an earlier search beyond the crossing, or None."""
    damping, watch = DAMPING, CrossingWatch(problem, known)
    curvature = np.zeros((*point.jacobian.shape, len(point.x)))  # C
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


MAX_NEWTON_STEPS = 20  # on the model, which needs no evaluation
MIN_MOVE = 1e-7  # of a coordinate
MAX_HALVINGS = 12  # of a step on the model
ROUND_OFF = 1e-12  # of numbers of the order of 1


def with_secant(C: Array, s: Array, change: Array) -> Array:
    """C after a design at x + s, whose slopes differ by ``change`` (m, v) from those at x."""
    left, length = change - C @ s, s @ s
    pushed = left[:, :, None] * s
    both = pushed + pushed.swapaxes(1, 2)
    return np.asarray((both - (left @ s)[:, None, None] * np.outer(s, s) / length) / length + C)


def foreseen(J: Array, r: Array, C: Array, d: Array) -> Array:
    """r(x + d) (m,) by the model."""
    return np.asarray(r + J @ d + C @ d @ d / 2)


def curved_step(J: Array, r: Array, C: Array, damping: float, G: Array, h: Array) -> Array:
    """d (v,) of the least |r(x + d)|^2 + mu |d|^2 tr(J^T J) / v where G d >= h, as of
    `search.room_to_move`; ``damping``: mu.

    By Newton's method on the model, each step halved until the model falls, and Gauss and Newton's
    where its Hessian is not positive definite."""
    v = J.shape[1]
    weight = damping * np.trace(J.T @ J) / v
    value = lambda d: np.sum(foreseen(J, r, C, d) ** 2) + weight * d @ d
    d = np.zeros(v)
    for _ in range(MAX_NEWTON_STEPS):
        at, slopes = foreseen(J, r, C, d), J + C @ d
        H, g = slopes.T @ slopes + weight * np.eye(v), slopes.T @ at + weight * d
        size = max(float(np.linalg.norm(at)), 1e-300)
        try:
            whole = quadratic_step(H + np.tensordot(at, C, 1), g, size, G, h - G @ d)
        except np.linalg.LinAlgError:
            whole = quadratic_step(H, g, size, G, h - G @ d)
        parts = (whole / 2**k for k in range(MAX_HALVINGS))
        move = next((part for part in parts if value(d + part) < value(d)), np.zeros(v))
        d = d + move
        if abs(move).max() < MIN_MOVE:
            break
    return d


def quadratic_step(H: Array, g: Array, size: float, G: Array, h: Array) -> Array:
    """d (v,) of the least g . d + d . H d / 2 where G d >= h; ``size``: F, the residuals' norm. In
    coordinates y, d = F H^(-1/2) y, it is the point of the polyhedron nearest to the free step.

    Raises LinAlgError where H is not positive definite."""
    turn = size * np.linalg.inv(np.linalg.cholesky(H)).T
    return np.asarray(turn @ nearest(-turn.T @ g / size**2, G @ turn, h))


def nearest(to: Array, G: Array, h: Array) -> Array:
    """y (v,) with G y >= h that is nearest to a point; 0 where there is none (Lawson and Hanson,
    Solving Least Squares Problems, sec. 23.4, algorithm LDP)."""
    E = np.vstack([G.T, h - G @ to])
    last = np.eye(len(E))[-1]
    residual = E @ nnls(E, last)[0] - last
    if abs(residual[-1]) < ROUND_OFF:
        return np.zeros(len(to))
    return np.asarray(to - residual[:-1] / residual[-1])
