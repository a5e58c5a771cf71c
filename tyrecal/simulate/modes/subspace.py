"""Modal assurance: how far two shapes, or two spans of shapes, are the same.

For shapes a, b: MAC = |a^H b|^2 / (a^H a  b^H b), the squared cosine of their angle. For spans,
the squared cosines of their principal angles: the smallest is 1 only if one span holds the other.
"""

from __future__ import annotations

import numpy as np

from ..evaluate.results import HarmonicShape

Array = np.ndarray
SAME_SHAPE = 1e-8  # singular value, over the largest, below which a shape adds nothing to a span


def mac(a: HarmonicShape, b: HarmonicShape) -> float:
    """MAC of two shapes on the same nodes, 0 to 1; 0 for different harmonics.

    The product is complex, so a phase, which turns a pair round the tyre, changes nothing: for
    harmonics n >= 1 this is the MAC of the two pairs' spans.

    Raises ValueError when the nodes differ.
    """
    if not np.array_equal(a.nodes, b.nodes):
        raise ValueError(f"MAC needs the same nodes, got {len(a.nodes)} and {len(b.nodes)}")
    if a.n != b.n:
        return 0.0
    x, y = a.amplitude.ravel(), b.amplitude.ravel()
    return float(abs(np.vdot(x, y)) ** 2 / (np.vdot(x, x).real * np.vdot(y, y).real))


def squared_cosines(a: Array, b: Array) -> Array:
    """Squared cosines of the principal angles between the spans of the real shapes in the columns
    of a and b, a row for each signal, the largest first; none if either is zero. One column each:
    their MAC; one and a pair: the MAC of a shape with the plane of the pair."""
    cosines = np.linalg.svd(_basis(a).T @ _basis(b), compute_uv=False)
    return np.asarray(np.minimum(1.0, cosines**2))


def _basis(shapes: Array) -> Array:
    """Orthonormal basis (signal, vector) of the columns."""
    basis, size, _ = np.linalg.svd(shapes, full_matrices=False)
    return np.asarray(basis[:, size > SAME_SHAPE * size.max()])
