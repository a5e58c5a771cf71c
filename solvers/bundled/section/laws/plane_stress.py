"""A law in a membrane, whose surfaces bear no stress: the column d of F across it is free,

    W2(z) = min over d of W(z, d),   A2 = A_zz - A_zd A_dd^-1 A_dz

with p and q the columns of F along and around: a row z of 6 numbers is p, then q; A: second
derivatives of W.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from ....errors import Inverted
from .energy_law import EnergyLaw
from .hyperelastic import Hyperelastic

Array = np.ndarray
MAX_THICKNESS_STEPS = 40  # of Newton's method for d
STRESS_SETTLED = 1e-13  # stress across the membrane over the bulk modulus, at which it ends
MIN_AREA_RATIO = 0.2  # over the reference area


@dataclass(frozen=True)
class PlaneStress(EnergyLaw):
    """The law of a volume, per volume of the membrane."""

    weighted_tangent: ClassVar[bool] = True

    bulk: Hyperelastic  # the volume's law

    def _gradient(self, z: Array) -> Array:
        """F (p, 9), row by row, without stress across the membrane. Raises Inverted."""
        static = replace(self.bulk, shear_ratio=None, bulk_ratio=None)  # not a vibration's moduli
        p, q = z[:, :3], z[:, 3:]
        normal = np.cross(p, q)
        d = normal / (normal * normal).sum(-1, keepdims=True)  # J = 1 to begin with
        size = np.max(np.abs(static.bulk_over_shear * static.shear_modulus))
        for _ in range(MAX_THICKNESS_STEPS):
            F = np.stack([p, q, d], -1).reshape(-1, 9)
            across = static.force(F).reshape(-1, 3, 3)[:, :, 2]
            stiffness = static.tangent(F).reshape(-1, 3, 3, 3, 3)[:, :, 2, :, 2]
            d = d - np.linalg.solve(stiffness, across[..., None])[..., 0]
            if not np.isfinite(d).all():
                raise Inverted
            if np.abs(across).max() < STRESS_SETTLED * size:  # and the last step settles a tangent
                return np.stack([p, q, d], -1).reshape(-1, 9)
        raise Inverted

    def energy(self, z: Array) -> Array:
        return self.bulk.energy(self._gradient(z))

    def force(self, z: Array) -> Array:
        P = self.bulk.force(self._gradient(z)).reshape(-1, 3, 3)
        return np.concatenate([P[:, :, 0], P[:, :, 1]], 1)

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        A = self.bulk.tangent(self._gradient(z), weights).reshape(-1, 3, 3, 3, 3)
        A = A.transpose(0, 2, 1, 4, 3).reshape(-1, 9, 9)  # column by column
        within, mixed, across = A[:, :6, :6], A[:, 6:, :6], A[:, 6:, 6:]
        return np.asarray(within - mixed.swapaxes(1, 2) @ np.linalg.solve(across, mixed))

    def bears(self, z: Array) -> bool:
        normal = np.cross(z[:, :3].real, z[:, 3:].real)
        return bool((normal * normal).sum(-1).min() > MIN_AREA_RATIO**2)

    def stiffened(self, factor: float) -> Self:
        return replace(self, bulk=self.bulk.stiffened(factor))

    def eased(self, ratio: float) -> Self:
        return replace(self, bulk=self.bulk.eased(ratio))

    def at_stations(self, points: int, stations: int) -> Self:
        return replace(self, bulk=self.bulk.at_stations(points, stations))

    def blended(self, other: Any, share: Array) -> Self:
        return replace(self, bulk=self.bulk.blended(other.bulk, share))
