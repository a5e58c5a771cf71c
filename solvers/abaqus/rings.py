"""Vectors at the revolved tyre's nodes in cylindrical components.

Axes: the deck revolves its section about y, from x. With Theta turning about +y a node lies at
(R cos Theta, Z, -R sin Theta). That sense is an assumption, but no result depends on it: Theta
is taken from the nodes' own coordinates, and (r, theta, z) is right-handed either way.
"""

from __future__ import annotations

import numpy as np

from ..errors import RunFailed

Array = np.ndarray


def cylindrical(points: Array) -> Array:
    """R (m), Theta (rad), Z (m) of points (k, 3) given in x, y, z."""
    x, y, z = points.T
    return np.column_stack([np.hypot(x, z), np.arctan2(-z, x), y])


def check_revolved(points: Array) -> None:
    """Raises RunFailed unless points (k, 3) R, Theta, Z of the crown surround the axle.

    They do not if the revolve has another axle than y, or leaves the node set in the section.
    """
    R, theta, _ = points.T
    if R.min() < R.max() / 2 or abs(np.exp(1j * theta).mean()) > 0.1:
        raise RunFailed(
            "no_results",
            "the nodes with shapes do not lie round the y axis, as a revolved crown does",
        )


def components(vectors: Array, theta: Array) -> Array:
    """r, theta, z of vectors (..., k, 3) in x, y, z at nodes of angle ``theta`` (k,)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    cos, sin = np.cos(theta), np.sin(theta)
    return np.stack([x * cos - z * sin, -x * sin - z * cos, y], -1)
