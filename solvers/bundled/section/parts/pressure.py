"""Follower pressure on the inner surface, as the potential -p V of the enclosed volume.

Per radian, with x = (x_r, x_theta, x_z) in the cylindrical frame of the reference angle,
' = d/ds along the section and D = d/dTheta + e_z x:

    V = 1/2 int (x_r, x_theta, 0) . (x' x Dx) ds

The gauge (x_r, x_theta, 0)/2 makes the second variation symmetric also at open ends.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray

IN_PLANE = np.diag([1.0, 1.0, 0.0])
SPIN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # e_z x


def _cross(a: Array) -> Array:
    """Matrices [a] with [a] b = a x b, (p, 3, 3)."""
    X = np.zeros((*a.shape, 3), a.dtype)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        X[..., i, j] = -a[..., k]
        X[..., j, i] = a[..., k]
    return X


def cross(a: Array, b: Array) -> Array:
    """a x b over the last axis; np.cross spends ten times as long on its arguments."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


def volume(x: Array, dx: Array, weights: Array) -> Array:
    """V per radian (m3) from x, x' (p, 3) at Gauss points with their weights."""
    return np.asarray((weights * density(x, dx, 0.0)).sum())


def first(x: Array, dx: Array) -> tuple[Array, Array]:
    """Gradients of the integrand of V with respect to x and to x', each (p, 3)."""
    by_x, by_dx, _ = first_around(x, dx, 0.0)
    return by_x, by_dx


def second(x: Array, dx: Array) -> tuple[Array, Array, Array]:
    """Second variation for a perturbation u exp(i n Theta): blocks over (u, u'), (p, 3, 3).

    u^H Q u with Q = xx (u, u) + xd (u, u') + n-linear terms. Returns
    (xx, xd, dx_n): xx and xd at n = 0 with the whole Q not yet symmetrised, and the pair
    (n-linear u-u block, n-linear u'-u block) stacked in ``dx_n`` (..., 2, 3, 3), times i n.
    """
    y, d = x @ IN_PLANE, x @ SPIN.T
    along = IN_PLANE @ _cross(dx)
    xx = along @ SPIN
    xd = -IN_PLANE @ _cross(d) - (_cross(y) @ SPIN).swapaxes(-1, -2)
    return xx, xd, np.stack([along, -_cross(y)], -3)


def density(x: Array, dx: Array, around: Array | float) -> Array:
    """V's integrand (...) from x, x' and ``around`` = dx/dTheta."""
    y, d = x @ IN_PLANE, around + x @ SPIN.T
    return np.asarray((y * cross(dx, d)).sum(-1) / 2)


def first_around(x: Array, dx: Array, around: Array | float) -> tuple[Array, Array, Array]:
    """Gradients of V's integrand by x, x' and ``around`` = dx/dTheta, each (..., 3)."""
    y, d = x @ IN_PLANE, around + x @ SPIN.T
    by_around = cross(y, dx)
    by_x = cross(dx, d) @ IN_PLANE + by_around @ SPIN
    return by_x / 2, cross(d, y) / 2, by_around / 2


def change(
    x: Array, dx: Array, around: Array, u: Array, du: Array, u_around: Array
) -> tuple[Array, Array, Array]:
    """Change of `first_around` with a small displacement u, u', du/dTheta (..., 3)."""
    y, d = x @ IN_PLANE, around + x @ SPIN.T
    v, e = u @ IN_PLANE, u_around + u @ SPIN.T
    by_around = cross(v, dx) + cross(y, du)
    by_x = (cross(du, d) + cross(dx, e)) @ IN_PLANE + by_around @ SPIN
    return by_x / 2, (cross(e, y) + cross(d, v)) / 2, by_around / 2
