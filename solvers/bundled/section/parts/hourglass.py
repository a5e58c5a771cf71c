"""Control of the patterns that one Gauss point does not see (Flanagan and Belytschko, 1981).

W = k / 2 (gamma . u_i)^2 per radian, for each component i of the displacements,   k = 0.005 G

gamma (m^0.5) are the hourglass vectors of `elements.Solids`, u_i (a,) of an element's nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..elements import Solids
from ..laws.energy_law import EnergyLaw
from .elastic import Elastic
from .part import Rows, on_diagonals

Array = np.ndarray
SHARE_OF_SHEAR_MODULUS = 0.005  # the hourglass stiffness where a deck states none


@dataclass(frozen=True)
class Hourglass(EnergyLaw):
    """Springs between the nodes of an element."""

    stiffness: Array  # (e,), Pa

    def energy(self, z: Array) -> Array:
        return np.asarray(self.stiffness * (z**2).sum(1)) / 2

    def force(self, z: Array) -> Array:
        return self.stiffness[:, None] * z

    def tangent(self, z: Array, weights: Array | float = 1.0) -> Array:
        return (self.stiffness * weights)[:, None, None] * np.eye(3)

    def blended(self, other: Hourglass, share: Array) -> Hourglass:
        return self


def control(solids: Solids, stiffness: Array) -> Elastic:
    """The hourglass control of one-point elements; stiffness (e,): k."""
    assert solids.hourglass is not None
    gamma = solids.hourglass[:, None]
    ones = np.ones(gamma.shape[:2])
    rows = Rows(
        on_diagonals(gamma), 0 * gamma.real, around=slice(0, 3), rest=np.zeros(3), weights=ones
    )
    return Elastic(solids.connectivity, rows, Hourglass(stiffness))
