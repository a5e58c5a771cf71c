"""Standard errors, correlations and singular values at the optimum, by the scatter of the data.

`total_error` adds what else is uncertain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .least_squares import pseudo_inverse
from .problem import Point, Problem

Array = np.ndarray


@dataclass(frozen=True)
class FitUncertainty:
    """Standard errors of a fit by the scatter of its targets."""

    # in each variable's own unit, None where the data do not determine it
    standard_errors: list[float | None]
    correlations: Array  # (v, v)
    # (v,) of the weighted Jacobian by the scaled variables, in the objective's unit, largest first:
    # a small one is a combination that the data do not see
    singular_values: Array
    # standard deviation of a frequency behind the errors, None where there is no frequency that
    # counts, or it cannot be known
    noise_Hz: float | None
    sigma: Array  # of each target in its unit, NaN where it does not count or cannot be known
    is_determined: Array  # (v,) whether the data determine a variable


def uncertainty(problem: Problem, point: Point) -> FitUncertainty:
    """Linearised uncertainty at ``point`` of the fit that was made, whatever its weights.

    The fit answers noise dq in the measured values with dx = B dq (`Problem.response`), B with the
    weights, multiplicities and sigmas of the objective, so its covariance is B diag(sigma^2) B^T
    (Seber and Wild, Nonlinear Regression, sec. 2.1). A doublet is one measured value. sigma is the
    targets' own; frequencies that have none share one that is estimated from their residuals.
    """
    counts = problem.scale > 0
    point = point.plain
    J = point.jacobian[counts]
    inverse, _ = pseudo_inverse(J.T @ J)
    sigma = _noise(problem, point, counts, np.einsum("ij,jk,ik->i", J, inverse, J))
    response, seen = problem.response(point)
    covariance = (response * sigma**2) @ response.T
    errors = standard_errors(problem, point, covariance, seen)
    spread = np.sqrt(np.where(seen & np.isfinite(sigma).all(), np.diag(covariance), np.inf))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlations = covariance / np.outer(spread, spread)
        correlations[~seen] = correlations[:, ~seen] = np.nan
    values = np.zeros(J.shape[1])  # fewer data than variables leave some combinations unseen
    singular_values = np.linalg.svd(J, compute_uv=False)
    values[: len(singular_values)] = singular_values
    modal = sigma[: int(counts[: len(problem.targets)].sum())]
    noise = float(np.sqrt(np.mean(modal**2))) if len(modal) else float("nan")
    every = np.full(len(problem.scale), np.nan)
    every[counts] = sigma
    return FitUncertainty(
        errors, correlations, values, noise if np.isfinite(noise) else None, every, seen
    )


def standard_errors(
    problem: Problem, point: Point, covariance: Array, seen: Array
) -> list[float | None]:
    """Standard error of each variable in its own unit; None where the data do not determine it."""
    slopes = [v.slope(point.values[v.name]) for v in problem.variables]
    spread = np.sqrt(np.where(seen, np.diag(covariance), np.inf))
    return [float(s * k) if np.isfinite(s) else None for s, k in zip(spread, slopes, strict=True)]


def _noise(problem: Problem, point: Point, counts: Array, leverage: Array) -> Array:
    """Standard deviation of each target that counts, in its unit; NaN if nothing determines it.

    leverage: diagonal of J (J^T J)^-1 J^T, whose sum is the number of variables that the data see:
    what the targets with a sigma do not determine of them, the others lose as freedom.
    """
    sigma = np.array([t.sigma or np.nan for t in problem.measured])[counts]
    unknown = np.isnan(sigma)
    if problem.noise_Hz:
        return np.where(unknown, problem.noise_Hz, sigma)
    freedom = unknown.sum() - (len(problem.variables) - leverage[~unknown].sum())
    if freedom > 1e-9:  # else the fit goes through every point and says nothing about noise
        plain = (point.residuals[counts] / problem.scale[counts])[unknown]
        sigma[unknown] = np.linalg.norm(plain) / np.sqrt(freedom)
    return sigma
