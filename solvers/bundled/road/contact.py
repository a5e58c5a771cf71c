"""A rigid flat road under the tyre: unilateral contact and Coulomb friction over the patch.

The road's normal is the vertical at theta = 0, downwards; its distance from the axle is H. With
c = cos theta, s = sin theta of a point's reference angle its depth and its place in the road are

    d = c (R + u_r) - s u_theta,   x = s (R + u_r) + c u_theta,   z = Z + u_z

    pressure = k <d - H>,   traction = mu pressure min(|slip| / e, 1) slip / |slip|

on the road, per reference area, integrated where d > H (`tread`): <x> = max(x, 0), k stiffness of
the overclosure, mu coefficient of friction, e elastic slip; x is along the tread, z across it. Slip
counts from where a point stood when the last load had been reached, plus the elastic slip that it
had then. A point that the road was a gap g away from then, at H0, met it on its way to H, and slips
from there on:

    slip = (1 - g / (H0 - H)) (x - x0),   x0: its place then
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from .tread import Points, Tread

Array = np.ndarray
SLIP_SAMPLES = 9  # of a line's patch in a span, between which the elastic slip is linear
JUST_WITHIN = 1e-9  # of that patch, from its ends


@dataclass(frozen=True)
class Bound:
    """Normal forces that limit the friction (Tresca), and shares of the step, at fixed points."""

    points: Points
    normal: Array  # (i, j, p), N
    share: Array  # (i, j, p)


@dataclass(frozen=True)
class FlatRoad:
    """The road, and the tread as it stood on it when the last load was reached."""

    tread: Tread
    stiffness: float  # Pa/m
    friction: float  # coefficient
    elastic_slip: float  # m
    U: Array  # (k, n, 3), m
    # (t, e, j, SLIP_SAMPLES, 2): slip that is still elastic, from end to end of `former`, m
    elastic: Array
    height: float  # of the road, m

    @cached_property
    def former(self) -> tuple[Array, Array]:
        """From and to which angle each line was on the road at the last load (t, e, j), rad; both 0
        where it was not."""
        t, e, first, last = self.tread.intervals(self.U, self.height)
        some, ends = last > first, np.zeros((2, *self.elastic.shape[:3]))
        ends[0, t, e] = np.where(some, first, np.inf).min(-1)
        ends[1, t, e] = np.where(some, last, -np.inf).max(-1)
        begin, end = np.where(ends[0] < ends[1], ends, 0.0)
        return begin, end

    def gap(self, points: Points) -> Array:
        """Gap to the road at the last load (i, j, p), 0 where it touched, m."""
        return np.maximum(self.height - points.positions(self.U)[..., 0], 0.0)

    def share(self, points: Points, height: float) -> tuple[Array, Array]:
        """Share of a step to ``height`` that each point spends on the road, and its slope by the
        height, 1/m, each (i, j, p)."""
        rise, gap = max(self.height - height, 1e-12), self.gap(points)
        met = gap < rise
        return np.where(met, 1.0 - gap / rise, 0.0), np.where(met, -gap / rise**2, 0.0)

    def moved(self, points: Points, at: Array) -> Array:
        """Along and across (i, j, p, 2), m, from where slip counts; ``at``: the points'
        positions."""
        t, e = points.t, points.e
        first, last = (each[t, e][..., None] for each in self.former)
        place = (points.angle - first) / np.where(last > first, last - first, 1.0)
        place = np.clip(place * (SLIP_SAMPLES - 1), 0.0, SLIP_SAMPLES - 1 - 1e-12)
        left, own = place.astype(int), self.elastic[t, e]
        take = lambda i: np.take_along_axis(own, i[..., None], 2)
        right = (place - left)[..., None]
        elastic = take(left) * (1 - right) + take(left + 1) * right
        elastic *= (self.gap(points) == 0.0)[..., None]
        return np.asarray(at[..., 1:] - points.positions(self.U)[..., 1:] + elastic)

    def forces(self, U: Array, height: float, bound: Bound | None = None) -> Contact:
        """Forces at a state U (k, n, 3) with the road at ``height`` (m); ``bound``: of Tresca's
        friction, None: Coulomb's."""
        points = self.tread.patch(U, height, self.former)
        at = points.positions(U)
        normal = self.stiffness * points.area * np.maximum(at[..., 0] - height, 0.0)
        if bound is None:
            where, pressed, place = points, normal, at
            share, growth = self.share(points, height)
        else:
            where, pressed, share = bound.points, bound.normal, bound.share
            growth, place = 0.0 * share, where.positions(U)
        return Contact(
            self,
            U,
            height,
            points,
            at,
            normal,
            bound is None,
            where,
            pressed,
            self.moved(where, place),
            share,
            growth,
        )

    def settled(self, contact: Contact) -> FlatRoad:
        """The road after a load was reached: slip counts anew, less the elastic one."""
        road = replace(self, U=contact.U, height=contact.height)
        begin, end = (each.reshape(-1, each.shape[-1], 1) for each in road.former)
        # the outermost ones just within the patch, where rounding does not decide whether they are
        share = np.linspace(JUST_WITHIN, 1.0 - JUST_WITHIN, SLIP_SAMPLES)
        samples = self.tread.everywhere(share)
        samples = replace(samples, angle=begin + (end - begin) * share)
        slip = self.moved(samples, samples.positions(contact.U))
        slip *= self.share(samples, contact.height)[0][..., None]
        length = np.maximum(np.linalg.norm(slip, axis=-1, keepdims=True), 1e-300)
        elastic = slip * np.minimum(self.elastic_slip / length, 1.0)
        return replace(road, elastic=elastic.reshape(self.elastic.shape))


