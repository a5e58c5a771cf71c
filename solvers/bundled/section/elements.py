"""The tyre's section as arrays: elements with their gradient operators at Gauss points.

Displacements u = (u_r, u_theta, u_z) are components in the cylindrical frame of the *reference*
angle Theta, so that every operator below is linear in u, finite twist included, and one set of
operators serves the axisymmetric state and all harmonics u exp(i n Theta):

    F = 1 + H,   H = (B0 + i n B1) u,   rows i in (r, theta, z), columns J in (R, Theta, Z)
    H_iR = u_i,R    H_iZ = u_i,Z    H_iTheta = (i n u_i + (e_z x u)_i) / R
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import shapes

Array = np.ndarray


class FoldedElement(ValueError):
    """An element whose Jacobian is not positive; ``index`` is its place in the block."""

    def __init__(self, index: int):
        super().__init__(f"element {index} has no positive area")
        self.index = index


@dataclass(frozen=True)
class Solids:
    """Rubber elements of one type.

    connectivity (e, a); N (g, a); weights (e, g): w det(dX/dxi) R, m2 per radian;
    B0 (e, g, 9, 3a); hoop (e, g, a): N/R, the only rows of B1; hourglass (e, a) or None;
    mass_N (g', a), mass_weights (e, g'): a rule that integrates the mass in full.
    """

    connectivity: Array
    N: Array
    weights: Array
    B0: Array
    hoop: Array
    hourglass: Array | None
    mass_N: Array
    mass_weights: Array

    @property
    def B1(self) -> Array:
        """The rows (r, theta, z; Theta) of B1, (e, g, 3, 3a)."""
        e, g, a = self.hoop.shape
        B1 = np.zeros((e, g, 3, a, 3), self.hoop.dtype)
        for i in range(3):
            B1[:, :, i, :, i] = self.hoop
        return B1.reshape(e, g, 3, 3 * a)


def solids(X: Array, connectivity: Array, points: int) -> Solids:
    """Operators of quadrilaterals with ``points`` x ``points`` Gauss points.

    X (n, 2): R, Z of all nodes in m. With one point, the hourglass vectors are formed too.
    Raises FoldedElement.
    """
    nodes = connectivity.shape[1]
    rule = shapes.quad(nodes, points)
    R, weights, gradient = _map(X, connectivity, rule)
    e, g, a = *weights.shape, nodes
    hoop = rule.N / R[:, :, None]
    B0 = np.zeros((e, g, 3, 3, a, 3), weights.dtype)
    for i in range(3):
        B0[:, :, i, 0, :, i] = gradient[..., 0]
        B0[:, :, i, 2, :, i] = gradient[..., 1]
    B0[:, :, 0, 1, :, 1] = -hoop
    B0[:, :, 1, 1, :, 0] = hoop
    mass_rule = shapes.quad(nodes, 3 if nodes == 8 else 2)
    _, mass_weights, _ = _map(X, connectivity, mass_rule)
    return Solids(
        connectivity,
        rule.N,
        weights,
        B0.reshape(e, g, 9, 3 * a),
        hoop,
        _hourglass(X[connectivity], gradient[:, 0], weights[:, 0]) if points == 1 else None,
        mass_rule.N,
        mass_weights,
    )


def _map(X: Array, connectivity: Array, rule: shapes.Rule) -> tuple[Array, Array, Array]:
    """R (e, g), weights w det R (e, g) and dN/dX (e, g, a, 2) of the isoparametric map."""
    corners = X[connectivity]
    tangent = np.einsum("gak,eaj->egjk", rule.dN, corners)  # dX_j / dxi_k
    det = tangent[..., 0, 0] * tangent[..., 1, 1] - tangent[..., 0, 1] * tangent[..., 1, 0]
    R = np.einsum("ga,ea->eg", rule.N, corners[..., 0])
    bad = np.flatnonzero(((det.real <= 0) | (R.real <= 0)).any(1))
    if len(bad):
        raise FoldedElement(int(bad[0]))
    inverse = np.empty_like(tangent)  # dxi_k / dX_j
    inverse[..., 0, 0], inverse[..., 1, 1] = tangent[..., 1, 1], tangent[..., 0, 0]
    inverse[..., 0, 1], inverse[..., 1, 0] = -tangent[..., 0, 1], -tangent[..., 1, 0]
    inverse /= det[..., None, None]
    gradient = np.einsum("gak,egkj->egaj", rule.dN, inverse)
    return R, rule.weights * det * R, gradient


def _hourglass(corners: Array, gradient: Array, weights: Array) -> Array:
    """Hourglass vectors of Flanagan and Belytschko (1981), (e, 4), blind to linear fields.

    Scaled by sqrt(R dA sum |grad N|^2), so that an energy per radian is k (gamma . u_i)^2 / 2.
    """
    h = np.array([1.0, -1.0, 1.0, -1.0])
    gamma = (h - np.einsum("a,eaj,ebj->eb", h, corners, gradient)) / 4
    return gamma * np.sqrt(weights * (gradient**2).sum((1, 2)))[:, None]


@dataclass(frozen=True)
class Lines:
    """Rebar or pressure lines: connectivity (e, a) and, at Gauss points, N (g, a),
    slope (e, g, a) = dN/ds, R (e, g), tangent (e, g, 2), weights (e, g) = w ds (m)."""

    connectivity: Array
    N: Array
    slope: Array
    R: Array
    tangent: Array
    weights: Array


def lines(X: Array, connectivity: Array, points: int = 2) -> Lines:
    """Operators along two- or three-node lines in the section."""
    rule = shapes.line(connectivity.shape[1], points)
    corners = X[connectivity]
    dX = np.einsum("ga,eaj->egj", rule.dN[..., 0], corners)
    length = np.sqrt((dX * dX).sum(-1))
    return Lines(
        connectivity,
        rule.N,
        rule.dN[..., 0] / length[..., None],
        np.einsum("ga,ea->eg", rule.N, corners[..., 0]),
        dX / length[..., None],
        rule.weights * length,
    )


def cord_operators(lines: Lines, cos: Array, sin: Array) -> tuple[Array, Array, Array]:
    """a (e, g, 3), b0 (e, g, 3, 3a), hoop (e, g, a): q = a + b0 u, and i n hoop u per component.

    cos, sin: of the cord's angle from the meridian, per element (e,) or scalar.
    """
    e, g, a = lines.slope.shape
    cos = np.broadcast_to(np.asarray(cos).reshape(-1, 1), (e, g))
    sin = np.broadcast_to(np.asarray(sin).reshape(-1, 1), (e, g))
    direction = np.stack([cos * lines.tangent[..., 0], sin, cos * lines.tangent[..., 1]], -1)
    along = cos[..., None] * lines.slope
    hoop = sin[..., None] * lines.N / lines.R[..., None]
    b0 = np.zeros((e, g, 3, a, 3), np.result_type(along, hoop))
    for i in range(3):
        b0[:, :, i, :, i] = along
    b0[:, :, 0, :, 1] = -hoop
    b0[:, :, 1, :, 0] = hoop
    return direction, b0.reshape(e, g, 3, 3 * a), hoop
