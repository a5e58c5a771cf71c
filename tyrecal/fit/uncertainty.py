"""What the data determine: standard errors, correlations and singular values at the optimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .problem import Point, Problem

Array = np.ndarray


@dataclass(frozen=True)
class Uncertainty:
    """standard_errors: in each variable's own unit (None where the data leave it free);
    correlations (v, v); singular_values (v,) of the weighted Jacobian by the scaled variables,
    Hz, largest first: a small one is a combination that the data do not see; noise_Hz: the
    standard deviation of a frequency behind the errors."""

    standard_errors: list[float | None]
    correlations: Array
    singular_values: Array
    noise_Hz: float


def uncertainty(problem: Problem, point: Point) -> Uncertainty:
    """Linearised uncertainty at ``point``: covariance = sigma^2 (J^T J)^-1 (Seber and Wild, ch. 2).

    sigma is stated by the targets where all of them have one, else it is estimated from the
    residuals: each doublet is one measured value, so there are as many as targets.
    """
    J = point.jacobian
    sigmas = [t.sigma_Hz for t in problem.targets]
    if all(sigmas):
        noise = float(np.sqrt(np.mean(np.square([s or 0.0 for s in sigmas]))))
        scale = np.array([np.sqrt(t.multiplicity * t.weight) for t in problem.targets])
        rows = J / np.where(scale > 0, scale, 1)[:, None] / np.array(sigmas, float)[:, None]
        covariance = _inverse(rows.T @ rows)
    else:
        freedom = max(len(problem.targets) - len(problem.variables), 1)
        noise = float(np.sqrt(point.residuals @ point.residuals / freedom))
        covariance = _inverse(J.T @ J)
        covariance[np.isfinite(covariance)] *= noise**2
    spread = np.sqrt(np.diag(covariance))
    slopes = np.array([v.slope(point.values[v.name]) for v in problem.variables])
    errors = [float(s * k) if np.isfinite(s) else None for s, k in zip(spread, slopes, strict=True)]
    with np.errstate(invalid="ignore", divide="ignore"):
        correlations = covariance / np.outer(spread, spread)
    return Uncertainty(errors, correlations, np.linalg.svd(J, compute_uv=False), noise)


def _inverse(information: Array) -> Array:
    """Inverse; infinite variance where the information is singular to round-off."""
    values, vectors = np.linalg.eigh(information)
    free = values <= 1e-14 * values[-1]
    if not free.any():
        return (vectors / values) @ vectors.T
    touched = (vectors[:, free] ** 2).sum(1) > 1e-8
    covariance = (vectors[:, ~free] / values[~free]) @ vectors[:, ~free].T
    covariance[touched, touched] = np.inf
    return covariance
