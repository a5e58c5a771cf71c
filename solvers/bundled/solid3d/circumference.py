"""Finite elements round the circumference, of three nodes each: functions of the angle alone.

The span of an element's functions is {1, cos, sin}, as in cylindrical bricks: a circle and every
shift and small turn of a rigid body are exact at any element length (displacements are components
in the frame of the reference angle).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Circumference:
    """Half the tyre's way round, from the road's side (angle 0) to the top (pi)."""

    angles: Array  # (k,) of the nodes, rad
    N: Array  # (s, k): functions at Gauss stations
    slope: Array  # (s, k): their derivatives by the angle
    weights: Array  # (s,), rad
    shares: Array  # (k,): integrals of the functions, rad
    stations: tuple[slice, ...]  # of each element


def points(length: float) -> int:
    """Gauss points of an element: two would leave some motions without stiffness, and long
    elements must see the resultant of a uniform pressure vanish."""
    return 3 + int(length / 0.2)


def half_circle(lengths: Array) -> Circumference:
    """Elements of ``lengths`` (rad) from angle 0 on; they sum to pi."""
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    angles = np.empty(2 * len(lengths) + 1)
    angles[::2], angles[1::2] = ends, (ends[:-1] + ends[1:]) / 2
    counts = [points(length) for length in lengths]
    edges = np.concatenate([[0], np.cumsum(counts)])
    stations = tuple(slice(int(a), int(b)) for a, b in pairwise(edges))
    N, slope = np.zeros((2, edges[-1], len(angles)))
    weights = np.empty(edges[-1])
    for i, (length, rows) in enumerate(zip(lengths, stations, strict=True)):
        xi, w = np.polynomial.legendre.leggauss(counts[i])
        cols = slice(2 * i, 2 * i + 3)
        N[rows, cols], slope[rows, cols] = functions(xi * length / 2, length / 2)
        weights[rows] = w * length / 2
    return Circumference(angles, N, slope, weights, weights @ N, stations)


def functions(angle: Array, half: float) -> tuple[Array, Array]:
    """The three functions and their derivatives (p, 3) at angles from the element's middle."""
    bulge, dbulge = (1 - np.cos(angle)) / (1 - np.cos(half)), np.sin(angle) / (1 - np.cos(half))
    tilt, dtilt = np.sin(angle) / np.sin(half), np.cos(angle) / np.sin(half)
    values = [(bulge - tilt) / 2, 1 - bulge, (bulge + tilt) / 2]
    return np.stack(values, -1), np.stack([(dbulge - dtilt) / 2, -dbulge, (dbulge + dtilt) / 2], -1)
