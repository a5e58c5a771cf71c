"""Parts that store an energy W(z) in rows that are linear in the displacements at Gauss points,

    z = z0 + B0 u + B1 du/dTheta.

Rubber's rows are the deformation gradient, a cord's its vector. With u exp(i n Theta) and A =
d2W/dzdz, summed over Gauss points, K(n) = K0 + i n K1 + n^2 K2 has

    K0 = B0^T A B0,   K1 = B0^T A B1 - transposed,   K2 = B1^T A B1

Rows may be complex, which is how slopes are formed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....errors import Inverted
from ..laws.energy_law import EnergyLaw
from .part import AtStations, ModeShapes, Precision, Rows, Tangents, TyrePart, contract, real_times

Array = np.ndarray


@dataclass(frozen=True)
class Elastic(TyrePart):
    """Elements of one kind with their rows, their law and their mass."""

    connectivity: Array  # (e, a) nodes of each element
    rows: Rows
    law: EnergyLaw
    mass: Array | None = None  # (e, a, a) consistent, kg per radian, of each component

    def at(self, U: Array) -> Array:
        """z (e * g, k)."""
        e, g, k, d = self.rows.B0.shape  # d = 3a
        u = U[self.connectivity].reshape(e, d, 1)
        z = real_times(self.rows.B0.reshape(e, g * k, d), u).reshape(e, g, k)
        return (z + self.rows.rest).reshape(e * g, k)

    def law_at(self, z: Array) -> EnergyLaw:
        """The law at the rows z of all points; `Hybrid`'s depends on them."""
        return self.law

    def energy(self, U: Array) -> Any:
        z = self.at(U)
        return (self.law_at(z).energy(z) * self.rows.weights.ravel()).sum()

    def force(self, U: Array) -> Array:
        e, g, k, d = self.rows.B0.shape
        z = self.at(U)
        P = self.law_at(z).force(z).reshape(e, g, k) * self.rows.weights[..., None]
        transposed = self.rows.B0.reshape(e, g * k, d).swapaxes(1, 2)
        return real_times(transposed, P.reshape(e, g * k, 1))[..., 0]

    def tangents(self, U: Array, harmonics: bool) -> Tangents:
        B0, B1, around = self.rows.B0, self.rows.B1, self.rows.around
        e, g, k, d = B0.shape
        A = self._tangent(U)
        transposed = B0.reshape(e, g * k, d).swapaxes(1, 2)
        K0 = transposed @ (A @ B0).reshape(e, g * k, d)
        if not harmonics:
            return K0, None, None
        AB1 = A[..., around] @ B1
        half = transposed @ AB1.reshape(e, g * k, d)
        K2 = B1.reshape(e, g * 3, d).swapaxes(1, 2) @ AB1[:, :, around].reshape(e, g * 3, d)
        return K0, half - half.swapaxes(1, 2), K2

    def _tangent(self, U: Array) -> Array:
        """A (e, g, k, k) times the weights."""
        e, g, k, _ = self.rows.B0.shape
        z = self.at(U)
        return self.law_at(z).tangent(z, self.rows.weights.ravel()).reshape(e, g, k, k)

    def form(self, U: Array, fields: ModeShapes) -> Array:
        return contract(self._tangent(U), fields.products(self.connectivity, self.rows))

    def frequency_dependent_part(self, table: int) -> TyrePart | None:
        law = self.law.frequency_dependent_part(table)
        return None if law is None else replace(self, law=law)

    def material_part(self, compound: int, modulus: int) -> TyrePart | None:
        law = self.law.material_part(compound, modulus)
        return None if law is None else replace(self, law=law)

    def at_stations(self, nodes: int) -> AtStations:
        return ElasticAtStations(self, nodes)


