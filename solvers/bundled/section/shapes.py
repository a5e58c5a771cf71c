"""The section's elements: shape functions and Gauss rules (any finite-element textbook).

Corners run counter-clockwise in the (R, Z) plane, then the midside nodes 1-2, 2-3, 3-4, 4-1, of
triangles 1-2, 2-3, 3-1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
# nodes of each face, by their places in the element and in the order of the corners
FACES_QUADRATIC = ((0, 4, 1), (1, 5, 2), (2, 6, 3), (3, 7, 0))
FACES_LINEAR = ((0, 1), (1, 2), (2, 3), (3, 0))
FACES_TRIANGLE = ((0, 1), (1, 2), (2, 0))
FACES_TRIANGLE_QUADRATIC = ((0, 3, 1), (1, 4, 2), (2, 5, 0))


@dataclass(frozen=True)
class Rule:
    """Shape functions at Gauss points: N (g, a), dN/dxi (g, a, dim), weights (g)."""

    N: np.ndarray
    dN: np.ndarray
    weights: np.ndarray


def gauss(points: int, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre points (g, dimension) and weights (g) on [-1, 1]^dimension."""
    x, w = np.polynomial.legendre.leggauss(points)
    grids = np.meshgrid(*[x] * dimension, indexing="ij")
    weights = np.meshgrid(*[w] * dimension, indexing="ij")
    return np.stack([g.ravel() for g in grids], -1), np.prod([g.ravel() for g in weights], 0)


def quad(nodes: int, points: int) -> Rule:
    """Four-node bilinear or eight-node serendipity quadrilateral with points x points Gauss."""
    xi, weights = gauss(points, 2)
    return Rule(*_quad_at(nodes, xi), weights)


