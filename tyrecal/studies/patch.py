"""Where a pressed tyre touches the road: its tread as a grid of lines round and across it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..simulate.evaluate.pressed import Footprint, Pressed
from ..tyre.section.mesh import SectionMesh

Array = np.ndarray


@dataclass(frozen=True)
class Patch:
    """The outer surface seen from the road, (ring, node across): rings in the direction of rolling
    with the patch's middle amid them, nodes from -z to +z."""

    along: Array  # m in the road's plane
    across: Array  # m in the road's plane
    pressure: Array  # Pa, 0 where it does not touch
    touches: Array  # bool

    @property
    def length_m(self) -> float:
        """Extent along; it ends half-way between the last node that touches and the next."""
        return _extent(self.along, self.touches)

    @property
    def width_m(self) -> float:
        """Extent across, likewise."""
        return _extent(self.across.T, self.touches.T)


def patch_of(pressed: Pressed, footprint: Footprint, mesh: SectionMesh) -> Patch:
    """The patch at one load on the section's mesh."""
    order = np.argsort((pressed.angles + np.pi) % (2 * np.pi))
    row = {int(node): i for i, node in enumerate(pressed.nodes)}
    line = [row[node] for node in mesh.outer_nodes]
    R, Z = pressed.points[line].T
    angle = pressed.angles[:, None]
    u_r, u_theta, u_z = np.moveaxis(footprint.displacement[:, line], -1, 0)
    along = np.sin(angle) * (R + u_r) + np.cos(angle) * u_theta
    pressure = np.zeros((len(pressed.angles), len(pressed.nodes)))
    touches = np.zeros(pressure.shape, bool)
    rows = [row[int(node)] for node in footprint.node]
    pressure[footprint.ring, rows], touches[footprint.ring, rows] = footprint.pressure_Pa, True
    return Patch(along[order], (Z + u_z)[order], pressure[:, line][order], touches[:, line][order])


def _extent(place: Array, touches: Array) -> float:
    """Largest less least of the half-way places beside touching rows of a grid."""
    between = (place[:-1] + place[1:]) / 2
    below, above = np.concatenate([place[:1], between]), np.concatenate([between, place[-1:]])
    return float(above[touches].max() - below[touches].min())
