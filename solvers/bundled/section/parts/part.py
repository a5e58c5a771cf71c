"""What every part of the tyre has: energy, force, tangents, mass and form, and the same in 3-D.

All that a step, a vibration or a slope needs of the tyre is a sum over its parts. State U (n, 3)
in m: displacements in the frame of the reference angle (see `elements`); energies per radian.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

from .mode_shapes import ModeShapes

Array = np.ndarray
Precision = type[np.floating[Any]]
Tangents = tuple[Array, Array | None, Array | None]


class TyrePart(ABC):
    """Rubber, cords, a pressure, ...; a new one is a subclass, or an `elastic.Elastic`."""

    connectivity: Array  # (e, a): nodes of each element
    mass: Array | None = None  # (e, a, a): consistent, kg per radian, of each component

    @abstractmethod
    def energy(self, U: Array) -> Any:
        """Its share of the potential, J."""

    @abstractmethod
    def force(self, U: Array) -> Array:
        """Gradient of the energy by the elements' displacements (e, 3a), N."""

    @abstractmethod
    def tangents(self, U: Array, harmonics: bool) -> Tangents:
        """K0, K1, K2 (e, 3a, 3a) of K(n) = K0 + i n K1 + n^2 K2; None where one is zero or, but
        for K0, not asked for."""

    @abstractmethod
    def at_stations(self, nodes: int) -> AtStations:
        """The part in three dimensions, in a section of so many nodes."""

    def growing(self, table: int) -> TyrePart | None:
        """What grows of its stiffness with the modulus table of that place; None: nothing."""
        return None

    def form(self, U: Array, fields: ModeShapes) -> Array:
        """phi^H K phi (m,) of the modes phi. K0 and K2 are symmetric, K1 antisymmetric, so that
        (a - i b)^T K(n) (a + i b) = a.K0 a + b.K0 b + n^2 (a.K2 a + b.K2 b) + 2 n b.K1 a."""
        K0, K1, K2 = self.tangents(U, True)
        a, b = (
            np.moveaxis(part[:, self.connectivity].reshape(len(fields.n), *K0.shape[:2]), 0, -1)
            for part in (fields.real, fields.imag)
        )
        n = fields.n

        def form(left: Array, K: Array, right: Array) -> Array:
            return np.asarray((left * (K @ right)).sum((0, 1)))

        total = form(a, K0, a) + form(b, K0, b) + 0j
        if K1 is not None:
            total += 2 * n * form(b, K1, a)
        if K2 is not None:
            total += n * n * (form(a, K2, a) + form(b, K2, b))
        return fields.summed(total)


class AtStations(ABC):
    """A part at Gauss stations s round the tyre, about the last state that `force` was given.

    u, du (3n, s): displacements and their derivative by the angle at the stations.
    """

    def __init__(self, connectivity: Array, nodes: int):
        self.connectivity = connectivity
        self.dofs = (3 * connectivity[..., None] + np.arange(3)).reshape(len(connectivity), -1)
        size = self.dofs.size
        ones = (np.ones(size), (self.dofs.ravel(), np.arange(size)))
        self._assembly = csr_matrix(ones, shape=(3 * nodes, size))

    def gather(self, forces: Array) -> Array:
        """Sums (3n, s) at the nodes of the elements' forces (e, 3a, s)."""
        return np.asarray(self._assembly @ forces.reshape(self.dofs.size, -1))

    @abstractmethod
    def force(self, u: Array, du: Array) -> tuple[Array, Array]:
        """Gradients of the energy by u and by du (e, 3a, s). Raises Inverted."""

    @abstractmethod
    def energy(self) -> Array:
        """(s,), J per radian."""

    @abstractmethod
    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        """Change of the forces with small u and du."""

    @abstractmethod
    def tangents(self, precision: Precision) -> tuple[Array, Array, Array]:
        """Second derivatives by u u, u du and du du (s, e, 3a, 3a)."""


def of_each_component(M: Array, components: Array) -> Array:
    """Matrices (e, a, a) of scalars as (e, 3a, 3a), coupled by ``components`` (3, 3)."""
    e, a, _ = M.shape
    return np.einsum("eab,ij->eaibj", M, components).reshape(e, 3 * a, 3 * a)


def consistent_mass(N: Array, weights: Array) -> Array:
    """Element masses (e, a, a) from N (g, a) and weights (e, g), kg per radian."""
    return np.tensordot(weights, N[:, :, None] * N[:, None, :], 1)
