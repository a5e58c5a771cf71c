"""A quarter of the tyre stands for the whole: half turns about the vertical (`section.symmetry`).

A tyre of mirror-symmetric section, pressed straight on the road, keeps (theta, z) -> (-theta, -z),
a half turn about the vertical, although its cords break both mirror symmetries. So fields live on
0 <= theta <= pi, and there are a sum of two parts on z >= 0,

    U(theta, z) = a + b,    U(theta, -z) = p S (a - b),    S = diag(1, 1, -1),

a even and b odd under theta -> -theta (u_theta the other way round); p = 1 for what the half turn
keeps, -1 for what it reverses. Only the cords' bias couples a with b. Of the functions round the
tyre (`HalfCircle`) each component of a part has the even or the odd ones.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from ...errors import Refused
from ..section.mesh import DeckMesh
from ..section.symmetry import HALF_TURN, MIRROR_SIGNS, SAME_PLACE, mirror_images
from ..solid3d.circumference import HalfCircle

Array = np.ndarray
SAME_ANGLE = 1e-9  # rad
ODD = np.array([[False, True, False], [True, False, True]])  # of a and b, under theta -> -theta


class HalfTurn:
    """Converts fields (k, n, 3) on half the circumference to two parts (2, f, q, 3) and back.

    The parts a and b live on the q nodes with z >= 0, and each has f of the k functions round the
    tyre ``around``. free (n, 3): components that are not held; parity: p; ``other`` (n,): mirror
    image of each node; ``mask`` (2, f, q, 3): entries of the parts that are free. Raises Refused.
    """

    def __init__(self, mesh: DeckMesh, free: Array, around: HalfCircle, parity: int = 1):
        X = mesh.X.real
        other = mirror_images(X)
        if (other < 0).any() or (free != free[other]).any():
            raise Refused("the section or its supports differ between z and -z")
        self.mesh, self.other, self.around = mesh, other, around
        self.nodes = np.flatnonzero(X[:, 1] > -SAME_PLACE)
        self.beyond = other[self.nodes]
        self.parity, self.shape = parity, (around.N.shape[1], len(X), 3)
        middle = self.nodes == self.beyond
        self._middle = middle
        self.free = free
        # rows of the k functions that a part's component has (part, component, f)
        self._rows = np.where(ODD[..., None], around.odd, around.even)
        mask = np.tile(free[self.nodes], (2, len(around.even), 1, 1))
        # functions at the angles 0 and pi, where what is odd is zero
        planes = np.flatnonzero(abs(np.sin(around.angles)) < SAME_ANGLE)
        for part, odd in zip(mask, ODD, strict=True):
            part[np.ix_(planes, np.arange(len(self.nodes)), odd)] = False
        even = 0 if parity == 1 else 1  # which part is even in z
        mask[even][:, middle, 2] = False
        mask[1 - even][:, middle, :2] = False
        self.mask = mask

    def of_parity(self, parity: int) -> HalfTurn:
        """The same of the fields that have this parity."""
        return HalfTurn(self.mesh, self.free, self.around, parity)

    def spread(self, parts: Array) -> Array:
        """The field of two parts (2, f, q, 3)."""
        U, here = np.empty(self.shape), np.zeros((self.shape[0], len(self.nodes), 3))
        there = here.copy()
        for component, (a, b) in enumerate(self._rows.swapaxes(0, 1)):
            here[a, :, component] = there[a, :, component] = parts[0, ..., component]
            here[b, :, component] += parts[1, ..., component]
            there[b, :, component] -= parts[1, ..., component]
        U[:, self.beyond] = self.parity * MIRROR_SIGNS * there
        U[:, self.nodes] = here  # nodes of the middle keep the sum
        return U

    def whole(self, U: Array, angles: Array) -> Array:
        """Values (2 a - 2, n, 3) of a field (k, n, 3) of one half at ``angles`` (a,), rad, which
        rise from 0 to pi, and of the other half beyond."""
        half = (self.around.at(angles) @ U.reshape(len(U), -1)).reshape(-1, *self.shape[1:])
        beyond = self.parity * HALF_TURN * half[1:-1, self.other]
        return np.concatenate([half, beyond[::-1]])

    def gather(self, F: Array) -> Array:
        """Transpose of `spread`: forces F (k, n, 3) on the two parts, zero on what is held."""
        here, there = F[:, self.nodes], self.parity * MIRROR_SIGNS * F[:, self.beyond]
        there[:, self._middle] = 0.0
        return self._both(here, there) * self.mask

    def parts(self, U: Array) -> Array:
        """The two parts of a field U (k, n, 3) that has the symmetry."""
        here, there = U[:, self.nodes], self.parity * MIRROR_SIGNS * U[:, self.beyond]
        return self._both(here, there) / 2

    def _both(self, here: Array, there: Array) -> Array:
        """The sum on the functions of a, the difference on those of b."""
        pair = (here + there, here - there)
        parts = np.empty(self.mask.shape)
        for part, values, rows in zip(parts, pair, self._rows, strict=True):
            for component, own in enumerate(rows):
                part[..., component] = values[own, :, component]
        return parts

    @cached_property
    def _spread(self) -> csr_matrix:
        """`spread` as a matrix (k n 3, 2 f q 3), held components zero."""
        k, n, _ = self.shape
        part, function, row, i = np.indices(self.mask.shape)
        ring = self._rows[part, i, function]
        here = (ring * n + self.nodes[row]) * 3 + i
        there = (ring * n + self.beyond[row]) * 3 + i
        sign = self.parity * MIRROR_SIGNS[i] * np.where(part, -1.0, 1.0) * ~self._middle[row]
        column = np.arange(here.size)
        mask = self.mask.ravel()
        values = np.concatenate([mask * 1.0, mask * sign.ravel()])
        places = np.concatenate([here.ravel(), there.ravel()]), np.tile(column, 2)
        return csr_matrix((values, places), shape=(k * n * 3, here.size))

    def fold(self, stiffness: csr_matrix) -> csr_matrix:
        """Fold a stiffness between fields (k n 3, k n 3) into one between the parts (2 f q 3, 2 f q
        3)."""
        return csr_matrix(self._spread.T @ stiffness @ self._spread)
