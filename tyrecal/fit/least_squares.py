"""The second method: Levenberg and Marquardt's damped Gauss-Newton steps within the bounds.

Each step d minimises |r + J d|^2 + mu |D d|^2, D^2 = diag(J^T J), subject to the bounds on x + d
(Nocedal and Wright, Numerical Optimization, sec. 10.3); mu falls after a step that lowers the
objective and rises after one that does not, or that leads to a design without a solution.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from ..evaluate.failure import EvaluationFailed
from .problem import Point, Problem
from .slsqp import Outcome, is_converged

Array = np.ndarray
STEPS = 100
DAMPING, STIFFEST = 0.1, 1e8  # mu at first, and where no step is left to try


def minimise(problem: Problem, start: Array, tolerance: float) -> Outcome:
    """Minimise the objective from ``start`` until the projected gradient is below ``tolerance``.

    Raises EvaluationFailed when the start itself cannot be evaluated.
    """
    point, damping = problem.evaluate(start), DAMPING
    for _ in range(STEPS):
        if is_converged(problem, point, tolerance):
            return Outcome(point, "converged")
        if damping > STIFFEST:
            return Outcome(point, "no lower objective along any damped step")
        try:
            trial = problem.evaluate(point.x + _step(problem, point, damping))
        except EvaluationFailed:
            damping *= 4
            continue
        if trial.objective < point.objective:
            point, damping = trial, damping / 5
        else:
            damping *= 4
    return Outcome(point, f"stopped after {STEPS} steps")


def _step(problem: Problem, point: Point, damping: float) -> Array:
    J, r = point.jacobian, point.residuals
    scale = np.maximum(np.linalg.norm(J, axis=0), 1e-6 * np.linalg.norm(J) + 1e-300)
    matrix = np.vstack([J, np.sqrt(damping) * np.diag(scale)])
    right = np.concatenate([-r, np.zeros(len(scale))])
    below, above = problem.lower - point.x, problem.upper - point.x
    room = 1e-12 * (problem.upper - problem.lower)  # lsq_linear wants the start strictly inside
    step: Array = lsq_linear(
        matrix, right, (np.minimum(below, 0) - room, np.maximum(above, 0) + room)
    ).x
    return np.clip(step, below, above)
