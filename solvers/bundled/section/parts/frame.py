"""Products of vectors in the cylindrical frame of the reference angle: r, theta, z."""

from __future__ import annotations

import numpy as np

Array = np.ndarray
IN_PLANE = np.diag([1.0, 1.0, 0.0])  # of the wheel
SPIN_AXIS = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # e_z x


def cross(a: Array, b: Array) -> Array:
    """a x b over the last axis; np.cross spends ten times as long on its arguments."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)
