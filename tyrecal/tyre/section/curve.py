"""Curves of the section: a polygon's length, and the cubic spline through the stations.

SciPy has a spline too, but importing it takes as long as half an answer from the record.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def length_along(points: Array) -> Array:
    """Length along a polygon (n, 2) to each of its points (n,), m; 0 at the first."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


class CubicSpline:
    """The twice differentiable piecewise cubic through points ``y`` (n, ...) at rising ``x`` (n,).

    With its slopes d at the points, h = x[i+1] - x[i] and m = (y[i+1] - y[i]) / h, an interval's
    third derivative is 6 (d[i] + d[i+1] - 2 m[i]) / h[i]^2. It is the same on both sides of the
    second and of the last but one point ("not a knot"), and 0 for three points or fewer.
    start: the slope d[0] (...) instead; the second derivative then is 0 at the end.
    de Boor, A Practical Guide to Splines, chapter IV.
    """

    def __init__(self, x: Array, y: Array, start: Array | None = None):
        self.x, self.y = np.asarray(x, float), np.asarray(y, float)
        n, h = len(self.x), np.diff(self.x)
        m = np.diff(self.y, axis=0) / h.reshape(-1, *[1] * (self.y.ndim - 1))
        A, b = np.zeros((n, n)), np.zeros_like(self.y)
        for i in range(1, n - 1):  # the second derivative is continuous
            A[i, i - 1 : i + 2] = 1 / h[i - 1], 2 / h[i - 1] + 2 / h[i], 1 / h[i]
            b[i] = 3 * (m[i - 1] / h[i - 1] + m[i] / h[i])
        if start is not None:
            A[0, 0], b[0] = 1.0, start
            A[-1, -2:], b[-1] = (1.0, 2.0), 3 * m[-1]
        elif n > 3:
            for row, i in ((0, 0), (-1, n - 3)):
                p, q = h[i] ** -2, h[i + 1] ** -2
                A[row, i : i + 3] = p, p - q, -q
                b[row] = 2 * (p * m[i] - q * m[i + 1])
        else:
            bent = float(n > 2)  # two points: d = m
            A[0, :2], b[0] = (1.0, bent), (1 + bent) * m[0]
            A[-1, -2:], b[-1] = (bent, 1.0), (1 + bent) * m[-1]
        self.slope: Array = np.linalg.solve(A, b.reshape(n, -1)).reshape(b.shape)

    def __call__(self, at: Array) -> Array:
        """Points (len(at), ...); beyond the ends the outer cubics run on."""
        at = np.asarray(at, float)
        i = np.clip(np.searchsorted(self.x, at, side="right") - 1, 0, len(self.x) - 2)
        shape = (-1, *[1] * (self.y.ndim - 1))
        h = (self.x[i + 1] - self.x[i]).reshape(shape)
        t = (at - self.x[i]).reshape(shape) / h
        y0, y1, d0, d1 = self.y[i], self.y[i + 1], h * self.slope[i], h * self.slope[i + 1]
        result: Array = (
            y0 + t * d0 + t**2 * (3 * (y1 - y0) - 2 * d0 - d1) + t**3 * (2 * (y0 - y1) + d0 + d1)
        )
        return result
