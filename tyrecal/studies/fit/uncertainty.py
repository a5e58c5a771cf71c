"""Standard errors, correlations and singular values at the optimum, by the scatter of the data.

`total_error` adds what else is uncertain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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

    The fit answers noise dq in the measured values with dx = (J^T J)^-1 J^T W^(1/2) dq, J and
    W^(1/2) with the weights, multiplicities and sigmas of the objective, so its covariance is
    B diag(sigma^2) B^T with B = (J^T J)^-1 J^T W^(1/2) (Seber and Wild, Nonlinear Regression,
    sec. 2.1). A doublet is one measured value. sigma is the targets' own; frequencies that have
    none share one that is estimated from their residuals.
    """
    counts = problem.scale > 0
    J, root = point.jacobian[counts], problem.scale[counts]
    inverse, _ = _inverse(J.T @ J)
    sigma = _noise(problem, point, counts, np.einsum("ij,jk,ik->i", J, inverse, J))
    covariance, seen = fit_covariance(J, root, sigma)
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


def fit_covariance(J: Array, root: Array, sigma: Array) -> tuple[Array, Array]:
    """Covariance (v, v) of the coordinates by rows of the weighted Jacobian, W^(1/2) and sigma of
    targets, see `uncertainty`; which variables the data see (v,)."""
    response, seen = fit_response(J, root)
    return (response * sigma**2) @ response.T, seen


def fit_response(J: Array, root: Array) -> tuple[Array, Array]:
    """B = (J^T J)^-1 J^T W^(1/2) (v, n): d x / d q of the fitted coordinates by the targets; which
    variables the data determine (v,)."""
    inverse, seen = _inverse(J.T @ J)
    return inverse @ (J * root[:, None]).T, seen


def standard_errors(
    problem: Problem, point: Point, covariance: Array, seen: Array
) -> list[float | None]:
    """Standard error of each variable in its own unit; None where the data do not determine it."""
    slopes = [v.slope(point.values[v.name]) for v in problem.variables]
    spread = np.sqrt(np.where(seen, np.diag(covariance), np.inf))
    return [float(s * k) if np.isfinite(s) else None for s, k in zip(spread, slopes, strict=True)]


def _noise(problem: Problem, point: Point, counts: Array, leverage: Array) -> Array:
    """Standard deviation of each target that counts, in its unit; NaN where nothing determines it.

    leverage: diagonal of J (J^T J)^-1 J^T, whose sum is the number of variables that the data see:
    what the targets with a sigma do not determine of them, the others lose as freedom.
    """
    modal = [t.sigma_Hz or np.nan for t in problem.targets]
    sigma = np.array(modal + [t.sigma for t in problem.others])[counts]
    unknown = np.isnan(sigma)
    freedom = unknown.sum() - (len(problem.variables) - leverage[~unknown].sum())
    if freedom > 1e-9:  # else the fit goes through every point and says nothing about noise
        plain = (point.residuals[counts] / problem.scale[counts])[unknown]
        sigma[unknown] = np.linalg.norm(plain) / np.sqrt(freedom)
    return sigma


def _inverse(information: Array) -> tuple[Array, Array]:
    """Pseudo-inverse, and which variables the data see (v,)."""
    values, vectors = np.linalg.eigh(information)
    blind = values <= 1e-14 * max(values[-1], 1e-300)
    seen = (vectors[:, blind] ** 2).sum(1) <= 1e-8
    kept = vectors[:, ~blind]
    return (kept / values[~blind]) @ kept.T, seen
