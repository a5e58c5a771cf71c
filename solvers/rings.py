"""Modes at nodes round a tyre, in cylindrical components.

Axes: y is the axle. Theta turns about +y, from the x axis on: a node lies at (R cos Theta, Z,
-R sin Theta). That sense is an assumption, but no result depends on it: Theta is taken from the
nodes' own coordinates, and (r, theta, z) is right-handed either way.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .errors import RunFailed

Array = np.ndarray
WIDEST_GAP = np.pi / 2  # between neighbours round the axle, rad
FLAT = 1e-9  # of the radius: a line across the axle


def about_axle(points: Array) -> tuple[Array, Array]:
    """Points (k, 3) of a crown about its own axle, as y from the crown's middle, and the turn
    (3, 3) that vectors take with them.

    The axle is the direction in which the crown is narrowest, through the centre (a, b) of the
    circle x^2 + z^2 = 2 a x + 2 b z + c that fits it best; its sense is arbitrary.
    """
    middle = points.mean(0)
    _, _, (first, _, axle) = np.linalg.svd(points - middle, full_matrices=False)
    turn = np.array([first, axle, np.cross(first, axle)])
    x, y, z = turn @ (points - middle).T
    equations = np.column_stack([2 * x, 2 * z, np.ones_like(x)])
    a, b, _ = np.linalg.lstsq(equations, x**2 + z**2, rcond=None)[0]
    y = y - (y.min() + y.max()) / 2
    y[abs(y) < FLAT * abs(x).max()] = 0.0
    return np.column_stack([x - a, y, z - b]), turn


def cylindrical(points: Array) -> Array:
    """R (m), Theta (rad), Z (m) of points (k, 3) given in x, y, z."""
    x, y, z = points.T
    return np.column_stack([np.hypot(x, z), np.arctan2(-z, x), y])


def check_revolved(points: Array) -> None:
    """Raises RunFailed unless points (k, 3) R, Theta, Z of the crown surround the axle.

    They do not if the revolve has another axle than y, or leaves the node set in the section.
    """
    R, theta, _ = points.T
    angles = np.sort(theta)
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    if R.min() < R.max() / 2 or gaps.max() > WIDEST_GAP:
        raise RunFailed(
            "no_results", "the nodes with shapes are not round the axle, as those of a crown are"
        )


def components(vectors: Array, theta: Array) -> Array:
    """r, theta, z of vectors (..., k, 3) in x, y, z at nodes of angle ``theta`` (k,)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    cos, sin = np.cos(theta), np.sin(theta)
    return np.stack([x * cos - z * sin, -x * sin - z * cos, y], -1)


def ring_modes(
    eigenvalues: Array, points: Array, displacement: Array
) -> tuple[Array, list[dict[str, Any]]]:
    """R, Theta, Z (k, 3) of points about y, and a mode for each eigenvalue, 1/s2, with
    ``displacement`` (m, k, 3), as the tool wants them. Raises RunFailed."""
    places = cylindrical(points)
    check_revolved(places)
    shapes = components(displacement, places[:, 1])
    return places, [
        {
            "frequency_Hz": float(np.sqrt(value) / (2 * np.pi)),
            "multiplicity": 1,
            "displacement": shape,
        }
        for value, shape in zip(eigenvalues, shapes, strict=True)
    ]
