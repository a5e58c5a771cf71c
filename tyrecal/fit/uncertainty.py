"""What the data determine: standard errors, correlations and singular values at the optimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .problem import Point, Problem

Array = np.ndarray


@dataclass(frozen=True)
class Uncertainty:
    """standard_errors: in each variable's own unit, None where the data do not tell;
    correlations (v, v); singular_values (v,) of the weighted Jacobian by the scaled variables,
    Hz, largest first: a small one is a combination that the data do not see; noise_Hz: the
    standard deviation of a frequency behind the errors, None where it cannot be known."""

    standard_errors: list[float | None]
    correlations: Array
    singular_values: Array
    noise_Hz: float | None


def uncertainty(problem: Problem, point: Point) -> Uncertainty:
    """Linearised uncertainty at ``point`` of the fit that was made, whatever its weights.

    The fit answers noise df in the measured frequencies with dx = (J^T J)^-1 J^T W^(1/2) df, J
    and W^(1/2) with the weights and multiplicities of the objective, so its covariance is
    B diag(sigma^2) B^T with B = (J^T J)^-1 J^T W^(1/2) (Seber and Wild, Nonlinear Regression,
    sec. 2.1). A doublet is one measured value. sigma is stated by the targets where all that
    count have one, else one sigma for all is estimated from the residuals.
    """
    root = np.sqrt([t.weight * t.multiplicity for t in problem.targets])
    counts = root > 0
    J, root = point.jacobian[counts], root[counts]
    sigma = _noise(problem, point, counts)
    inverse, seen = _inverse(J.T @ J)
    response = inverse @ (J * root[:, None]).T
    covariance = (response * sigma**2) @ response.T
    spread = np.sqrt(np.where(seen & np.isfinite(sigma).all(), np.diag(covariance), np.inf))
    slopes = [v.slope(point.values[v.name]) for v in problem.variables]
    errors = [float(s * k) if np.isfinite(s) else None for s, k in zip(spread, slopes, strict=True)]
    with np.errstate(invalid="ignore", divide="ignore"):
        correlations = covariance / np.outer(spread, spread)
        correlations[~seen] = correlations[:, ~seen] = np.nan
    values = np.zeros(J.shape[1])  # fewer data than variables leave some combinations unseen
    found = np.linalg.svd(J, compute_uv=False)
    values[: len(found)] = found
    noise = float(np.sqrt(np.mean(sigma**2))) if len(sigma) else float("nan")
    return Uncertainty(errors, correlations, values, noise if np.isfinite(noise) else None)


def _noise(problem: Problem, point: Point, counts: Array) -> Array:
    """Standard deviation of each target that counts, Hz; NaN where nothing tells."""
    stated = [t.sigma_Hz for t, c in zip(problem.targets, counts, strict=True) if c]
    if all(stated):
        return np.array(stated, float)
    freedom = len(stated) - len(problem.variables)
    if freedom <= 0:  # the fit goes through every point and says nothing about noise
        return np.full(len(stated), np.nan)
    plain = [
        point.modes[t.label].frequency_Hz - t.frequency_Hz
        for t, c in zip(problem.targets, counts, strict=True)
        if c
    ]
    return np.full(len(stated), np.linalg.norm(plain) / np.sqrt(freedom))


def _inverse(information: Array) -> tuple[Array, Array]:
    """Pseudo-inverse, and which variables the data see (v,)."""
    values, vectors = np.linalg.eigh(information)
    blind = values <= 1e-14 * max(values[-1], 1e-300)
    seen = (vectors[:, blind] ** 2).sum(1) <= 1e-8
    kept = vectors[:, ~blind]
    return (kept / values[~blind]) @ kept.T, seen
