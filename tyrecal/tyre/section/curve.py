"""A curve of the section, given by points."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def length_along(points: Array) -> Array:
    """Length along a polygon (n, 2) to each of its points (n,), m; 0 at the first."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
