"""The calibration before any effect: x that fits the observations in their full covariance."""

from __future__ import annotations

import numpy as np

from .covariance import covariance
from .model import Answer, Query, ResponseModel
from .observations import Observations

Array = np.ndarray
MAX_STEPS, MAX_STEP, CLOSE_ENOUGH = 12, 0.7, 0.02


def plain_fit(
    model: ResponseModel, observations: Observations, places: Array, form: float | None = None
) -> Array:
    """x (v,) by damped Gauss-Newton steps from the start; a step has at most ``MAX_STEP`` in any x.

    It ends within ``CLOSE_ENOUGH`` of the minimum: the expansion about x goes the rest of the way.
    Raises the model's own failure where the start has no solution.
    """
    x = np.array(model.start, float)
    run0 = np.array([row.run == 0 for row in observations.rows])
    rows, observed = places[run0], observations.only(run0)
    (answer,) = model.answers([Query(x, constants=True)])
    if isinstance(answer, Exception):
        raise answer
    assert answer.constants is not None
    inverse = np.linalg.inv(covariance(observed, answer.constants[rows], form))
    information = np.diag(model.spread**-2.0)

    def misfit(x: Array, answer: Answer) -> float:
        r, off = observed.y - answer.eta[rows], (x - model.start) / model.spread
        return float(r @ inverse @ r + off @ off)

    value = misfit(x, answer)
    for _ in range(MAX_STEPS):
        J, r = answer.jacobian[rows], observed.y - answer.eta[rows]
        slope = J.T @ inverse @ r + information @ (model.start - x)
        step = np.linalg.solve(J.T @ inverse @ J + information, slope)
        step *= min(1.0, MAX_STEP / max(abs(step).max(), 1e-300))
        if abs(step).max() < CLOSE_ENOUGH:
            return x + step
        for halvings in range(6):
            trial = x + step / 2**halvings
            (found,) = model.answers([Query(trial)])
            if isinstance(found, Answer):
                there = misfit(trial, found)
                if there < value:
                    x, answer, value = trial, found, there
                    break
        else:
            return x
    return x
