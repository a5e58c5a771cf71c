"""The contact patch at one load: its area, length and width, and what its nodes bear.

The edge lies where the tread is as deep as the road is high, between nodes. A node stands for what
the hat function round it covers of the patch: hats are linear from node to node, along and across,
and sum to 1, so the nodes' areas and forces sum to the patch's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..section.shapes import gauss
from .contact import Contact
from .tread import Points

Array = np.ndarray
WIDTH_SAMPLES = 5  # angles of a span at which the width is looked at


@dataclass(frozen=True)
class HalfPatch:
    """Contact patch of half the tyre, on rings k and nodes n; length and width are those of the
    whole patch."""

    area: Array  # (k, n): of the deformed tread, m2
    force: Array  # (k, n, 3): on the road, down, along, across, N
    length: float  # m
    width: float  # m


def patch(contact: Contact, X: Array, rings: Array) -> HalfPatch:
    """The patch of a contact, on nodes at the angles ``rings`` (k,), rad, from 0 on. X (n, 2): R, Z
    of the section, m."""
    tread, points = contact.road.tread, contact.points
    size = points.area * points.densities(contact.U)  # deformed area of each point, m2
    local = np.concatenate([contact.normal[..., None], contact.traction], -1)
    before = np.searchsorted(rings, points.angle, "right") - 1  # the ring before each point
    beyond = (points.angle - rings[before]) / (rings[before + 1] - rings[before])
    # the lines lie at Gauss points of the line elements
    across = _hats(gauss(len(tread.M), 1)[0], tread.nodes.shape[1])[:, None]  # (j, 1, a)
    nodes = tread.nodes[points.e][:, None, None]
    area, force = np.zeros((len(rings), len(X))), np.zeros((len(rings), len(X), 3))
    for ring, share in ((before, 1 - beyond), (before + 1, beyond)):
        hat = share[..., None] * across  # (i, j, p, a)
        np.add.at(area, (ring[..., None], nodes), hat * size[..., None])
        np.add.at(force, (ring[..., None], nodes), hat[..., None] * local[..., None, :])
    return HalfPatch(area, force, *_extent(contact, X))


def _hats(xi: Array, count: int) -> Array:
    """Values (j, count) at -1 <= xi <= 1 (j, 1) of hat functions between equally spaced nodes."""
    place = np.linspace(-1.0, 1.0, count)
    return np.maximum(1 - abs(xi - place) * (count - 1) / 2, 0.0)


def _extent(contact: Contact, X: Array) -> tuple[float, float]:
    """Length and width (m) of the whole tyre's patch, whose other half is this one's half turn."""
    tread, U, height = contact.road.tread.at_nodes(X), contact.U, contact.height
    t, e, first, last = tread.intervals(U, height)
    ends = Points(tread, t, e, last, last - first)
    along = ends.positions(U)[..., 1][ends.weight > 0]
    samples = tread.everywhere(np.linspace(0.0, 1.0, WIDTH_SAMPLES))
    at = samples.positions(U)
    over, z = at[..., 0] - height, at[..., 2]
    across = np.concatenate([abs(z[over > 0]), abs(_roots(over, z)).ravel()])
    return 2 * float(along.max(initial=0.0)), 2 * float(across.max(initial=0.0))


def _roots(over: Array, z: Array) -> Array:
    """z where the overclosure crosses zero on line elements, 0 where it does not; both (i, a, p) at
    their nodes: two or three, so that they are linear or quadratic between."""
    if over.shape[1] == 2:
        over, z = (np.stack([f[:, 0], f.mean(1), f[:, 1]], 1) for f in (over, z))
    # c + b xi + a xi^2 through three nodes; its roots are 2 c / steep and steep / (2 a)
    parabola = lambda f: (f[:, 1], (f[:, 2] - f[:, 0]) / 2, (f[:, 0] - 2 * f[:, 1] + f[:, 2]) / 2)
    c, b, a = parabola(over)
    steep = -b - np.copysign(np.sqrt(np.maximum(b * b - 4 * a * c, 0.0)), b)
    xi = np.stack(
        [
            np.divide(2 * c, steep, out=np.full_like(c, 2.0), where=steep != 0),
            np.divide(steep, 2 * a, out=np.full_like(c, 2.0), where=a != 0),
        ]
    )
    valid = (abs(xi) <= 1) & (b * b >= 4 * a * c)
    c, b, a = parabola(z)
    return np.where(valid, c + xi * (b + xi * a), 0.0)
