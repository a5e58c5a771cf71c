"""Bounds of a stuck patch, on the coarse mesh."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.tyre.case.variables import with_level
from tyrecal.tyre.load import load_case

from .stuck_patch import CASE, Compliance, table


def test_compliance_of_a_single_mode() -> None:
    """The compliance of a known mode is 1 / (lambda - omega^2) at any frequency; without the
    mode it is right to third order in omega^2 / lambda."""
    static, inertia = np.array([[1 / 4.0]]), np.array([[1 / 16.0]])
    known = Compliance(static, inertia, np.array([4.0]), np.ones((1, 1)))
    unknown = Compliance(static, inertia, np.zeros(0), np.zeros((1, 0)))
    for value in (0.4, 3.0, 9.0):
        assert known.of(value)[0, 0] == pytest.approx(1 / (4 - value), rel=1e-12)
    for value in (0.4, 0.2):
        off = unknown.of(value)[0, 0] * (4 - value) - 1
        assert off == pytest.approx(-((value / 4) ** 2), rel=1e-9)


@pytest.mark.slow
def test_bounds_rise_with_the_load() -> None:
    """The free frequency below the lower bound, that below the upper; a larger patch holds more."""
    bounds = table([100.0, 1000.0], with_level(load_case(CASE), "coarse"))
    for label, (free, lower, upper) in bounds[100.0].items():
        assert free < lower < upper
        assert lower < bounds[1000.0][label][1] and upper < bounds[1000.0][label][2]
