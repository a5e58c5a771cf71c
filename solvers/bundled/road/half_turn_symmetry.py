"""A quarter of the tyre stands for the whole: half turns about the vertical (`section.symmetry`).

A tyre of mirror-symmetric section, pressed straight on the road, keeps (theta, z) -> (-theta, -z),
a half turn about the vertical, although its cords break both mirror symmetries. So fields live on
0 <= theta <= pi, and there are a sum of two parts on z >= 0,

    U(theta, z) = a + b,    U(theta, -z) = p S (a - b),    S = diag(1, 1, -1),

a even and b odd under theta -> -theta (u_theta the other way round); p = 1 for what the half turn
keeps, -1 for what it reverses. Only the cords' bias couples a with b.
"""

from __future__ import annotations

import numpy as np

from ...errors import Refused
from ..section.mesh import DeckMesh
from ..section.symmetry import MIRROR_SIGNS, SAME_PLACE, mirror_images

Array = np.ndarray


class HalfTurn:
    """Fields (k, n, 3) on half the circumference as parts (2, k, q, 3) on the nodes z >= 0.

    mesh; free (n, 3); angles k; parity p; ``other`` (n,): each node's mirror image.
    Raises Refused.
    """

    def __init__(self, mesh: DeckMesh, free: Array, angles: int, parity: int = 1):
        X = mesh.X.real
        other = mirror_images(X)
        if (other < 0).any() or (free != free[other]).any():
            raise Refused("the section or its supports differ between z and -z")
        self.other = other
        self.nodes = np.flatnonzero(X[:, 1] > -SAME_PLACE)
        self.beyond = other[self.nodes]
        self.parity, self.shape = parity, (angles, len(X), 3)
        middle = self.nodes == self.beyond
        self._middle = middle
        self.free = free
        mask = np.broadcast_to(free[self.nodes], (2, angles, len(self.nodes), 3)).copy()
        mask[0][[0, -1], :, 1] = False
        mask[1][[0, -1], :, 0::2] = False
        even = 0 if parity == 1 else 1  # which part is even in z
        mask[even][:, middle, 2] = False
        mask[1 - even][:, middle, :2] = False
        self.mask = mask

    def spread(self, parts: Array) -> Array:
        """The field of two parts (2, k, q, 3)."""
        U = np.empty(self.shape)
        U[:, self.beyond] = self.parity * MIRROR_SIGNS * (parts[0] - parts[1])
        U[:, self.nodes] = parts[0] + parts[1]  # nodes of the middle keep the sum
        return U

    def gather(self, F: Array) -> Array:
        """Its transpose: forces on the two parts, zero on what is held."""
        here, there = F[:, self.nodes], self.parity * MIRROR_SIGNS * F[:, self.beyond]
        there[:, self._middle] = 0.0
        return np.stack([here + there, here - there]) * self.mask

    def parts(self, U: Array) -> Array:
        """The two parts of a field that has the symmetry."""
        here, there = U[:, self.nodes], self.parity * MIRROR_SIGNS * U[:, self.beyond]
        return np.stack([here + there, here - there]) / 2

    def blocks(self, stiffness: Array) -> Array:
        """Of stiffness at single nodes (k, n, 3, 3), what acts on the parts (k, q, 6, 6)."""
        here = stiffness[:, self.nodes]
        there = stiffness[:, self.beyond] * np.multiply.outer(MIRROR_SIGNS, MIRROR_SIGNS)
        there[:, self._middle] = 0.0
        same, cross = here + there, here - there
        free = self.mask.transpose(1, 2, 0, 3).reshape(*same.shape[:2], 6)
        whole = np.block([[same, cross], [cross, same]])
        return np.asarray(whole * (free[..., :, None] & free[..., None, :]))