def _quad_at(nodes: int, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """N and dN/dxi at points xi (p, 2)."""
    x, y = xi[:, :1], xi[:, 1:]
    a, b = CORNERS.T
    if nodes == 4:
        N = (1 + a * x) * (1 + b * y) / 4
        dN = np.stack([a * (1 + b * y) / 4, b * (1 + a * x) / 4], -1)
        return N, dN
    corner = (1 + a * x) * (1 + b * y) * (a * x + b * y - 1) / 4
    corner_x = a * (1 + b * y) * (2 * a * x + b * y) / 4
    corner_y = b * (1 + a * x) * (a * x + 2 * b * y) / 4
    s = np.array([-1.0, 1.0])  # midsides 1-2 and 3-4 lie at y = -1, 1; 2-3 and 4-1 at x = 1, -1
    flat = [(1 - x**2) * (1 + s * y) / 2, -x * (1 + s * y), s * (1 - x**2) / 2]
    steep = [(1 - s * x) * (1 - y**2) / 2, -s * (1 - y**2) / 2, -y * (1 - s * x)]
    N, dx, dy = (
        np.stack([c[:, i] for c, i in ((f, 0), (t, 0), (f, 1), (t, 1))], -1)
        for f, t in zip(flat, [steep[i] for i in range(3)], strict=True)
    )
    # steep[0] with s = -1 is the side x = +1 (2-3), s = +1 the side x = -1 (4-1)
    dN = np.stack([np.hstack([corner_x, dx]), np.hstack([corner_y, dy])], -1)
    return np.hstack([corner, N]), dN


def _of_triangle(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Areal coordinates (g, 3) and weights (g) of a half: exact to degree 1, 2 and 5 (Hammer,
    Marlowe and Stroud, 1956)."""
    if points == 1:
        return np.full((1, 3), 1 / 3), np.full(1, 1 / 2)
    orbit = lambda a: a + (1 - 3 * a) * np.eye(3)
    if points == 3:
        return orbit(1 / 6), np.full(3, 1 / 6)
    a, b = (6 - 15**0.5) / 21, (6 + 15**0.5) / 21
    areal = np.concatenate([np.full((1, 3), 1 / 3), orbit(a), orbit(b)])
    low, high = (155 - 15**0.5) / 2400, (155 + 15**0.5) / 2400
    return areal, np.array([9 / 80, *[low] * 3, *[high] * 3])


def triangle(nodes: int, points: int) -> Rule:
    """Three-node linear or six-node quadratic triangle with 1, 3 or 7 points in all."""
    areal, weights = _of_triangle(points)
    return Rule(*_triangle_at(nodes, areal), weights)


def _triangle_at(nodes: int, areal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """N and dN/dxi at areal coordinates (p, 3)."""
    slope = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])  # dL_i / dxi
    if nodes == 3:
        return areal, np.broadcast_to(slope, (len(areal), 3, 2))
    after = np.roll(areal, -1, 1)
    N = np.hstack([areal * (2 * areal - 1), 4 * areal * after])
    corner = (4 * areal - 1)[..., None] * slope
    midside = 4 * (areal[..., None] * np.roll(slope, -1, 0) + after[..., None] * slope)
    return N, np.concatenate([corner, midside], 1)


def line(nodes: int, points: int) -> Rule:
    """Two-node or three-node (end, middle, end) line with Gauss points."""
    xi, weights = gauss(points, 1)
    x = xi
    if nodes == 2:
        dN = np.broadcast_to([-0.5, 0.5], (points, 2))
        return Rule(np.hstack([1 - x, 1 + x]) / 2, dN[..., None], weights)
    N = np.hstack([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2])
    return Rule(N, np.hstack([x - 0.5, -2 * x, x + 0.5])[..., None], weights)


@dataclass(frozen=True)
class ElementType:
    """An element by its name in the deck."""

    nodes: int
    rule: Callable[[int], Rule]  # of so many Gauss points a direction, in a triangle in all
    points: int = 2  # Gauss points a direction, in a triangle in all
    mass_points: int = 2  # that integrate the mass in full
    faces: tuple[tuple[int, ...], ...] = ()  # the nodes of a solid's faces; a line has none
    # terms of the pressure in the element: 1, or 1, R and Z; 0: each point has its own
    pressures: int = 0
    hybrid: bool = False  # does not lock where rubber is incompressible

    def at(self, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A solid's N (p, a) and dN/dxi (p, a, 2) at points xi (p, 2)."""
        if len(self.faces) == 4:
            return _quad_at(self.nodes, xi)
        return _triangle_at(self.nodes, np.column_stack([1 - xi.sum(1), xi]))

    def clipped(self, xi: np.ndarray) -> np.ndarray:
        """The point xi (2,), or one of a solid's sides where it lies beyond."""
        if len(self.faces) == 4:
            return np.clip(xi, -1, 1)
        areal = np.maximum([1 - xi.sum(), *xi], 0.0)
        return np.asarray(areal[1:] / areal.sum())


TYPES = {
    "CGAX8R": ElementType(8, partial(quad, 8), 2, 3, FACES_QUADRATIC),
    "CGAX8RH": ElementType(8, partial(quad, 8), 2, 3, FACES_QUADRATIC, 3, hybrid=True),
    "CGAX8": ElementType(8, partial(quad, 8), 3, 3, FACES_QUADRATIC),
    "CGAX8H": ElementType(8, partial(quad, 8), 3, 3, FACES_QUADRATIC, 3, hybrid=True),
    "CGAX4R": ElementType(4, partial(quad, 4), 1, 2, FACES_LINEAR),
    "CGAX4RH": ElementType(4, partial(quad, 4), 1, 2, FACES_LINEAR, 1, hybrid=True),
    "CGAX4": ElementType(4, partial(quad, 4), 2, 2, FACES_LINEAR, 1),  # as ABAQUS integrates it
    "CGAX4H": ElementType(4, partial(quad, 4), 2, 2, FACES_LINEAR, 1, hybrid=True),
    "CGAX6": ElementType(6, partial(triangle, 6), 3, 7, FACES_TRIANGLE_QUADRATIC),
    # with three pressures it would lock: a thick tube of two elements across is off by 10 %, with
    # one by 0.05 %
    "CGAX6H": ElementType(6, partial(triangle, 6), 3, 7, FACES_TRIANGLE_QUADRATIC, 1, hybrid=True),
    "CGAX3": ElementType(3, partial(triangle, 3), 1, 7, FACES_TRIANGLE),
    "CGAX3H": ElementType(3, partial(triangle, 3), 1, 7, FACES_TRIANGLE, 1, hybrid=True),
    "SFMGAX2": ElementType(3, partial(line, 3)),
    "SFMGAX1": ElementType(2, partial(line, 2)),
    "MGAX2": ElementType(3, partial(line, 3)),
    "MGAX1": ElementType(2, partial(line, 2)),
}
MEMBRANES = ("MGAX1", "MGAX2")


def solids() -> list[str]:
    """The types that fill an area."""
    return [name for name, kind in TYPES.items() if kind.faces]
