"""Modes as the slopes of eigenvalues need them: real and imaginary parts, products of gradients."""

from __future__ import annotations

import copy

import numpy as np

from .rows import Rows

Array = np.ndarray


class ModeShapes:
    """Modes as sums of shapes a + i b of harmonics n.

    modes: per mode n (p,), a and b (p, nodes, 3) of the p shapes that it is the sum of.
    """

    def __init__(self, n: Array, shapes: Array, owner: Array | None = None):
        """``owner`` (p,): the mode, from 0 on, that each of the shapes is part of; None: each is a
        mode."""
        self.n, self.shapes = n, shapes
        self._owner = np.arange(len(n)) if owner is None else owner
        self._set(shapes.real, shapes.imag)

    def _set(self, real: Array, imag: Array) -> None:
        self.complex = np.iscomplexobj(real)  # they carry a variable's tangent
        self.real, self.imag = real, imag  # a and b (p, nodes, 3) of all shapes
        own = [self._owner == j for j in range(self._owner.max() + 1)]
        self.modes = [(self.n[mine], real[mine], imag[mine]) for mine in own]
        self.known: list[tuple[Rows, Array]] = []

    def replaced(self, real: Array, imag: Array) -> ModeShapes:
        """The same sums of other shapes."""
        other = copy.copy(self)
        other._set(real, imag)
        return other

    def summed(self, values: Array) -> Array:
        """Per mode (m, ...) the sum of its shapes' values (p, ...)."""
        total = np.zeros((len(self.modes), *values.shape[1:]), values.dtype)
        np.add.at(total, self._owner, values)
        return total

    def products(self, connectivity: Array, rows: Rows) -> Array:
        """G (m, e, g, k, k), sum of z z^T over a mode's shapes, real and imaginary: the form
        phi^H K phi is A : G. Rows without a tangent are all variables': G is remembered."""
        for own, G in self.known:
            same = own.B0 is rows.B0 or np.array_equal(own.B0, rows.B0)
            if same and (own.hoop is rows.hoop or np.array_equal(own.hoop, rows.hoop)):
                return G
        kind = np.result_type(rows.B0, rows.hoop, self.modes[0][1])
        G = np.empty((len(self.modes), *rows.B0.shape[:3], rows.B0.shape[2]), kind)
        for j, (n, a, b) in enumerate(self.modes):
            z = np.concatenate(_gradients(connectivity, rows, a, b, n), -1)
            np.matmul(z, z.swapaxes(-1, -2), out=G[j])
        if not np.iscomplexobj(G):
            self.known.append((rows, G))
        return G


def contract(A: Array, G: Array) -> Array:
    """sum over Gauss points of A : G per mode; A (e, g, k, k), G (m, e, g, k, k)."""
    G, A = G.reshape(len(G), -1), A.reshape(-1)
    if np.iscomplexobj(G):
        return np.asarray(G @ A)
    return np.asarray(G @ A.real + 1j * (G @ A.imag))


def _gradients(
    connectivity: Array, rows: Rows, real: Array, imag: Array, n: Array
) -> tuple[Array, Array]:
    """Real and imaginary part of (B0 + i n B1)(a + i b), each (e, g, k, p)."""
    e, g, k, d = rows.B0.shape
    B = rows.B0.reshape(e, g * k, d)
    z, around = [], []
    for part in (real, imag):
        u = np.moveaxis(part[:, connectivity], 0, -1)  # (e, a, 3, p)
        z.append((B @ u.reshape(e, d, -1)).reshape(e, g, k, -1))
        around.append(np.einsum("ega,eaip->egip", rows.hoop, u) * n)
    z[0][:, :, rows.around] -= around[1]
    z[1][:, :, rows.around] += around[0]
    return z[0], z[1]
