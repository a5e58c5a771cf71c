"""Follower pressure on the inner surface, as the potential -p V of the enclosed volume.

Per radian, with x = (x_r, x_theta, x_z) in the cylindrical frame of the reference angle,
' = d/ds along the section and D = d/dTheta + e_z x:

    V = 1/2 int (x_r, x_theta, 0) . (x' x Dx) ds

s runs along the faces of counter-clockwise elements, on the inner surface from z > 0 to z < 0, so
that V > 0. The gauge (x_r, x_theta, 0)/2 makes the second variation symmetric also at open ends.
There the force of -p V is the follower pressure's and a thrust p r^2 / 2 per radian along the axle,
as on a closed cap, which does nothing where the end is held along the axle. Without it the second
variation has p r (dr Dz - Dr dz) / 2 of two displacements, which is not symmetric: so no other end
is honoured (`boundary.check_open_ends`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..elements import Lines
from .part import IN_PLANE, SPIN_AXIS, AtStations, Precision, Tangents, TyrePart, cross

Array = np.ndarray


@dataclass
class Pressure(TyrePart):
    """A pressure (Pa) on the faces of a surface."""

    lines: Lines
    pressure: complex | float  # Pa
    connectivity: Array = field(init=False)  # (e, a), of ``lines``

    def __post_init__(self) -> None:
        self.connectivity = self.lines.connectivity

    def energy(self, U: Array) -> Any:
        return -self.pressure * volume(*surface_point(self.lines, U), self.lines.weights)

    def force(self, U: Array) -> Array:
        by_x, by_dx = first(*surface_point(self.lines, U))
        weights = -self.pressure * self.lines.weights
        force = self.lines.N.T @ (weights[..., None] * by_x)
        force = force + (weights[..., None] * self.lines.slope).swapaxes(1, 2) @ by_dx
        return np.asarray(force.reshape(len(force), -1))

    def tangents(self, U: Array, harmonics: bool) -> Tangents:
        lines = self.lines
        e, g, a = lines.slope.shape
        xx, xd, linear = second(*surface_point(lines, U))
        weights = -self.pressure * lines.weights / 2
        N = np.broadcast_to(lines.N, (e, g, a))

        def blocks(left: Array, middle: Array, right: Array) -> Array:
            """sum over Gauss points of weights left_a middle_ij right_b as (e, 3a, 3a)."""
            pairs = (weights[..., None] * left)[..., :, None] * right[..., None, :]
            sums = pairs.reshape(e, g, a * a).swapaxes(1, 2) @ middle.reshape(e, g, 9)
            return sums.reshape(e, a, a, 3, 3).swapaxes(2, 3).reshape(e, 3 * a, 3 * a)

        Q = blocks(N, xx, N) + blocks(N, xd, lines.slope)
        K0 = Q + Q.swapaxes(1, 2)
        if not harmonics:
            return K0, None, None
        Q = blocks(N, linear[..., 0, :, :], N) + blocks(lines.slope, linear[..., 1, :, :], N)
        return K0, Q - Q.swapaxes(1, 2), None

    def at_stations(self, nodes: int) -> PressureAtStations:
        return PressureAtStations(self, nodes)


def surface_point(lines: Lines, U: Array) -> tuple[Array, Array]:
    """Deformed position x and its slope x' = dx/ds (e, g, 3) on a surface."""
    x = U[lines.connectivity] + np.zeros(1, lines.X.dtype)
    x[..., 0::2] += lines.X
    return lines.N @ x, lines.slope @ x


