"""The spline through stations: what it reproduces, its smoothness and ends, and SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import interpolate

from tyrecal.tyre.section.spline import CubicSpline

from ..chance import generator

SOMEWHERE = np.linspace(-0.3, 6.3, 45)  # also beyond the ends


def stations(count: int) -> np.ndarray:
    """Unequal steps from 0 to 6."""
    return np.insert(6 * np.cumsum(x := 1 + np.arange(count - 1) % 3) / x.sum(), 0, 0.0)


@pytest.mark.parametrize("count", [2, 3, 4, 5, 9])
def test_polynomials_are_reproduced(count: int) -> None:
    """Straight through two stations, a parabola through three, a cubic through four or more."""
    curve = np.polynomial.Polynomial([0.3, -1.2, 0.7, 0.11][:count])
    x = stations(count)
    spline = CubicSpline(x, np.stack([curve(x), -2 * curve(x)], -1))
    expected = np.stack([curve(SOMEWHERE), -2 * curve(SOMEWHERE)], -1)
    assert spline(SOMEWHERE) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert spline.slope[:, 0] == pytest.approx(curve.deriv()(x), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("count", [2, 3, 6, 14])
@pytest.mark.parametrize("clamped", [False, True])
def test_as_scipy(count: int, clamped: bool) -> None:
    x, y = stations(count), generator("spline", count).normal(size=(count, 3, 2))
    start = np.arange(6.0).reshape(3, 2) if clamped else None
    ends = ((1, start), (2, np.zeros((3, 2)))) if clamped else "not-a-knot"
    theirs = interpolate.CubicSpline(x, y, bc_type=ends)
    ours = CubicSpline(x, y, start)
    assert ours(SOMEWHERE) == pytest.approx(theirs(SOMEWHERE), rel=1e-10, abs=1e-10)
    assert ours.slope == pytest.approx(theirs(x, 1), rel=1e-10, abs=1e-10)
