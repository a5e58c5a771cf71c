"""Rows z of a part at Gauss points, linear in the displacements: z = z0 + B0 u + B1 du/dTheta."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Rows:
    """z at Gauss points of elements of one kind."""

    B0: Array  # (e, g, k, 3a)
    hoop: Array  # (e, g, a): B1 (e, g, 3, 3a) is this on its three diagonals
    around: slice  # the three of the k rows that B1 has
    rest: Array  # z0, (k,) or (e, g, k)
    weights: Array  # (e, g): of the integral per radian

    @cached_property
    def B1(self) -> Array:
        """What du/dTheta adds to the rows ``around``."""
        return on_diagonals(self.hoop)


def on_diagonals(values: Array) -> Array:
    """Rows (e, g, 3, 3a), each component of u times ``values`` (e, g, a)."""
    e, g, a = values.shape
    rows = np.zeros((e, g, 3, a, 3), values.dtype)
    for i in range(3):
        rows[:, :, i, :, i] = values
    return rows.reshape(e, g, 3, 3 * a)
