"""The second method: Levenberg and Marquardt's damped Gauss-Newton steps within the bounds.

Of each step (`damped_step`) mu falls after one that lowers the objective, and rises after one that
does not.
"""

from __future__ import annotations

import numpy as np

from .damped_step import damped_step
from .problem import Point, Problem
from .slsqp import Descent, first_solvable, is_converged

Array = np.ndarray
MAX_ITERATIONS_LM = 100
START_DAMPING, MAX_DAMPING = 0.1, 1e8  # mu at first, and where no step is left to try


def minimise(problem: Problem, start: Array, tolerance: float) -> Descent:
    """Minimise the objective from ``start`` until the projected gradient is below ``tolerance``.

    Raises EvaluationFailed when the start itself cannot be evaluated.
    """
    point, damping = problem.evaluate(start), START_DAMPING
    for _ in range(MAX_ITERATIONS_LM):
        if is_converged(problem, point, tolerance):
            return Descent(point, "converged")
        if damping > MAX_DAMPING:
            return Descent(point, "no lower objective along any damped step")
        trial = first_solvable(problem, point, _step(problem, point, damping))
        if trial is not None and trial.objective < point.objective:
            point, damping = trial, damping / 5
        else:
            damping *= 4
    return Descent(point, f"stopped after {MAX_ITERATIONS_LM} steps")


def _step(problem: Problem, point: Point, damping: float) -> Array:
    below, above = problem.lower - point.x, problem.upper - point.x
    sides = np.vstack([np.eye(len(below)), -np.eye(len(below))])
    step = damped_step(
        point.jacobian, point.residuals, damping, sides, np.concatenate([below, -above])
    )
    return np.clip(step, below, above)