class ElasticAtStations(AtStations):
    """The rows at every station: z (e, g, s, k)."""

    def __init__(self, part: Elastic, nodes: int):
        super().__init__(part.connectivity, nodes)
        self.rows, self._law = part.rows, part.law
        self.e, self.g, self.k, self.d = self.rows.B0.shape
        self.B0 = self.rows.B0.reshape(self.e, self.g * self.k, self.d)
        self.B1 = self.rows.B1.reshape(self.e, self.g * 3, self.d)
        self._A: Array | None = None

    def _change(self, u: Array, du: Array) -> Array:
        """B0 u + B1 du (e, g, s, k)."""
        z = (self.B0 @ u[self.dofs]).reshape(self.e, self.g, self.k, -1)
        z[:, :, self.rows.around] += (self.B1 @ du[self.dofs]).reshape(self.e, self.g, 3, -1)
        return z.swapaxes(2, 3)

    def _forces(self, P: Array) -> tuple[Array, Array]:
        """Forces from dW/dz times weights (e, g, s, k)."""
        P = np.ascontiguousarray(P.swapaxes(2, 3))  # copied once for both products
        by_u = self.B0.swapaxes(1, 2) @ P.reshape(self.e, self.g * self.k, -1)
        P = P[:, :, self.rows.around]
        return by_u, self.B1.swapaxes(1, 2) @ P.reshape(self.e, self.g * 3, -1)

    def force(self, u: Array, du: Array) -> tuple[Array, Array]:
        z = self._change(u, du) + (
            self.rows.rest if self.rows.rest.ndim == 1 else self.rows.rest[:, :, None]
        )
        self.z, self._A = z.reshape(-1, self.k), None
        self.law = self.law_at(self._law.at_stations(self.e * self.g, z.shape[2]))
        if not self.law.bears(self.z):
            raise Inverted
        return self._forces(self.law.force(self.z).reshape(z.shape) * self._weights)

    def law_at(self, law: EnergyLaw) -> EnergyLaw:
        """The law of all points at the rows ``z``."""
        return law

    @property
    def _weights(self) -> Array:
        return self.rows.weights[..., None, None]

    def energy(self) -> Array:
        W = self.law.energy(self.z).reshape(self.e, self.g, -1)
        return np.asarray((W * self._weights[..., 0]).sum((0, 1)))

    @property
    def A(self) -> Array:
        """d2W/dzdz (e, g, s, k, k), times the weights where the law does that."""
        if self._A is None:
            stations = len(self.z) // (self.e * self.g)
            weights = np.repeat(self.rows.weights.ravel(), stations)
            A = self.law.tangent(self.z, weights if self.law.weighted_tangent else 1.0)
            self._A = A.reshape(self.e, self.g, stations, self.k, self.k)
        return self._A

    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        P = (self.A @ self._change(u, du)[..., None])[..., 0]
        return self._forces(P if self.law.weighted_tangent else P * self._weights)

    def tangents(self, precision: Precision) -> tuple[Array, Array, Array]:
        A = self.A if self.law.weighted_tangent else self.A * self._weights[..., None]
        s, e, g, k, d = A.shape[2], self.e, self.g, self.k, self.d
        # (e, g, k, s, k): all stations of a point in one product
        A = np.ascontiguousarray(A.swapaxes(2, 3), dtype=precision)
        B0, B1 = self.rows.B0.astype(precision), self.rows.B1.astype(precision)
        B0t, B1t = B0.reshape(e, g * k, d).swapaxes(1, 2), B1.reshape(e, g * 3, d).swapaxes(1, 2)
        AB0 = A.reshape(e, g, k * s, k) @ B0
        AB1 = A[..., self.rows.around].reshape(e, g, k * s, 3) @ B1
        of_B1 = AB1.reshape(e, g, k, s * d)[:, :, self.rows.around]
        K0 = B0t @ AB0.reshape(e, g * k, s * d)
        K1 = B0t @ AB1.reshape(e, g * k, s * d)
        K2 = B1t @ of_B1.reshape(e, g * 3, s * d)
        at_stations = lambda K: K.reshape(e, d, s, d).transpose(2, 0, 1, 3)
        return at_stations(K0), at_stations(K1), at_stations(K2)
