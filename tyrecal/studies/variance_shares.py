"""Sobol' shares of the variance of frequencies over an emulator's box, without any sampling.

All coordinates x (logarithms of the variables; of linear ones, the value) are independent and
uniform over the box. Legendre's products P_k are orthogonal there, so with the mean square

    n_k = 1 / ((2 k1 + 1) (2 k2 + 1) ...)

of each, the variance of ln f is V = sum over k != 0 of a_k^2 n_k. The first-order share of x_i is
the part of V in the products of x_i alone, its total share the part in all products with x_i
(Sudret 2008). The two [0, 0] modes are no polynomials (see `emulator`): theirs are integrated on a
grid of Gauss points.
"""

from __future__ import annotations

import numpy as np

from .emulator import Emulator

Array = np.ndarray
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