def _cross(a: Array) -> Array:
    """Matrices [a] with [a] b = a x b, (p, 3, 3)."""
    X = np.zeros((*a.shape, 3), a.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        X[..., i, j] = -a[..., k]
        X[..., j, i] = a[..., k]
    return X


def volume(x: Array, dx: Array, weights: Array) -> Array:
    """V per radian (m3) from x, x' (p, 3) at Gauss points with their weights."""
    return np.asarray((weights * density(x, dx, 0.0)).sum())


def first(x: Array, dx: Array) -> tuple[Array, Array]:
    """Gradients of the integrand of V with respect to x and to x', each (p, 3)."""
    by_x, by_dx, _ = first_around(x, dx, 0.0)
    return by_x, by_dx


def second(x: Array, dx: Array) -> tuple[Array, Array, Array]:
    """Second derivative u^H Q u of V's integrand along u exp(i n Theta), in blocks (p, 3, 3).

    Q, not yet symmetrised, has xx (u, u), xd (u, u') and i n times two blocks, (u, u) and (u', u).
    Returns xx, xd and those two as (p, 2, 3, 3).
    """
    y, d = x @ IN_PLANE, x @ SPIN_AXIS.T
    along = IN_PLANE @ _cross(dx)
    xx = along @ SPIN_AXIS
    xd = -IN_PLANE @ _cross(d) - (_cross(y) @ SPIN_AXIS).swapaxes(-1, -2)
    return xx, xd, np.stack([along, -_cross(y)], -3)


def density(x: Array, dx: Array, around: Array | float) -> Array:
    """Integrand (...) of the volume V from x, x' = dx/ds and ``around`` = dx/dTheta, (..., 3)."""
    y, d = x @ IN_PLANE, around + x @ SPIN_AXIS.T
    return np.asarray((y * cross(dx, d)).sum(-1) / 2)


def first_around(x: Array, dx: Array, around: Array | float) -> tuple[Array, Array, Array]:
    """Gradients of V's integrand by x, x' and ``around`` = dx/dTheta, each (..., 3)."""
    y, d = x @ IN_PLANE, around + x @ SPIN_AXIS.T
    by_around = cross(y, dx)
    by_x = cross(dx, d) @ IN_PLANE + by_around @ SPIN_AXIS
    return by_x / 2, cross(d, y) / 2, by_around / 2


def change(
    x: Array, dx: Array, around: Array, u: Array, du: Array, u_around: Array
) -> tuple[Array, Array, Array]:
    """Change of `first_around` with a small displacement u, u', du/dTheta (..., 3)."""
    y, d = x @ IN_PLANE, around + x @ SPIN_AXIS.T
    v, e = u @ IN_PLANE, u_around + u @ SPIN_AXIS.T
    by_around = cross(v, dx) + cross(y, du)
    by_x = (cross(du, d) + cross(dx, e)) @ IN_PLANE + by_around @ SPIN_AXIS
    return by_x / 2, (cross(e, y) + cross(d, v)) / 2, by_around / 2


class PressureAtStations(AtStations):
    """V = 1/2 int (x_r, x_theta, 0) . (x' x (dx/dTheta + e_z x x)) at every station."""

    def __init__(self, part: Pressure, nodes: int):
        super().__init__(part.connectivity, nodes)
        self.lines = lines = part.lines
        self.X = np.insert(lines.X, 1, 0.0, -1)
        self.N = np.broadcast_to(lines.N, lines.slope.shape)
        self.weights = -part.pressure * lines.weights

    def _fields(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        """u, u', du (e, g, s, 3) on the surface."""
        lines, (e, g, a) = self.lines, self.N.shape
        at = lambda w, rows: (rows @ w[self.dofs].reshape(e, a, -1)).reshape(e, g, 3, -1)
        fields = at(u, self.N), at(u, lines.slope), at(du, self.N)
        return tuple(np.ascontiguousarray(f.swapaxes(2, 3)) for f in fields)  # type: ignore[return-value]

    def _forces(self, by_x: Array, by_dx: Array, by_around: Array) -> tuple[Array, Array]:
        """Forces (e, 3a, s) by u and by du/dTheta from the gradients of V by x, x' and
        dx/dTheta."""
        lines = self.lines
        e, g, s, _ = by_x.shape
        w = self.weights[..., None, None]
        at = lambda rows, f: (
            rows.swapaxes(1, 2) @ (w * f).swapaxes(2, 3).reshape(e, g, 3 * s)
        ).reshape(e, -1, s)
        return at(self.N, by_x) + at(lines.slope, by_dx), at(self.N, by_around)

    def place(self, u: Array, du: Array) -> tuple[Array, Array, Array]:
        """Deformed x, x', dx/dTheta (e, g, s, 3) on the surface."""
        x, dx, around = self._fields(u, du)
        x = x + (self.N @ self.X)[:, :, None]
        return x, dx + (self.lines.slope @ self.X)[:, :, None], around

    def force(self, u: Array, du: Array) -> tuple[Array, Array]:
        self.at = self.place(u, du)
        return self._forces(*first_around(*self.at))

    def energy(self) -> Array:
        return np.asarray((density(*self.at) * self.weights[..., None]).sum((0, 1)))

    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        return self._forces(*change(*self.at, *self._fields(u, du)))

    def tangents(self, precision: Precision) -> tuple[Array, Array, Array]:
        """Tangents (s, e, 3a, 3a) by the product with unit displacements of each element's own
        nodes."""
        lines = self.lines
        e, g, a = lines.slope.shape
        s = self.at[0].shape[2]
        K = np.zeros((3, s, e, 3 * a, 3 * a), precision)
        for b in range(a):
            for j in range(3):
                unit = np.zeros((e, g, s, 3))
                unit[..., j] = 1.0
                N, slope = self.N[:, :, b, None, None], lines.slope[:, :, b, None, None]
                zero = np.zeros_like(unit)
                by_u, _ = self._forces(*change(*self.at, unit * N, unit * slope, zero))
                mixed, _ = self._forces(*change(*self.at, zero, zero, unit * N))
                K[0, ..., 3 * b + j] = by_u.transpose(2, 0, 1)
                K[1, ..., 3 * b + j] = mixed.transpose(2, 0, 1)
        return K[0], K[1], K[2]
