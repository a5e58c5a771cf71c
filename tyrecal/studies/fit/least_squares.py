"""Least squares that are linear: how their solution answers the data."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def fit_covariance(J: Array, root: Array, sigma: Array) -> tuple[Array, Array]:
    """Covariance (v, v) of the coordinates by rows of the weighted Jacobian, W^(1/2) and sigma of
    targets, see `uncertainty`; which variables the data see (v,)."""
    response, seen = fit_response(J, root)
    return (response * sigma**2) @ response.T, seen


def fit_response(J: Array, root: Array) -> tuple[Array, Array]:
    """B = (J^T J)^-1 J^T W^(1/2) (v, n): d x / d q of the fitted coordinates by the targets; which
    variables the data determine (v,)."""
    inverse, seen = pseudo_inverse(J.T @ J)
    return inverse @ (J * root[:, None]).T, seen


def pseudo_inverse(information: Array) -> tuple[Array, Array]:
    """Pseudo-inverse, and which variables the data see (v,)."""
    values, vectors = np.linalg.eigh(information)
    blind = values <= 1e-14 * max(values[-1], 1e-300)
    seen = (vectors[:, blind] ** 2).sum(1) <= 1e-8
    kept = vectors[:, ~blind]
    return (kept / values[~blind]) @ kept.T, seen
