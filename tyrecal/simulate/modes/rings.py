"""Harmonic shapes sampled on rings of points, and back; and modal assurance, how far two shapes, or
two spans of shapes, are the same.

For shapes a, b: MAC = |a^H b|^2 / (a^H a  b^H b), the squared cosine of their angle. For spans,
the squared cosines of their principal angles: the smallest is 1 only if one span holds the other.

`follow` follows modes by shape from one state of a tyre to the next, without a look at their
labels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..evaluate.results import HarmonicShape, RingShape
from .label import Label, Mode

Array = np.ndarray


def on_rings(shape: HarmonicShape, nodes: Array, angles: Array, phase: float = 0.0) -> RingShape:
    """Re[amplitude exp(i (n Theta + phase))] (`HarmonicShape`) on one ring of points per node.

    nodes (k,): deck numbers; angles (a,): Theta in rad; phase in rad: 0 and pi/2 give the two
    halves of a pair (on n = 0 leave it at 0, there it scales a real amplitude). Returns k * a
    points, ring after ring.

    Raises ValueError for a node that the shape does not have.
    """
    row = {int(node): k for k, node in enumerate(shape.nodes)}
    unknown = [int(node) for node in nodes if int(node) not in row]
    if unknown:
        raise ValueError(f"the shape has no node {unknown[0]}")
    rows = [row[int(node)] for node in nodes]
    turn = np.exp(1j * (shape.n * np.asarray(angles, float) + phase))
    displacement = (shape.amplitude[rows, None, :] * turn[:, None]).real
    R, Z = np.repeat(shape.points[rows], len(turn), axis=0).T
    points = np.column_stack([R, np.tile(angles, len(rows)), Z])
    return RingShape(points, displacement.reshape(-1, 3))


def harmonic_of(shape: RingShape, n: int) -> HarmonicShape:
    """The harmonic shape of which ``shape`` is a sample, by least squares ring by ring.

    Rings: points of one R and Z (to 10 micrometres); its nodes are the rings' numbers from 0. One
    half of a pair tells the whole amplitude, except its phase. A component that was not measured
    on a ring is 0 there.
    """
    places, ring = np.unique(np.round(shape.points[:, [0, 2]], 5), axis=0, return_inverse=True)
    angle = n * shape.points[:, 1]
    basis = np.column_stack([np.cos(angle), -np.sin(angle)])
    amplitude = np.zeros((len(places), 3), complex)
    for k in range(len(places)):
        for component, u in enumerate(shape.displacement.T):
            rows = (ring.ravel() == k) & np.isfinite(u)
            if rows.any():
                real, imaginary = np.linalg.lstsq(basis[rows], u[rows], rcond=None)[0]
                amplitude[k, component] = real + 1j * imaginary
    return HarmonicShape(n, np.arange(len(places)), places, amplitude)


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


@dataclass(frozen=True)
class Step:
    """Where a shape went: it has the label ``before`` in one state and ``after`` in the next.

    mac: of the two shapes, 0 to 1.
    """

    before: Label
    after: Label
    mac: float


def follow(before: Sequence[Mode], after: Sequence[Mode]) -> list[Step]:
    """A step per mode of ``before`` that has a partner in ``after``: harmonic by harmonic, the
    one-to-one assignment with the largest sum of MACs. All modes on the same points.

    A sampled shape is taken as its pair (``harmonic_of``): turned by any angle it is the same.
    Raises ValueError when the points differ.
    """
    from scipy.optimize import linear_sum_assignment  # late: longer than most evaluations

    steps = []
    for c in sorted({mode.label.c for mode in before} & {mode.label.c for mode in after}):
        old, new = ([mode for mode in modes if mode.label.c == c] for modes in (before, after))
        x, y = ([_harmonic(mode) for mode in modes] for modes in (old, new))
        macs = np.array([[mac(a, b) for b in y] for a in x])
        for i, j in zip(*linear_sum_assignment(macs, maximize=True), strict=True):
            steps.append(Step(old[i].label, new[j].label, float(macs[i, j])))
    return steps


def _harmonic(mode: Mode) -> HarmonicShape:
    shape = mode.raw.shape
    return shape if isinstance(shape, HarmonicShape) else harmonic_of(shape, mode.label.c)
