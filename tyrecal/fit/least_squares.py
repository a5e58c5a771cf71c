"""The second method: bounded nonlinear least squares on the same residuals (trust region)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from ..evaluate.failure import EvaluationFailed
from .problem import Problem
from .slsqp import Outcome

Array = np.ndarray


def minimise(problem: Problem, start: Array, tolerance: float) -> Outcome:
    """Minimise the objective from ``start`` with Branch, Coleman and Li's trust-region method.

    A design that cannot be evaluated makes the search start anew from the best point so far
    in a box half as wide. Raises EvaluationFailed when the start itself cannot be evaluated.
    """
    best = problem.evaluate(start)
    width = problem.upper - problem.lower
    message = "the search box shrank to nothing"
    while width.max() > 1e-3:
        lower = np.maximum(problem.lower, best.x - width)
        upper = np.minimum(problem.upper, best.x + width)
        inside = np.clip(best.x, lower + 1e-12 * width, upper - 1e-12 * width)
        try:
            result = least_squares(
                lambda x: problem.evaluate(x).residuals,
                inside,
                jac=lambda x: problem.evaluate(x).jacobian,
                bounds=(lower, upper),
                xtol=1e-10,
                ftol=1e-14,
                gtol=tolerance * max(best.objective, 1e-3) * 1e-2,
                max_nfev=60,
            )
        except EvaluationFailed:
            width = width / 2
            best = min((best, *problem.evaluated()), key=lambda p: p.objective)
            continue
        best = min((best, problem.evaluate(result.x)), key=lambda p: p.objective)
        message = result.message
        break
    return Outcome(best, message)
