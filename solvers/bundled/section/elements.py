"""The tyre's section as arrays: elements with their gradient operators at Gauss points.

Displacements u = (u_r, u_theta, u_z) are components in the cylindrical frame of the *reference*
angle Theta, so that every operator below is linear in u, finite twist included, and one set of
operators serves the axisymmetric state and all harmonics u exp(i n Theta):

    F = 1 + H,   H = (B0 + i n B1) u,   rows i in (r, theta, z), columns J in (R, Theta, Z)
    H_iR = u_i,R    H_iZ = u_i,Z    H_iTheta = (i n u_i + (e_z x u)_i) / R
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ...errors import Inverted
from . import shapes

Array = np.ndarray


@dataclass(frozen=True)
class Solids:
    """Quadrilaterals or triangles of one type, at Gauss points; B1 is as in `parts.elastic`."""

    connectivity: Array  # (e, a)
    weights: Array  # (e, g): w det(dX/dxi) R, m3 per radian
    B0: Array  # (e, g, 9, 3a), 1/m
    hoop: Array  # (e, g, a): N / R, 1/m, the only rows of B1
    hourglass: Array | None  # gamma (e, a) of quadrilaterals with one Gauss point, see `_hourglass`
    # (e, g, g), of what the points have onto the pressure's terms; None: onto itself
    projection: Array | None
    # a rule that integrates the mass in full
    mass_N: Array  # (g', a)
    mass_weights: Array  # (e, g')

    def pick(self, rows: Array) -> Solids:
        """Some of the elements."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        kept = {name for name, v in own.items() if name == "mass_N" or v is None}
        return Solids(**{name: v if name in kept else v[rows] for name, v in own.items()})


def solids(
    X: Array, connectivity: Array, kind: shapes.ElementType, share: Array | float = 1.0
) -> Solids:
    """Operators of solids of one type; with one Gauss point the hourglass vectors, too.

    X (n, 2): R, Z of all nodes in m; share (e, 1): of each that counts (`Whole.share`). Raises
    Inverted.
    """
    rule, mass_rule = kind.rule(kind.points), kind.rule(kind.mass_points)
    R, weights, gradient = _map(X, connectivity, rule)
    e, g, a = *weights.shape, kind.nodes
    hoop = rule.N / R[:, :, None]
    B0 = np.zeros((e, g, 3, 3, a, 3), weights.dtype)
    for i in range(3):
        B0[:, :, i, 0, :, i] = gradient[..., 0]
        B0[:, :, i, 2, :, i] = gradient[..., 1]
    B0[:, :, 0, 1, :, 1] = -hoop
    B0[:, :, 1, 1, :, 0] = hoop
    _, mass_weights, _ = _map(X, connectivity, mass_rule)
    return Solids(
        connectivity,
        weights * share,
        B0.reshape(e, g, 9, 3 * a),
        hoop,
        _hourglass(X[connectivity], gradient[:, 0], weights[:, 0]) if (g, a) == (1, 4) else None,
        _projection(rule.N @ X[connectivity], weights, kind.pressures),
        mass_rule.N,
        mass_weights * share,
    )


def _map(X: Array, connectivity: Array, rule: shapes.Rule) -> tuple[Array, Array, Array]:
    """R (e, g), weights w det R (e, g) and dN/dX (e, g, a, 2) of the isoparametric map. Raises
    Inverted."""
    corners = X[connectivity]
    tangent = np.einsum("gak,eaj->egjk", rule.dN, corners)  # dX_j / dxi_k
    det = tangent[..., 0, 0] * tangent[..., 1, 1] - tangent[..., 0, 1] * tangent[..., 1, 0]
    R = np.einsum("ga,ea->eg", rule.N, corners[..., 0])
    bad = np.flatnonzero(((det.real <= 0) | (R.real <= 0)).any(1))
    if len(bad):
        raise Inverted(int(bad[0]))
    inverse = np.empty_like(tangent)  # dxi_k / dX_j
    inverse[..., 0, 0], inverse[..., 1, 1] = tangent[..., 1, 1], tangent[..., 0, 0]
    inverse[..., 0, 1], inverse[..., 1, 0] = -tangent[..., 0, 1], -tangent[..., 1, 0]
    inverse /= det[..., None, None]
    gradient = np.einsum("gak,egkj->egaj", rule.dN, inverse)
    return R, rule.weights * det * R, gradient


def _hourglass(corners: Array, gradient: Array, weights: Array) -> Array:
    """Hourglass vectors of Flanagan and Belytschko (1981), (e, 4), blind to linear fields; gradient
    dN/dX (e, 4, 2) at the one point.

    Scaled by sqrt(R dA sum |grad N|^2), so that an energy per radian is k (gamma . u_i)^2 / 2, k in
    Pa.
    """
    h = np.array([1.0, -1.0, 1.0, -1.0])
    gamma = (h - np.einsum("a,eaj,ebj->eb", h, corners, gradient)) / 4
    return gamma * np.sqrt(weights * (gradient**2).sum((1, 2)))[:, None]


def _projection(x: Array, weights: Array, terms: int) -> Array | None:
    """Q (Q^T w Q)^-1 Q^T w, the mean-square fit of the terms Q = 1, R, Z to values at the points
    x (e, g, 2) with their weights (e, g); None: each point keeps its own."""
    e, g, _ = x.shape
    if terms in (0, g):
        return None
    Q = np.concatenate([np.ones((e, g, 1)), x - x.mean(1, keepdims=True)], 2)[..., :terms]
    weighted = Q.swapaxes(1, 2) * weights[:, None]
    return np.asarray(Q @ np.linalg.solve(weighted @ Q, weighted))


@dataclass(frozen=True)
class Lines:
    """Rebar or pressure lines, at Gauss points."""

    connectivity: Array  # (e, a)
    X: Array  # (e, a, 2): R, Z of the nodes, m
    # (g, a) shape functions; of lines inside other elements (e, g, h), for the h nodes of the hosts
    N: Array
    slope: Array  # (e, g, a) or (e, g, h): dN/ds, 1/m
    R: Array  # (e, g), m
    tangent: Array  # (e, g, 2): dX/ds
    weights: Array  # (e, g): w ds, m

    def pick(self, rows: Array) -> Lines:
        """Some of the elements."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        alike = self.N.ndim == 2
        return Lines(**{k: v if k == "N" and alike else v[rows] for k, v in own.items()})


def lines(
    X: Array,
    connectivity: Array,
    points: int = 2,
    share: Array | float = 1.0,
    weights: Array | None = None,
) -> Lines:
    """Operators along two- or three-node lines in the section at ``points`` Gauss points; share (e,
    1): as for `solids`; weights (e, a, h): of the h nodes of the hosts, to which they are
    connected, in their a own ones; None: they are in no host."""
    ends = X[connectivity] if weights is None else weights @ X[connectivity]
    rule = shapes.line(ends.shape[1], points)
    dX = np.einsum("ga,eaj->egj", rule.dN[..., 0], ends)
    length = np.sqrt((dX * dX).sum(-1))
    slope = rule.dN[..., 0] / length[..., None]
    return Lines(
        connectivity,
        ends,
        rule.N if weights is None else rule.N @ weights,
        slope if weights is None else slope @ weights,
        np.einsum("ga,ea->eg", rule.N, ends[..., 0]),
        dX / length[..., None],
        rule.weights * length * share,
    )
