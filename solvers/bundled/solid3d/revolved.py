"""The tyre in three dimensions: residual, tangent product and station tangents.

State U (k, n, 3) in m at the angles of a `Circumference`; the section's operators serve at every
Gauss station with the station's displacement and its derivative by the angle:

    F = 1 + B0 u + B1 du/dTheta,   q = a + b0 u + hoop du/dTheta
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..section.model import Model
from ..section.parts.part import Precision, TyrePart
from .circumference import Circumference

Array = np.ndarray
Tangents = tuple[Array, Array, Array, Array]


class Revolved:
    """Mechanics about the last state that `residual` was given."""

    def __init__(self, model: Model, loads: Sequence[TyrePart], around: Circumference):
        self.model, self.loads, self.around = model, loads, around
        nodes = len(model.mesh.X)
        self.parts = [part.at_stations(nodes) for part in (*model.parts, *loads)]

    def _stations(self, U: Array) -> tuple[Array, Array]:
        """Displacement and its derivative by the angle at the stations (3n, s)."""
        flat = U.reshape(len(U), -1).T
        return flat @ self.around.N.T, flat @ self.around.slope.T

    def _nodes(self, forces: list[tuple[Array, Array]]) -> Array:
        """Nodal forces (k, n, 3) from each part's, by u and by du/dTheta (e, 3a, s)."""
        by_u, by_du = (
            sum(part.gather(f) for part, f in zip(self.parts, each, strict=True))
            for each in zip(*forces, strict=True)
        )
        weights = self.around.weights[:, None]
        result = by_u @ (weights * self.around.N) + by_du @ (weights * self.around.slope)
        return np.ascontiguousarray(result.T).reshape(len(result.T), -1, 3)

    def residual(self, U: Array) -> Array:
        """Internal force less that of the pressure (k, n, 3), N; the tangents follow U.

        Raises Inverted."""
        self._U = U
        u, du = self._stations(U)
        return self._nodes([p.force(u, du) for p in self.parts])

    def potential(self) -> float:
        """Strain energy less the pressure's work at the last state, J."""
        return sum(float(p.energy() @ self.around.weights) for p in self.parts)

    def product(self, V: Array) -> Array:
        """Tangent stiffness times V (k, n, 3), N."""
        u, du = self._stations(V)
        return self._nodes([p.product(u, du) for p in self.parts])

    def tangents(self, precision: Precision = np.float64) -> list[Tangents]:
        """Per part: connectivity; d2W/du du, du dv and dv dv, v = du/dTheta, (s, e, 3a, 3a)."""
        return [(p.connectivity, *p.tangents(precision)) for p in self.parts]
