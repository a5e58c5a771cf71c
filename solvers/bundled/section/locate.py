"""In which element of a mesh a point lies, and where in it: the inverse isoparametric map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .shapes import TYPES, ElementType

Array = np.ndarray
MAX_MAPPING_STEPS = 20  # of Newton's method for xi
XI_SETTLED = 1e-9  # a step below this ends it: the error is the square of a step
FAR_XI = 10.0  # beyond this Newton's method is given up
BULGE = 0.2  # of an element's size, by which curved sides leave the box of its corners
SAME_DISTANCE = 1e-12  # m: of two elements as near the first is taken


@dataclass(frozen=True)
class Host:
    """The element in which a point lies or, within a tolerance, to which it is nearest."""

    kind: ElementType
    nodes: Array  # (a,): rows of the mesh
    xi: Array  # (2,): natural coordinates
    distance: float  # of the point from the element, m; 0 inside


def hosts_of(
    places: Array, X: Array, elements: Mapping[str, Array], tolerance: float
) -> list[Host | None]:
    """The host of each of the ``places`` (p, 2), m, among ``elements``, type to rows (e, a) of
    nodes X (n, 2); None where none is near ``tolerance``, m."""
    best: list[Host | None] = [None] * len(places)
    for name, rows in elements.items():
        kind, corners = TYPES[name], X[rows]
        low, high = corners.min(1), corners.max(1)
        slack = tolerance + BULGE * (high - low).max(1)
        beyond = np.maximum(low - places[:, None], places[:, None] - high).max(2)
        point, element = np.nonzero(beyond < slack)
        xi = _inverse(kind, corners[element], places[point])
        inside = kind.clipped(xi)
        image = (kind.at(inside)[0][..., None] * corners[element]).sum(1)
        away = np.hypot(*(image - places[point]).T)
        for i, e, at, distance in zip(point, element, xi, away, strict=True):
            known = best[i]
            if distance < (known.distance - SAME_DISTANCE if known else np.inf):
                best[i] = Host(kind, rows[e], at, float(distance))
    return best


def mapping_step(kind: ElementType, corners: Array, places: Array, xi: Array) -> Array:
    """Newton's step of xi (p, 2) towards ``places`` (p, 2) in elements ``corners`` (p, a, 2); nan
    where the element is degenerate."""
    N, dN = kind.at(xi)
    tangent = np.swapaxes(corners, 1, 2) @ dN  # dX_j / dxi_k
    off = places - (N[..., None] * corners).sum(1)
    (a, b), (c, d) = np.moveaxis(tangent, 0, 2)
    det = a * d - b * c
    with np.errstate(divide="ignore", invalid="ignore"):
        return (
            np.stack([d * off[:, 0] - b * off[:, 1], a * off[:, 1] - c * off[:, 0]], 1)
            / (det[:, None])
        )


def _inverse(kind: ElementType, corners: Array, places: Array) -> Array:
    """xi (p, 2) of points of the isoparametric map, by Newton's method; nan where it does not
    settle."""
    xi = np.full((len(places), 2), 0.25 if len(kind.faces) == 3 else 0.0)  # about the middle
    moving = np.arange(len(places))
    for _ in range(MAX_MAPPING_STEPS):
        step = mapping_step(kind, corners[moving], places[moving], xi[moving])
        xi[moving] += step
        with np.errstate(invalid="ignore"):
            lost = ~(abs(xi[moving]).max(1, initial=0.0) <= FAR_XI)
        xi[moving[lost]] = np.nan
        moving = moving[~lost & (abs(step).max(1, initial=0.0) >= XI_SETTLED)]
        if not len(moving):
            break
    xi[moving] = np.nan
    return xi
