"""The centrifugal force of a tyre that turns: potential -Omega^2 M x^2 / 2, x being the
place in the wheel's plane, from the axle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .part import IN_PLANE, AtStations, Tangents, TyrePart, of_each_component

Array = np.ndarray


@dataclass(frozen=True)
class Spin(TyrePart):
    """The force on the mass of one other part."""

    connectivity: Array  # (e, a)
    coupled_mass: Array  # (e, a, a): the other part's mass, kg per radian
    R: Array  # (e, a): radius of its nodes, m
    spin2: complex | float  # square of the spin about the axle, rad2/s2

    def _place(self, U: Array) -> Array:
        """Deformed position (e, a, 3) in the plane of the wheel."""
        x = U[self.connectivity] @ IN_PLANE + np.zeros(1, self.R.dtype)
        x[..., 0] += self.R
        return x

    def energy(self, U: Array) -> Any:
        x = self._place(U)
        return -self.spin2 * np.einsum("eai,eab,ebi->", x, self.coupled_mass, x) / 2

    def force(self, U: Array) -> Array:
        force = -self.spin2 * self.coupled_mass @ self._place(U)
        return np.asarray(force.reshape(len(force), -1))

    def tangents(self, U: Array, harmonics: bool) -> Tangents:
        return of_each_component(-self.spin2 * self.coupled_mass, IN_PLANE), None, None

    def at_stations(self, nodes: int) -> AtStations:
        raise NotImplementedError("a turning tyre is honoured off the road and all round alike")


def spinning(parts: list[TyrePart], X: Array, spin2: complex | float) -> list[Spin]:
    """The centrifugal forces of parts that have mass; X (n, 2): R, Z of all nodes."""
    massive = [(p.connectivity, p.mass) for p in parts if p.mass is not None]
    return [Spin(c, mass, X[c, 0], spin2) for c, mass in massive]
