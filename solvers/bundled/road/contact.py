"""A rigid flat road under the tyre: unilateral contact and Coulomb friction at nodes.

The road's normal is the vertical at theta = 0, downwards; its distance from the axle is H. With
c = cos theta, s = sin theta of a node's reference angle its depth and its place in the road are

    d = c (R + u_r) - s u_theta,   x = s (R + u_r) + c u_theta,   z = Z + u_z

    pressure = k <d - H>,   traction = mu pressure min(|slip| / e, 1) slip / |slip|

with the overclosure's stiffness k and the elastic slip e; slip counts from where a node stood
when the last load had been reached, plus the elastic slip that it had then. A node that the road
was a gap g away from then, at H0, met it on its way to H, and slips from there on:

    slip = (1 - g / (H0 - H)) (x - x0)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..section.elements import Lines
from ..solid3d.circumference import Circumference

Array = np.ndarray
MAX_CONTACT_ANGLE = np.pi / 3  # from the vertical: no node beyond it can touch


@dataclass(frozen=True)
class FlatRoad:
    """Contact at nodes (k, c) of half the circumference."""

    nodes: Array  # (c,): rows of the section
    area: Array  # (k, c): reference area that a node stands for, m2
    frame: Array  # (k, 3, 3): to the road's down, along, across
    origin: Array  # (k, c, 3): reference positions in that frame, m
    stiffness: float  # Pa/m
    friction: float  # coefficient
    elastic_slip: float  # m
    anchor: Array  # (k, c, 2): where slip counts from, m
    gap: Array  # (k, c): to the road at the last load, 0 where it touched, m
    height: float  # of the road at the last load, m

    def positions(self, U: Array) -> Array:
        """Depth, and place in the road along and across (k, c, 3), m."""
        u = U[: len(self.area), self.nodes]
        return np.asarray(self.origin + np.einsum("kij,kcj->kci", self.frame, u))

    def share(self, height: float) -> tuple[Array, Array]:
        """Of a step to ``height``, what each node went on the road (k, c), and its slope, 1/m."""
        rise = max(self.height - height, 1e-12)
        met = self.gap < rise
        share = np.where(met, 1.0 - self.gap / rise, 0.0)
        return share, np.where(met, -self.gap / rise**2, 0.0)

    def forces(self, U: Array, height: float, bound: tuple[Array, Array] | None = None) -> Contact:
        """Forces and tangents at a state U (k, n, 3) with the road at ``height`` (m).

        ``bound``: normal forces (k, c) that limit the friction (Tresca) and shares of the step,
        instead of those of the state itself (Coulomb).
        """
        at = self.positions(U)
        overclosure = at[..., 0] - height
        touching = overclosure > 0
        normal = self.stiffness * self.area * np.where(touching, overclosure, 0.0)
        moved = at[..., 1:] - self.anchor
        share, growth = self.share(height) if bound is None else (bound[1], 0.0 * normal)
        slip = moved * share[..., None]
        length = np.maximum(np.linalg.norm(slip, axis=-1), 1e-300)
        e, sticking = self.elastic_slip, length <= self.elastic_slip
        along = slip / np.where(sticking, e, length)[..., None]
        pressed = normal if bound is None else bound[0]
        local = np.concatenate([normal[..., None], self.friction * pressed[..., None] * along], -1)
        K = np.zeros((*normal.shape, 3, 3))
        stiff = self.stiffness * self.area * touching
        K[..., 0, 0] = stiff
        if bound is None:
            K[..., 1:, 0] = self.friction * stiff[..., None] * along
        reach = self.friction * pressed / np.where(sticking, e, length)
        by_slip = reach[..., None, None] * np.eye(2)
        sliding = np.where(sticking, 0.0, reach)[..., None, None]
        by_slip -= sliding * along[..., :, None] * along[..., None, :]
        K[..., 1:, 1:] = by_slip * share[..., None, None]
        by_height = -K[..., 0]
        by_height[..., 1:] += np.einsum("kcij,kcj->kci", by_slip, moved) * growth[..., None]
        overlap = (self.stiffness * self.area * np.maximum(overclosure, 0.0) ** 2).sum() / 2
        path = np.where(sticking, length**2 / (2 * e), length - e / 2)
        path = np.divide(path, share, out=np.zeros_like(path), where=share > 0)
        energy = float(overlap + self.friction * (pressed * path).sum())
        return Contact(self, height, at, local, K, by_height, energy)

    def settled(self, contact: Contact) -> FlatRoad:
        """The road after a load was reached: slip counts anew, less the elastic one."""
        share, _ = self.share(contact.height)
        slip = (contact.positions[..., 1:] - self.anchor) * share[..., None]
        length = np.maximum(np.linalg.norm(slip, axis=-1, keepdims=True), 1e-300)
        elastic = slip * np.minimum(self.elastic_slip / length, 1.0)
        gap = np.maximum(contact.height - contact.positions[..., 0], 0.0)
        elastic *= (gap == 0.0)[..., None]
        anchor = contact.positions[..., 1:] - elastic
        return replace(self, anchor=anchor, gap=gap, height=contact.height)


@dataclass(frozen=True)
class Contact:
    """Forces of half the tyre on the road, in the road's frame: down, along, across."""

    road: FlatRoad
    height: float
    positions: Array
    local: Array  # (k, c, 3), N
    K: Array  # (k, c, 3, 3): derivatives by the nodes' positions, N/m
    by_height: Array  # (k, c, 3): and by the road's height, N/m
    energy: float  # J, stored and dissipated: the potential where the friction is bounded

    @property
    def force(self) -> float:
        """Vertical force of the whole tyre, N."""
        return 2 * float(self.local[..., 0].sum())

    def nodal(self, shape: tuple[int, ...], local: Array | None = None) -> Array:
        """Forces on the road as a field (k, n, 3) in the frame of the reference angle."""
        field = np.zeros(shape)
        turned = np.einsum("kij,kci->kcj", self.road.frame, self.local if local is None else local)
        field[: len(turned), self.road.nodes] = turned
        return field

    def product(self, V: Array) -> Array:
        """Tangent times a field (k, n, 3)."""
        v = np.einsum("kij,kcj->kci", self.road.frame, V[: len(self.local), self.road.nodes])
        return self.nodal(V.shape, np.einsum("kcij,kcj->kci", self.K, v))

    def stiffness(self, angles: int, nodes: int, positive: bool) -> Array:
        """At the nodes (k, n, 3, 3), in the frame of the reference angle; ``positive``: all but
        the friction's growth with the pressure."""
        K = self.K.copy()
        if positive:
            K[..., 1:, 0] = 0.0
        field = np.zeros((angles, nodes, 3, 3))
        turned = np.einsum("kai,kcab,kbj->kcij", self.road.frame, K, self.road.frame)
        field[: len(turned), self.road.nodes] = turned
        return field


