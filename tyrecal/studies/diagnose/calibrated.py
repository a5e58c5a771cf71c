"""Design variables as a diagnosis calibrates them, without an effect and with the likeliest, and
predictions for modes that were not measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...files import Json
from ..inference.inverse_problem import InverseProblem
from ..inference.model import ModelRow
from ..inference.observations import Observable, Observations
from ..inference.tyre_model import TyreModel
from .diagnosis import Diagnosis
from .evidence import NONE, Hypothesis

Array = np.ndarray
SLOPE_STEP = 1e-6  # of x, for the slope of a variable in its own unit


def calibrated_variables(diagnosis: Diagnosis, model: TyreModel) -> Json:
    """``without`` and ``with`` (None where there is no gap): {variable: value, standard_error, both
    in ``unit``}.

    Values at the effect's likeliest size; standard errors over all sizes that are left open.
    """
    key = diagnosis.leading
    return {
        "without": _calibrated(diagnosis, model, NONE),
        "with": _calibrated(diagnosis, model, key) if key else None,
    }


def _calibrated(diagnosis: Diagnosis, model: TyreModel, key: str) -> dict[str, Json]:
    """Value, standard error and unit of each variable under the hypothesis ``key``."""
    hypothesis = diagnosis.hypothesis(key)
    p, d = hypothesis.posterior, hypothesis.fitted.d  # (q,), (q, v)
    apart = d - p @ d
    # mean of the covariances, and covariance of the means, over the parameters
    covariance = np.tensordot(p, hypothesis.fitted.covariance, 1) + (p[:, None] * apart).T @ apart
    x = diagnosis.problem.expansion.x0 + d[hypothesis.best]
    values = model.designs.values(x)
    above, below = (model.designs.values(x + step) for step in (SLOPE_STEP, -SLOPE_STEP))
    scatter = np.sqrt(np.diag(covariance)).tolist()  # of x
    return {
        name: {
            "value": values[name],
            "standard_error": scatter[i] * (above[name] - below[name]) / (2 * SLOPE_STEP),
            "unit": model.designs.unit(name),
        }
        for i, name in enumerate(values)
    }


def likeliest(
    problem: InverseProblem, hypothesis: Hypothesis, rows: Sequence[ModelRow], places: Array
) -> Array:
    """ln values (m,) of the rows with the indices ``places``, at the likeliest sizes and variables
    of an explanation, with constants as they are stated."""
    best = int(np.argmax(hypothesis.posterior))
    eta, unknown = problem.expansion.eta[places], np.full(len(places), np.nan)
    unseen = tuple(Observable.of(rows[i]) for i in places)
    observations = Observations(
        unseen, eta, 0 * eta, common=0.0, split=unknown, split_scatter=unknown
    )
    effects = {id: e[[best]] for id, e in hypothesis.values.items()}
    d, zeta = hypothesis.fitted.d[[best]], float(hypothesis.fitted.zeta[best])
    there = replace(problem, observations=observations, places=places, zeta=0.0)
    uncoupled = there.predicted(effects, d)[0]  # decides which of two near modes is the upper one
    return replace(there.measured(uncoupled), zeta=zeta).predicted(effects, d)[0]
