"""The calibration before any effect: x that fits the observations in their full covariance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .covariance import covariance
from .expansion import Expansion
from .model import Answer, Query, ResponseModel
from .observations import Observations

Array = np.ndarray
MAX_STEPS, MAX_STEP, CLOSE_ENOUGH = 12, 0.7, 0.02  # number of steps; largest and last step in x
# covariances by constants are formed anew at most so often, if x has moved by more than so much
MAX_COVARIANCES, SAME_COVARIANCE = 4, 0.1


def plain_fit(
    model: ResponseModel,
    observations: Observations,
    places: Array,
    form: float | None = None,
    known: Expansion | None = None,
    moved: Array | None = None,
    begin: Array | None = None,
) -> Array:
    """x (v,) by damped Gauss-Newton steps from the start; a step has at most ``MAX_STEP`` in any x.

    It ends within ``CLOSE_ENOUGH`` of the minimum, where the model has answered: the expansion
    about x goes the rest of the way.
    The covariance is that of the constants at the start and, where x has gone far, anew from there.
    places (n,): of the observations among the model's rows; form: see `covariance.model_form`;
    known: of the model about its start, on which the fit goes first; moved (n, k): what else may
    have moved the observations, as more constants; begin (v,): first guess of x, None: the model's
    start. Raises the model's own failure if the start has no solution.
    """
    run0 = np.array([row.run == 0 for row in observations.rows])
    rows, observed = places[run0], observations.only(run0)
    information = np.diag(model.spread**-2.0)
    more = np.zeros((len(rows), 0)) if moved is None else moved[run0]

    def descended(
        x: Array, evaluate: Callable[[Array], Answer | Exception], answer: Answer
    ) -> Array:
        """x (v,) after a descent from x, where ``answer`` is the model's."""

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
                return x  # which was evaluated: one step on there may be no solution
            for halvings in range(6):
                trial = x + step / 2**halvings
                reply = evaluate(trial)
                if isinstance(reply, Answer):
                    there = misfit(trial, reply)
                    if there < value:
                        x, answer, value = trial, reply, there
                        break
            else:
                return x
        return x

    def answer_at(x: Array, constants: bool = False) -> Answer | Exception:
        return model.answers([Query(x, constants=constants)])[0]

    def weights(constants: Array) -> Array:
        sources = np.hstack([constants[rows], more])
        sigma = covariance(observed, sources, model.material_laws, form)
        return np.asarray(np.linalg.inv(sigma))

    x = np.array(model.start if begin is None else begin, float)
    if known is not None:
        inverse = weights(known.constants)
        expanded = lambda x: Answer(*known.plain(x), known.split)
        near = descended(x, expanded, expanded(x))
        answer = answer_at(near)
        if isinstance(answer, Answer):
            return descended(near, answer_at, answer)
        return descended(x, answer_at, expanded(x))
    for again in range(MAX_COVARIANCES):
        answer = answer_at(x, constants=True)
        if isinstance(answer, Exception):
            raise answer
        assert answer.constants is not None
        inverse, before = weights(answer.constants), x
        x = descended(x, answer_at, answer)
        if abs(x - before).max() < SAME_COVARIANCE:
            # at ``before`` constants are known, and the step from there is small
            return before if again else x
    return x