def flat_road(
    X: Array,
    tread: Lines,
    around: Circumference,
    stiffness: float,
    friction: float,
    elastic_slip: float,
) -> FlatRoad:
    """The road under the nodes of the surface ``tread``. X (n, 2): R, Z of the section, m."""
    share = np.zeros(len(X))
    np.add.at(share, tread.connectivity, (tread.weights * tread.R) @ tread.N)
    nodes = np.flatnonzero(share)
    near = np.flatnonzero(around.angles < MAX_CONTACT_ANGLE)
    c, s = np.cos(around.angles[near]), np.sin(around.angles[near])
    frame = np.zeros((len(c), 3, 3))
    frame[:, 0, 0], frame[:, 0, 1] = c, -s
    frame[:, 1, 0], frame[:, 1, 1] = s, c
    frame[:, 2, 2] = 1.0
    R, Z = X[nodes].T
    origin = np.stack([c[:, None] * R, s[:, None] * R, np.broadcast_to(Z, (len(c), len(Z)))], -1)
    area = around.shares[near][:, None] * share[nodes]
    height = float(origin[..., 0].max())
    gap = height - origin[..., 0]
    anchor = origin[..., 1:]
    return FlatRoad(
        nodes, area, frame, origin, stiffness, friction, elastic_slip, anchor, gap, height
    )
