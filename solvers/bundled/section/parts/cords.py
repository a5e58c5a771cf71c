"""Cords of a rebar layer, one-dimensional in logarithmic strain.

A cord along the reference unit vector a is carried to q = F a, its stretch is lambda = |q|:

    W = E A / (2 s) ln^2(lambda)            per reference area of the layer, J/m2
    dW/dq = W' t,  d2W/dqdq = (W'' - W'/lambda) t t^T + (W'/lambda) 1,   t = q / lambda
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def stretch(q: Array) -> Array:
    """lambda (p,) of the cord vectors q (p, 3); complex q allowed."""
    return np.sqrt((q * q).sum(-1))


def energy(q: Array, stiffness: Array) -> Array:
    """W (p,) for ``stiffness`` = E A / s (N/m)."""
    return stiffness * np.log(stretch(q)) ** 2 / 2


def force(q: Array, stiffness: Array) -> Array:
    """dW/dq (p, 3), N/m."""
    length = stretch(q)
    return (stiffness * np.log(length) / length**2)[:, None] * q


def tangent(q: Array, stiffness: Array) -> Array:
    """d2W/dqdq (p, 3, 3), N/m."""
    length = stretch(q)
    log = np.log(length)
    along = stiffness * (1 - 2 * log) / length**4
    D = along[:, None, None] * q[:, :, None] * q[:, None, :]
    D += (stiffness * log / length**2)[:, None, None] * np.eye(3)
    return D