@dataclass(frozen=True)
class Contact:
    """Forces of half the tyre on the road, in the road's frame: down, along, across."""

    road: FlatRoad
    U: Array  # (k, n, 3) displacements, m
    height: float  # of the road, measured downwards from the axle, m
    points: Points  # of the patch
    positions: Array  # (i, j, p, 3) of the points in the road's frame, m
    normal: Array  # (i, j, p) normal force, N
    coulomb: bool  # whether friction is bounded by the normal force here, or by one known before
    grip: Points  # where friction acts
    pressed: Array  # (i, j, p) normal force that bounds friction, N
    moved: Array  # (i, j, p, 2) way along and across since the last load, m
    share: Array  # (i, j, p) part of that way that was on the road
    growth: Array  # (i, j, p) d share / d height, 1/m

    def bound(self, share: Array | float) -> Bound:
        """Limit of the friction for a step of which the points spend ``share`` on the road."""
        return Bound(self.points, self.normal, share + 0.0 * self.normal)

    @property
    def force(self) -> float:
        """Vertical force of the whole tyre, N."""
        return 2 * float(self.normal.sum())

    @cached_property
    def _slip(self) -> tuple[Array, Array, Array]:
        """Slip's length (m), its direction or, sticking, its share of the elastic one; sticks."""
        slip = self.moved * self.share[..., None]
        length = np.maximum(np.linalg.norm(slip, axis=-1), 1e-300)
        sticking = length <= self.road.elastic_slip
        scale = np.where(sticking, self.road.elastic_slip, length)
        return length, slip / scale[..., None], sticking

    @property
    def traction(self) -> Array:
        """Friction at its points (i, j, p, 2), N."""
        return np.asarray(self.road.friction * self.pressed[..., None] * self._slip[1])

    @cached_property
    def field(self) -> Array:
        """Forces on the road (k, n, 3) in the frame of the reference angle, N."""
        down = _local(self.normal, 0.0 * self.positions[..., 1:])
        return self.points.spread(down) + self.grip.spread(
            _local(0.0 * self.pressed, self.traction)
        )

    @property
    def energy(self) -> float:
        """Energy of half the tyre's contact, J, stored and dissipated; with a bound of the
        friction, the potential of the forces."""
        over = np.maximum(self.positions[..., 0] - self.height, 0.0)
        e, (length, _, sticking) = self.road.elastic_slip, self._slip
        # work on unit normal force; over the share, so that its slope by ``moved`` is the traction
        path = np.where(sticking, length**2 / (2 * e), length - e / 2)
        path = np.divide(path, self.share, out=np.zeros_like(path), where=self.share > 0)
        work = self.road.friction * float((self.pressed * path).sum())
        return float((self.normal * over).sum()) / 2 + work

    @cached_property
    def _by_slip(self) -> Array:
        """Friction's derivatives by the slip (i, j, p, 2, 2), N/m."""
        length, along, sticking = self._slip
        reach = (
            self.road.friction * self.pressed / np.where(sticking, self.road.elastic_slip, length)
        )
        sliding = np.where(sticking, 0.0, reach)[..., None, None]
        return np.asarray(
            reach[..., None, None] * np.eye(2) - sliding * along[..., :, None] * along[..., None, :]
        )

    @property
    def _stiff(self) -> Array:
        """Normal stiffness (i, j, p), N/m."""
        return self.road.stiffness * self.points.area

    def matrix(self, positive: bool = False) -> csr_matrix:
        """Tangent stiffness of fields (k n 3, k n 3), N/m; ``positive``: all but the friction's
        growth with the pressure."""
        K = np.zeros((*self.grip.angle.shape, 3, 3))
        K[..., 1:, 1:] = self._by_slip * self.share[..., None, None]
        normal = K if self.coulomb else np.zeros((*self.points.angle.shape, 3, 3))
        normal[..., 0, 0] = self._stiff
        if not self.coulomb:
            return self.points.matrix(normal) + self.grip.matrix(K)
        if not positive:
            K[..., 1:, 0] = self.road.friction * self._stiff[..., None] * self._slip[1]
        return self.grip.matrix(K)

    @property
    def stiffness(self) -> float:
        """Stiffness of half the tyre's vertical force against the road's height, N/m."""
        return float(self._stiff.sum())

    def force_by_height(self) -> Array:
        """Derivative of the normal forces (k, n, 3) by the road's height, N/m; less that of the
        vertical force by the displacements."""
        return self.points.spread(_local(-self._stiff, 0.0 * self.positions[..., 1:]))

    def by_height(self) -> Array:
        """Derivatives of all forces (k, n, 3) by the road's height, N/m."""
        more = np.einsum("ijpxy,ijpy->ijpx", self._by_slip, self.moved) * self.growth[..., None]
        if self.coulomb:
            more = more - self.road.friction * self._stiff[..., None] * self._slip[1]
        return self.force_by_height() + self.grip.spread(_local(0.0 * self.pressed, more))


def _local(down: Array, along_and_across: Array) -> Array:
    return np.concatenate([down[..., None], along_and_across], -1)


def flat_road(
    X: Array, tread: Tread, stiffness: float, friction: float, elastic_slip: float, U: Array
) -> FlatRoad:
    """The road that just touches a tread displaced by U (k, n, 3), all round alike. X (n, 2): R, Z
    of the section, m; stiffness, friction, elastic_slip: as in `FlatRoad`."""
    height = float((X[tread.nodes, 0] + U[0, tread.nodes, 0]).max())  # at angle 0
    elastic = np.zeros((len(tread.begin), *tread.ds.shape, SLIP_SAMPLES, 2))
    return FlatRoad(tread, stiffness, friction, elastic_slip, U, elastic, height)
