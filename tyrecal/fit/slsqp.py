"""SLSQP on the design variables, restarted in the Gauss-Newton metric of each point it reaches.

Raw variables of sizes 1e-7 and 1e6 stop SLSQP at its start, and its identity first Hessian sends
it to the bounds. So each restart works in coordinates y, x = x_k + F_k (J^T J + mu)^(-1/2) y, in
which the Hessian of F^2/2 is the identity but for the residuals' curvature (Nocedal and Wright,
Numerical Optimization, ch. 10 and 18); bounds become linear constraints.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ..evaluate.failure import EvaluationFailed
from ..modes.mode import Label
from .problem import Point, Problem

Array = np.ndarray
RESTARTS = 40
EXACT = 1e-3  # Hz, an objective below every measurement's resolution
DAMPING = 0.1  # mu over the mean diagonal of J^T J, at first
TRIALS = 3  # of a step, where the objective may jump
AT_JUMP = "less is left to gain than areas and stiffnesses jump by"
MIXED = 0.8  # labels of the two [0, 0] modes are less clear than this: they have met
AXIAL, TORSIONAL = Label(0, 0, "axial"), Label(0, 0, "torsional")


class _Jump(Exception):
    """No lower objective along a step, however short."""


@dataclass(frozen=True)
class Outcome:
    """Where an optimiser stopped, and in its own words why."""

    point: Point
    message: str


def minimise(problem: Problem, start: Array, tolerance: float) -> Outcome:
    """Minimise the objective from ``start`` until the projected gradient is below ``tolerance``.

    Where the search ends with the two [0, 0] modes mixed, it is stuck beside their crossing, at
    which the labels change places and the objective jumps; then the other side is searched too.

    Raises EvaluationFailed when the start itself cannot be evaluated.
    """
    best = _descend(problem, problem.evaluate(start), tolerance)
    if _pair_clarity(best.point) < MIXED:
        for across in _beyond_crossing(problem, best.point):
            try:
                there = problem.evaluate(across)
            except EvaluationFailed:
                continue
            other = _descend(problem, there, tolerance)
            if other.point.objective < best.point.objective:
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


def is_at_jump(problem: Problem, point: Point, lowered: float = 0.0) -> bool:
    """Whether areas and stiffnesses jump by more than is left to gain, and a step from the point
    ``lowered`` the objective by less than a quarter of that: were it quadratic, a Gauss-Newton
    step would lower it by (J^T r) . (J^T J)^-1 (J^T r) / 2F, of the variables that no bound holds.
    """
    if not point.roughness:
        return False
    free = ((point.x > problem.lower + 1e-9) | (point.gradient < 0)) & (
        (point.x < problem.upper - 1e-9) | (point.gradient > 0)
    )
    step = np.linalg.lstsq(point.jacobian[:, free], -point.residuals, rcond=None)[0]
    gain = -0.5 * float(point.gradient[free] @ step)
    return gain <= point.roughness and lowered < gain / 4


def _pair_clarity(point: Point) -> float:
    """How clearly the two [0, 0] modes are told apart; 1 where they are not both wanted."""
    modes = [point.modes[label] for label in (AXIAL, TORSIONAL) if label in point.modes]
    return min((m.clarity for m in modes), default=1.0) if len(modes) == 2 else 1.0


def _descend(problem: Problem, point: Point, tolerance: float) -> Outcome:
    damping, message = DAMPING, "restarts used up"
    for _ in range(RESTARTS):
        if is_converged(problem, point, tolerance):
            return Outcome(point, "converged")
        reached, full_step = _restart(problem, point, damping)
        if is_at_jump(problem, point, point.objective - reached.objective):
            return Outcome(reached, AT_JUMP)
        if reached.objective >= point.objective - 1e-9 * max(point.objective, 1e-3):
            if damping > 1e3 * DAMPING:
                return Outcome(point, "no lower objective along the search direction")
            damping *= 10
            continue
        damping *= 0.3 if full_step else 2.0
        point = reached
    return Outcome(point, message)


def _restart(problem: Problem, point: Point, damping: float) -> tuple[Point, bool]:
    """One SLSQP iteration; the best point seen and whether the first step was taken whole."""
    J, scale = point.jacobian, max(point.objective, 1e-300)
    H = J.T @ J
    H[np.diag_indices(len(H))] += damping * np.trace(H) / len(H)
    turn = scale * np.linalg.inv(np.linalg.cholesky(H)).T
    seen = [point]

    def function(y: Array) -> tuple[float, Array]:
        if point.roughness and len(seen) > TRIALS + 1:
            raise _Jump  # each trial presses several tyres
        x = np.clip(point.x + turn @ y, problem.lower, problem.upper)
        try:
            there = problem.evaluate(x)
        except EvaluationFailed:
            return np.inf, np.zeros(len(y))  # worse than anything: the line search steps back
        seen.append(there)
        gradient = there.jacobian.T @ there.residuals
        return 0.5 * (there.objective / scale) ** 2, turn.T @ gradient / scale**2

    bounds = {
        "type": "ineq",
        "fun": lambda y: np.concatenate(
            [point.x + turn @ y - problem.lower, problem.upper - point.x - turn @ y]
        ),
        "jac": lambda y: np.concatenate([turn, -turn]),
    }
    with suppress(_Jump):
        minimize(
            function,
            np.zeros(len(J.T)),
            jac=True,
            method="SLSQP",
            constraints=[bounds],
            options={"maxiter": 1, "ftol": 1e-15},
        )
    best = min(seen, key=lambda p: p.objective)
    return best, len(seen) > 2 and best is seen[2]


def _beyond_crossing(problem: Problem, point: Point) -> Iterator[Array]:
    """Designs on the other side of the [0, 0] modes' crossing, the nearest in the metric first.

    Their frequency difference g is linearised, and carried to -delta with the least change of
    the residuals: dx = -(g + delta) H^-1 grad g / (grad g . H^-1 grad g).
    """
    labels = [t.label for t in problem.targets]
    if AXIAL not in labels or TORSIONAL not in labels:
        return
    i, j = labels.index(AXIAL), labels.index(TORSIONAL)
    scale = problem.scale
    if not (scale[i] and scale[j]):
        return
    slopes = point.jacobian / np.where(scale > 0, scale, 1.0)[:, None]
    gap = point.modes[AXIAL].frequency_Hz - point.modes[TORSIONAL].frequency_Hz
    rise = slopes[i] - slopes[j]
    H = point.jacobian.T @ point.jacobian
    H[np.diag_indices(len(H))] += 1e-3 * np.trace(H) / len(H)
    direction = np.linalg.solve(H, rise)
    if abs(rise @ direction) < 1e-12 * (rise @ rise + 1e-300):
        return
    for wanted in (1.0, 2.0, 4.0):  # Hz beyond
        change = -(gap + np.sign(gap) * wanted) * direction / (rise @ direction)
        yield np.clip(point.x + change, problem.lower, problem.upper)
