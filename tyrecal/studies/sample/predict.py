"""Frequencies of the tyre whose variables were drawn, measured or not, and what their variance is
due to.

What the model is off by, its form and the constants that nobody calibrates, is common to rows: a
mode's form error is nearly the same at all pressures, a constant moves all of them. So what the
measured rows are off by tells of the others. Given x, both are normal (Rasmussen and Williams,
Gaussian Processes, eq. 2.19), with Sigma of the measured rows, K between the others and them, and
L of the others:

    E[ln f'] = eta'(x) + K Sigma^-1 (y - eta(x)),    var[ln f'] = L - K Sigma^-1 K^T

These are the tyre's own frequencies: another measurement adds its scatter.

Sobol' shares of the variance over an emulator's box need no sampling: all coordinates x (logarithms
of the variables; of linear ones, the value) are independent and uniform over the box. Legendre's
products P_k are orthogonal there, so with the mean square

    n_k = 1 / ((2 k1 + 1) (2 k2 + 1) ...)

of each, the variance of ln f is V = sum over k != 0 of a_k^2 n_k. The first-order share of x_i is
the part of V in the products of x_i alone, its total share the part in all products with x_i
(Sudret 2008). The two [0, 0] modes are no polynomials (see `emulator`): theirs are integrated on a
grid of Gauss points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..emulator import Emulator
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


MAX_ALL_GAUSS = 200_000  # of all Gauss points, at most
MIN_GAUSS, MAX_GAUSS = 3, 24  # points of a coordinate


def variance_shares(emulator: Emulator) -> tuple[Array, Array, Array]:
    """First-order shares (n, v), total shares (n, v) and variances of ln f (n,) of the labels, by
    the coordinates; shares are 0 where nothing varies."""
    norm = 1 / np.prod(2 * emulator.degrees + 1, axis=1)
    # (n, k) parts of the variance; the last column is the distance of the two [0, 0]
    part = emulator.coefficients[:, :-1].T ** 2 * norm
    active = emulator.degrees > 0  # (k, v)
    alone = active & (active.sum(1) == 1)[:, None]
    variance = part @ active.any(1)
    first, total = part @ alone, part @ active
    if emulator.pair is not None:
        for place in emulator.pair:
            first[place], total[place], variance[place] = _on_a_grid(emulator, place)
    scale = np.where(variance > 0, variance, np.inf)[:, None]
    return first / scale, total / scale, variance


def _on_a_grid(emulator: Emulator, place: int) -> tuple[Array, Array, float]:
    """Parts (v,) of one label's variance: of the mean at each value of a coordinate, and the mean
    of the variance over a coordinate alone; and the variance."""
    v = len(emulator.half)
    count = int(np.clip(MAX_ALL_GAUSS ** (1 / v), MIN_GAUSS, MAX_GAUSS))
    t, weight = np.polynomial.legendre.leggauss(count)
    grid = np.stack(np.meshgrid(*[t] * v, indexing="ij"), -1).reshape(-1, v)
    y = emulator.ln_f(emulator.centre + emulator.half * grid)[:, place].reshape([count] * v)

    def mean(values: Array, axes: range | list[int]) -> Array:
        for axis in sorted(axes, reverse=True):
            values = np.tensordot(values, weight / 2, (axis, 0))
        return values

    y = y - mean(y, range(v))
    others = [[j for j in range(v) if j != i] for i in range(v)]
    first = [mean(mean(y, others[i]) ** 2, range(1)) for i in range(v)]
    total = [mean(mean(y**2, [i]) - mean(y, [i]) ** 2, range(v - 1)) for i in range(v)]
    return np.array(first), np.array(total), float(mean(y**2, range(v)))
