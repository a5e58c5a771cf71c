"""The second method: bounded nonlinear least squares on the same residuals (trust region)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import least_squares

from ..evaluate.failure import EvaluationFailed
from .problem import Point, Problem
from .slsqp import Outcome, is_converged

Array = np.ndarray
ROUNDS = 40


def minimise(problem: Problem, start: Array, tolerance: float) -> Outcome:
    """Minimise the objective from ``start`` with Branch, Coleman and Li's trust-region method.

    A design that cannot be evaluated makes the search start anew from the best point so far in a
    box half as far as that design; a box that holds the search back is opened again.
    Raises EvaluationFailed when the start itself cannot be evaluated.
    """
    best = problem.evaluate(start)
    radius = float((problem.upper - problem.lower).max())
    for _ in range(ROUNDS):
        reached, failed_at, message = _search(problem, best, radius)
        if failed_at is None and (
            is_converged(problem, reached, tolerance)
            or reached.objective > best.objective - 1e-6 * max(best.objective, 1e-3)
        ):
            return Outcome(reached, message)
        best = reached
        if failed_at is None:
            radius *= 2
        else:
            radius = 0.5 * float(abs(failed_at - best.x).max())
    return Outcome(best, f"stopped after {ROUNDS} rounds in boxes around the best design")


def _search(problem: Problem, best: Point, radius: float) -> tuple[Point, Array | None, str]:
    """One run in a box around ``best``: the best point, the design that failed, the message."""
    lower = np.maximum(problem.lower, best.x - radius)
    upper = np.minimum(problem.upper, best.x + radius)
    inside = np.clip(best.x, lower + 1e-9 * (upper - lower), upper - 1e-9 * (upper - lower))
    seen = [best]
    asked = inside

    def at(x: Array) -> Point:
        nonlocal asked
        asked = x
        seen.append(problem.evaluate(x))
        return seen[-1]

    options: dict[str, Any] = {"xtol": 1e-10, "ftol": 1e-12, "gtol": 1e-10, "max_nfev": 60}
    try:
        result = least_squares(
            lambda x: at(x).residuals,
            inside,
            jac=lambda x: at(x).jacobian,
            bounds=(lower, upper),
            **options,
        )
        failed_at, message = None, str(result.message)
    except EvaluationFailed as failure:
        failed_at, message = asked, str(failure)
    return min(seen, key=lambda p: p.objective), failed_at, message
