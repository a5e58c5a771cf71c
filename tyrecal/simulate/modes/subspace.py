"""Modal assurance: how far two shapes, or two spans of shapes, are the same.

For shapes a, b: MAC = |a^H b|^2 / (a^H a  b^H b), the squared cosine of their angle. For spans,
the smallest squared cosine of their principal angles: 1 only when one span holds the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..evaluate.results import HarmonicShape, RingShape

Array = np.ndarray


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


def subspace_mac(a: Sequence[RingShape], b: Sequence[RingShape]) -> float:
    """Smallest squared cosine of the principal angles between two spans of real shapes, 0 to 1.

    One shape each: their MAC. All on the same points in the same order; components that any of
    them lacks are left out.

    Raises ValueError when the points differ, or the shapes of one span depend on each other.
    """
    first = a[0].points
    if any(not np.array_equal(shape.points, first) for shape in (*a, *b)):
        raise ValueError("MAC needs shapes on the same points in the same order")
    u = np.array([shape.displacement.ravel() for shape in (*a, *b)]).T
    u = u[np.isfinite(u).all(axis=1)]
    cosines = np.linalg.svd(_basis(u[:, : len(a)]).T @ _basis(u[:, len(a) :]), compute_uv=False)
    return float(min(1.0, cosines.min() ** 2))


def _basis(shapes: Array) -> Array:
    """Orthonormal basis of the columns."""
    basis, size, _ = np.linalg.svd(shapes / np.linalg.norm(shapes, axis=0), full_matrices=False)
    if len(size) < shapes.shape[1] or size[-1] < 1e-8:
        raise ValueError(f"{shapes.shape[1]} shapes span fewer dimensions than they are")
    return basis
