"""Harmonic shapes sampled on rings of points, and back."""

from __future__ import annotations

import numpy as np

from ..evaluate.results import HarmonicShape, RingShape

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
