"""The tyre in three dimensions: residual, tangent product and tangents at Gauss stations.

A state U (k, n, 3), m, has coefficients of k functions of the angle (`Circumference`) at n nodes of
the section. At each of s Gauss stations round the tyre, the operators of the section act on the
displacement u there and its derivative by the angle:

    F = 1 + B0 u + B1 du/dTheta,   q = q0 + b0 u + b1 du/dTheta

F: deformation gradient of rubber; q: deformed vector along a cord, of length 1 before (q0). In the
shapes below, e is the number of elements of a part and a the number of nodes of one element.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..section.model import Model
from ..section.parts.part import Precision, TyrePart
from .circumference import Circumference

Array = np.ndarray
Tangents = tuple[Array, Array, Array, Array]  # connectivity (e, a), three of (s, e, 3a, 3a)


class Revolved:
    """Forces, energy and tangents, about the state that `residual` was last given, of the angles
    that ``around`` covers: of half the tyre with a `HalfCircle`."""

    def __init__(self, model: Model, loads: Sequence[TyrePart], around: Circumference):
        self.model, self.loads, self.around = model, loads, around
        nodes = len(model.mesh.X)
        self.parts = [part.at_stations(nodes) for part in (*model.parts, *loads)]

    def _stations(self, U: Array) -> tuple[Array, Array]:
        """Displacements (3n, s) at the stations, and their derivatives by the angle."""
        flat = U.reshape(len(U), -1).T
        return flat @ self.around.N.T, flat @ self.around.slope.T

    def _nodes(self, forces: list[tuple[Array, Array]]) -> Array:
        """Nodal forces (k, n, 3) from the derivatives (e, 3a, s) of each part's energy by u and by
        du/dTheta."""
        by_u, by_du = (
            sum(part.gather(f) for part, f in zip(self.parts, each, strict=True))
            for each in zip(*forces, strict=True)
        )
        weights = self.around.weights[:, None]
        result = by_u @ (weights * self.around.N) + by_du @ (weights * self.around.slope)
        return np.ascontiguousarray(result.T).reshape(len(result.T), -1, 3)

    def residual(self, U: Array) -> Array:
        """Internal forces less those of the pressure (k, n, 3), N; U becomes the state.

        Raises Inverted.
        """
        self._U = U
        u, du = self._stations(U)
        return self._nodes([p.force(u, du) for p in self.parts])

    def potential(self) -> float:
        """Strain energy less the pressure's work at the state, J."""
        return sum(float(p.energy() @ self.around.weights) for p in self.parts)

    def product(self, V: Array) -> Array:
        """Tangent stiffness times V (k, n, 3), N."""
        u, du = self._stations(V)
        return self._nodes([p.product(u, du) for p in self.parts])

    def tangents(self, precision: Precision = np.float64) -> list[Tangents]:
        """For each part: connectivity (e, a), and second derivatives of its energy (s, e, 3a, 3a)
        by u u, u v and v v, v = du/dTheta."""
        return [(p.connectivity, *p.tangents(precision)) for p in self.parts]
