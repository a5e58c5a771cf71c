"""The tread near the road as surface elements, and points of its patch.

A surface element is a span round the tyre times a line element of the section: its displacements
are u = sum N_l(theta) M_a(s) u_la. Across it run lines at fixed Gauss points s_j; the patch is
where the depth d(theta) on such a line, measured downwards from the axle, exceeds that of the road,
H ("height" in names). So its ends are roots of d - H, and Gauss points are between them: sums over
them move smoothly with the edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from ..section.elements import lines
from ..solid3d.circumference import HalfCircle, functions

Array = np.ndarray
MAX_CONTACT_ANGLE = np.pi / 3  # from the vertical: no span that begins beyond it can touch
# lines at Gauss points of a line element: as many as an edge needs that crosses a wide one
LINES_ACROSS = 8
# Gauss points between two ends: exact for products of two functions and the depth
POINTS_IN_PATCH = 3
ROOT_STEPS = 4  # of Newton's method, from the root of a parabola


@dataclass(frozen=True)
class Tread:
    """Spans t, line elements e with nodes a and lines j."""

    begin: Array  # (t,) angle where a span begins, rad
    length: Array  # (t,) angle over a span, rad
    # (t, l): functions round the tyre, three or, where waves follow, a fourth; where that is the
    # third again it counts for nothing
    columns: Array
    nodes: Array  # (e, a) rows of the mesh
    M: Array  # (j, a) shape functions on the lines
    slope: Array  # (e, j, a): dM/ds, 1/m
    X: Array  # (e, j, 2): R, Z, m
    tangent: Array  # (e, j, 2): dX/ds
    ds: Array  # (e, j): what each line stands for, m
    shape: tuple[int, int, int]  # of fields (k, n, 3)

    def everywhere(self, share: Array) -> Points:
        """On all elements the points at ``share`` (p,) of each span, which stand for nothing."""
        t, e = np.divmod(np.arange(len(self.begin) * len(self.nodes)), len(self.nodes))
        angle = self.begin[t, None] + self.length[t, None] * share
        angle = np.repeat(angle[:, None], len(self.M), 1)
        return Points(self, t, e, angle, np.zeros_like(angle))

    def patch(self, U: Array, height: float, cuts: tuple[Array, Array]) -> Points:
        """Gauss points where a tread displaced by U (k, n, 3) is deeper than ``height`` (m), in
        pieces between the ``cuts`` (t, e, j), rad."""
        t, e, first, last = self.intervals(U, height)
        # in halves of the spans, so that they also serve what has a kink at the nodes in between
        half = np.broadcast_to((self.begin + self.length / 2)[t, None, None], first[..., :1].shape)
        own = (cut[t, e][..., None] for cut in cuts)
        ends = np.sort(np.concatenate([first, last, half, *own], -1))
        begin, end = ends[..., :-1], ends[..., 1:]
        middle = (begin + end) / 2
        at = middle[..., None]
        within = (first[..., None, :] < at) & (at < last[..., None, :])
        size = np.where(within.any(-1), end - begin, 0.0)
        # the pieces that there are, first
        order = np.argsort(size == 0.0, axis=-1, kind="stable")
        order = order[..., : int((size > 0.0).sum(-1).max(initial=1))]
        middle, size = (np.take_along_axis(each, order, -1)[..., None] for each in (middle, size))
        g, w = np.polynomial.legendre.leggauss(POINTS_IN_PATCH)
        flat = *order.shape[:2], order.shape[2] * POINTS_IN_PATCH
        angle, weight = middle + size / 2 * g, size / 2 * w
        return Points(self, t, e, angle.reshape(flat), weight.reshape(flat))

    def intervals(self, U: Array, height: float) -> tuple[Array, Array, Array, Array]:
        """Spans and line elements (i,) where a tread displaced by U is deeper than ``height``, and
        from which angle (i, j, 2) on to which it is so on their lines, in two pieces, rad."""
        three = self.everywhere(np.array([0.0, 0.5, 1.0]))
        o = three.positions(U)[..., 0] - height
        # the parabola through three depths, xi = -1 to 1: o1 + slant xi + bend xi^2 / 2
        slant, bend = (o[..., 2] - o[..., 0]) / 2, o[..., 0] - 2 * o[..., 1] + o[..., 2]
        turn = np.divide(-slant, bend, out=-np.sign(slant * bend), where=abs(bend) > abs(slant))
        highest = np.maximum(o.max(-1), o[..., 1] + slant * turn / 2)
        some = (highest > 0).any(1)
        t, e = three.t[some], three.e[some]
        o, slant, bend, turn = o[some], slant[some], bend[some], turn[some]
        middle, half = three.angle[some, :, 1], self.length[t, None] / 2
        at = lambda xi: Points(self, t, e, middle[..., None] + half[..., None] * xi, 0 * xi)
        over = lambda xi: at(xi).positions(U)[..., 0] - height
        # between its ends and its turning point the depth is monotonous
        ends = np.stack([0 * turn - 1, turn, 0 * turn + 1], -1)
        depth = np.stack([o[..., 0], over(turn[..., None])[..., 0], o[..., 2]], -1)
        root = np.sqrt(np.maximum(slant**2 - 2 * bend * o[..., 1], 0.0))
        steep = -slant - np.copysign(root, slant)  # 2 o1 / steep is the root without cancellation
        pair = np.stack(
            [
                np.divide(2 * o[..., 1], steep, out=0 * steep, where=steep != 0),
                np.divide(steep, bend, out=0 * steep, where=bend != 0),
            ],
            -1,
        )
        low, high = ends[..., :-1], ends[..., 1:]
        inside = (pair[..., None, :] >= low[..., None]) & (pair[..., None, :] <= high[..., None])
        xi = np.where(inside[..., 0], pair[..., None, 0], pair[..., None, 1])
        xi = np.clip(xi, low, high)
        for _ in range(ROOT_STEPS):
            points = at(xi)
            value, rise = points.positions(U)[..., 0] - height, points.rates(U)[..., 0]
            rise = rise * half[..., None]
            xi = np.clip(xi - np.divide(value, rise, out=0 * xi, where=rise != 0), low, high)
        begins, stops = depth[..., :-1] > 0, depth[..., 1:] > 0
        first = np.where(begins, low, np.where(stops, xi, low))
        last = np.where(stops, high, np.where(begins, xi, low))
        angle = lambda xi: middle[..., None] + half[..., None] * xi
        return t, e, angle(first), angle(last)

    def at_nodes(self, X: Array) -> Tread:
        """Lines at the nodes, which stand for nothing."""
        unit = np.eye(self.nodes.shape[1])
        nothing = np.zeros((*self.nodes.shape, 2))
        return replace(self, M=unit, X=X[self.nodes], tangent=nothing, ds=nothing[..., 0])


@dataclass(frozen=True)
class Points:
    """Points p on the lines j of some surface elements i."""

    tread: Tread
    t: Array  # (i,): the elements' spans
    e: Array  # (i,): and line elements
    angle: Array  # (i, j, p), rad
    weight: Array  # (i, j, p), rad

    @cached_property
    def _functions(self) -> tuple[Array, Array]:
        """Functions round the tyre and their derivatives by the angle at the points, each (i, j, p,
        l)."""
        half = self.tread.length[self.t, None, None] / 2
        three = functions(self.angle - self.tread.begin[self.t, None, None] - half, half)
        third, fourth = self.tread.columns[self.t, 2:3], self.tread.columns[self.t, 3:]
        new = np.where(fourth == third, 0.0, 1.0)[:, None, None]
        N, dN = (np.concatenate([f, new * f[..., 2:]], -1) for f in three)
        return N, dN

    @property
    def N(self) -> Array:
        """Functions round the tyre at the points (i, j, p, l)."""
        return self._functions[0]

    @cached_property
    def area(self) -> Array:
        """Reference area (i, j, p) that each stands for, m2."""
        e = self.e
        return self.weight * (self.tread.ds[e] * self.tread.X[e, :, 0])[..., None]

    @cached_property
    def frame(self) -> Array:
        """Rotation (i, j, p, 3, 3) from r, theta, z at the angle to the road's down, along,
        across."""
        frame = np.zeros((*self.angle.shape, 3, 3))
        frame[..., 0, 0] = frame[..., 1, 1] = np.cos(self.angle)
        frame[..., 1, 0] = np.sin(self.angle)
        frame[..., 0, 1] = -frame[..., 1, 0]
        frame[..., 2, 2] = 1.0
        return frame

    def _lines(self, U: Array, M: Array) -> Array:
        """Factors of the functions round the tyre on the lines (i, j, l, 3), for M (j, a) or (i, j,
        a)."""
        own = U[self._places]  # (i, l, a, 3)
        return np.asarray((M[..., None, :, :] @ own).swapaxes(1, 2))

    def positions(self, U: Array) -> Array:
        """Depth, and place in the road along and across (i, j, p, 3), m."""
        u = self.N @ self._lines(U, self.tread.M)
        u[..., 0::2] += self.tread.X[self.e][:, :, None]
        return np.asarray((self.frame @ u[..., None])[..., 0])

    def rates(self, U: Array) -> Array:
        """Derivatives of `positions` by the angle (i, j, p, 3), m/rad."""
        N, dN = self._functions
        lines = self._lines(U, self.tread.M)
        u, du = N @ lines, dN @ lines
        R = self.tread.X[self.e][:, :, None, 0]
        du[..., 0] -= u[..., 1]
        du[..., 1] += R + u[..., 0]
        return np.asarray((self.frame @ du[..., None])[..., 0])

    def densities(self, U: Array) -> Array:
        """Deformed over reference area (i, j, p), seen from the road."""
        N, e = self.N, self.e
        across = N @ self._lines(U, self.tread.slope[e])
        across[..., 0::2] += self.tread.tangent[e][:, :, None]
        across = (self.frame @ across[..., None])[..., 0]
        around = self.rates(U)
        size = around[..., 1] * across[..., 2] - around[..., 2] * across[..., 1]
        return np.asarray(abs(size) / self.tread.X[e][:, :, None, 0])

    def spread(self, local: Array) -> Array:
        """Forces (i, j, p, 3) on the road as a field (k, n, 3) in the frame of the angle."""
        turned = np.einsum("ijpxy,ijpx->ijpy", self.frame, local)
        lines = self.N.swapaxes(-1, -2) @ turned
        field = np.zeros(self.tread.shape)
        own = np.einsum("ja,ijlc->ilac", self.tread.M, lines)
        np.add.at(field, self._places, own)
        return field

    @property
    def _places(self) -> tuple[Array, Array]:
        return self.tread.columns[self.t][:, :, None], self.tread.nodes[self.e][:, None]

    def matrix(self, K: Array) -> csr_matrix:
        """Stiffness (i, j, p, 3, 3) between the components of fields (k n 3, k n 3)."""
        N, M = self.N, self.tread.M
        turned = self.frame.swapaxes(-1, -2) @ K @ self.frame
        i, j, p, count = N.shape
        pairs = (N[..., :, None] * N[..., None, :]).reshape(i, j, p, count**2)
        lines = pairs.swapaxes(-1, -2) @ turned.reshape(i, j, p, 9)  # (i, j, pairs, 9)
        across = (M[:, :, None] * M[:, None, :]).reshape(len(M), -1)  # (j, a a)
        a = M.shape[1]
        own = np.tensordot(lines, across, ([1], [0])).reshape(i, count, count, 3, 3, a, a)
        own = own.transpose(0, 1, 5, 3, 2, 6, 4).reshape(i, count * a * 3, count * a * 3)
        k, n = self._places
        dofs = ((k * self.tread.shape[1] + n) * 3)[..., None] + np.arange(3)
        dofs = dofs.reshape(i, count * a * 3)
        rows, cols = np.broadcast_arrays(dofs[:, :, None], dofs[:, None])
        size = int(np.prod(self.tread.shape))
        return csr_matrix((own.ravel(), (rows.ravel(), cols.ravel())), shape=(size, size))


def tread_of(X: Array, faces: Array, around: HalfCircle) -> Tread:
    """The surface of the line elements ``faces`` (e, a). X (n, 2): R, Z of the section, m."""
    own = lines(X, faces, LINES_ACROSS)
    begin, length = around.ends[:-1], np.diff(around.ends)
    near = begin < MAX_CONTACT_ANGLE
    columns = 2 * np.arange(len(begin))[:, None] + np.arange(3)
    if around.waves.size:  # of which the first two begin where the last element ends
        columns = np.column_stack([columns, columns[:, 2]])
        columns[-1, 3] = around.odd[columns[-1, 2]]
    return Tread(
        begin[near],
        length[near],
        columns[near],
        faces,
        own.N,
        own.slope,
        np.einsum("ja,eac->ejc", own.N, own.X),
        own.tangent,
        own.weights,
        (around.N.shape[1], len(X), 3),
    )
