"""Where a pressed tyre touches the road: its tread as a grid of lines round and across it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from contourpy import contour_generator

from ..simulate.evaluate.pressed import Footprint, Pressed
from ..tyre.section.mesh import SectionMesh

Array = np.ndarray
FINE_STEPS = 8  # of an element of three nodes, between which its depth is a parabola


@dataclass(frozen=True)
class Patch:
    """The outer surface seen from the road, (ring, node across): rings in the direction of rolling
    with the patch's middle amid them, nodes from -z to +z."""

    along: Array  # m in the road's plane, towards larger angles of the rings
    across: Array  # m in the road's plane, towards +z
    pressure: Array  # Pa, 0 where it does not touch
    touches: Array  # bool
    # m, of nodes below the road, by a solver that places the patch's edge between nodes, else None
    depth: Array | None = None
    # whether every second node across is the middle of an element, as every second ring is
    midside: bool = False

    @property
    def length_m(self) -> float:
        """Extent along; it ends half-way between the last node that touches and the next."""
        return _extent(self.along, self.touches)

    @property
    def width_m(self) -> float:
        """Extent across, likewise."""
        return _extent(self.across.T, self.touches.T)

    def edges(self) -> list[Array]:
        """The patch's edge as closed lines (points, 2), across and along in m: where the depth is
        0, or half-way between nodes that touch and the next."""
        touching = [self.across, self.along, np.where(self.touches, 1.0, -1.0)]
        if self.depth is None:
            return _zero_lines(touching)
        fields = [_refined(field) for field in (self.across, self.along, self.depth)]
        if self.midside:
            fields = [_refined(field.T).T for field in fields]
        return _zero_lines(fields) or _zero_lines(touching)


def patch_of(pressed: Pressed, footprint: Footprint, mesh: SectionMesh) -> Patch:
    """The patch at one load on the section's mesh; the angle 0 is below the axle."""
    order = np.argsort((pressed.angles + np.pi) % (2 * np.pi))
    row = {int(node): i for i, node in enumerate(pressed.nodes)}
    line = [row[node] for node in mesh.outer_nodes]
    R, Z = pressed.points[line].T
    angle = pressed.angles[:, None]
    u_r, u_theta, u_z = np.moveaxis(footprint.displacement[:, line], -1, 0)
    along = np.sin(angle) * (R + u_r) + np.cos(angle) * u_theta
    down = np.cos(angle) * (R + u_r) - np.sin(angle) * u_theta
    pressure = np.zeros((len(pressed.angles), len(pressed.nodes)))
    touches = np.zeros(pressure.shape, bool)
    rows = [row[int(node)] for node in footprint.node]
    pressure[footprint.ring, rows], touches[footprint.ring, rows] = footprint.pressure_Pa, True
    depth = (down - (pressed.free_radius_m - footprint.deflection_m))[order]
    return Patch(
        along[order],
        (Z + u_z)[order],
        pressure[:, line][order],
        touches[:, line][order],
        None if footprint.contact_length_m is None else depth,
        mesh.quadratic,
    )


def _extent(place: Array, touches: Array) -> float:
    """Largest less least of the half-way places beside touching rows of a grid."""
    between = (place[:-1] + place[1:]) / 2
    below, above = np.concatenate([place[:1], between]), np.concatenate([between, place[-1:]])
    return float(above[touches].max() - below[touches].min())


def _refined(field: Array) -> Array:
    """A field (ring, ...) on `FINE_STEPS` steps of each three rings, as a parabola through them."""
    xi = np.linspace(-1.0, 1.0, FINE_STEPS, endpoint=False)[:, None]
    a, b, c = (each[:, None] for each in (field[:-2:2], field[1:-1:2], field[2::2]))
    within = b + xi * (c - a) / 2 + xi**2 * (a - 2 * b + c) / 2
    return np.concatenate([within.reshape(-1, field.shape[1]), field[-1:]])


def _zero_lines(fields: Sequence[Array]) -> list[Array]:
    """Lines (points, 2), in the first two of three fields, where the last is 0."""
    contours: Any = contour_generator(*fields)
    return [np.asarray(line) for line in contours.lines(0.0)]
