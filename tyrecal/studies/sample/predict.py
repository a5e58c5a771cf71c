"""Frequencies that were measured, and that were not, of the tyre whose variables were drawn.

What the model is off by, its form and the constants that nobody calibrates, is common to rows: a
mode's form error is nearly the same at all pressures, a constant moves all of them. So what the
measured rows are off by tells of the others. Given x, both are normal (Rasmussen and Williams,
Gaussian Processes, eq. 2.19), with Sigma of the measured rows, K between the others and them, and
L of the others:

    E[ln f'] = eta'(x) + K Sigma^-1 (y - eta(x)),    var[ln f'] = L - K Sigma^-1 K^T

These are the tyre's own frequencies: another measurement adds its scatter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..inference.covariance import model_form
from ..inference.observations import Observable

Array = np.ndarray


@dataclass(frozen=True)
class Conditional:
    """Distribution of m unmeasured rows, given n measured ones."""

    pull: Array  # (m, n) K Sigma^-1: shift of their mean by the residuals of the measured rows
    covariance: Array  # (m, m) that is left

    def drawn(self, other: Array, off: Array, seed: int) -> Array:
        """ln f' (p, m) from eta' (p, m) and y - eta (p, n) of the same draws."""
        random = np.random.default_rng([seed, 1])
        values, vectors = np.linalg.eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(other + off @ self.pull.T + random.normal(size=other.shape) @ root.T)

    def sigma(self, J: Array, other: Array, covariance: Array) -> Array:
        """Standard deviations (m,) of ln f', linearised: J (n, v) and J' (m, v) about the optimum,
        whose linear covariance is (v, v)."""
        rest = other - self.pull @ J
        variance = np.einsum("iv,vw,iw->i", rest, covariance, rest) + np.diag(self.covariance)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def conditional(
    measured: tuple[Observable, ...],
    sigma: Array,
    constants: Array,
    others: tuple[Observable, ...],
    other_constants: Array,
    laws: float,
) -> Conditional:
    """sigma (n, n): of the measured rows; constants (n, k), other_constants (m, k): changes of ln f
    by one standard deviation of each source; laws: see `model_form`."""
    every, n = measured + others, len(measured)
    g = np.vstack([constants, other_constants])
    common = model_form(every, laws) + g @ g.T
    pull = np.linalg.solve(sigma, common[:n, n:]).T
    return Conditional(pull, common[n:, n:] - pull @ common[:n, n:])
