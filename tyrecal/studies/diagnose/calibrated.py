"""Design variables as a diagnosis calibrates them, without an effect and with the likeliest."""

from __future__ import annotations

import numpy as np

from ...files import Json
from ..inference.tyre_model import TyreModel
from .diagnosis import Diagnosis
from .evidence import NONE

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
