"""Shares of the variance: a closed form, a grid, and scipy's estimate from samples."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.studies import variance_shares as module
from tyrecal.studies.emulator import fitted, spread, up_to
from tyrecal.studies.variance_shares import variance_shares

from ..chance import generator
from .test_emulator import MODES, made, meeting, polynomial

pytestmark = pytest.mark.numbers


def test_shares_of_a_polynomial_are_those_of_its_terms() -> None:
    """ln f = 4 + 0.3 P1(s) + 0.1 P2(s) + 0.2 P1(t) + 0.05 P1(s) P1(t), and one that is constant;
    a product of P_i and P_j has the mean square 1 / (2 i + 1) / (2 j + 1)."""
    degrees = up_to(2, 2)
    terms = {(0, 0): 4.0, (1, 0): 0.3, (2, 0): 0.1, (0, 1): 0.2, (1, 1): 0.05}
    a = np.zeros((len(degrees), 2))
    a[:, 0] = [terms.get(tuple(each), 0.0) for each in degrees.tolist()]
    a[0, 1] = 3.0
    centre, half = generator("box").normal(size=2), np.array([0.3, 2.0])
    emulated = fitted((), MODES, centre, half, polynomial(degrees, a, spread(9, 2), centre, half))
    first, total, variance = variance_shares(emulated)
    s, t, both = 0.3**2 / 3 + 0.1**2 / 5, 0.2**2 / 3, 0.05**2 / 9
    assert variance[0] == pytest.approx(s + t + both)
    assert first[0] == pytest.approx(np.array([s, t]) / (s + t + both))
    assert total[0] == pytest.approx(np.array([s + both, t + both]) / (s + t + both))
    assert variance[1] < 1e-20


def test_the_grid_gives_the_shares_of_the_coefficients() -> None:
    emulated = made(meeting())
    assert emulated.pair is not None
    first, total, variance = variance_shares(emulated)
    for place in {*range(len(emulated.labels))} - {*emulated.pair}:
        one, whole, scale = module._on_a_grid(emulated, place)
        assert scale == pytest.approx(variance[place])
        assert one / scale == pytest.approx(first[place], abs=1e-6)
        assert whole / scale == pytest.approx(total[place], abs=1e-6)


@pytest.mark.slow
def test_shares_are_within_0_01_of_those_of_samples() -> None:
    """The two [0,0] modes cross in the box, where a polynomial would be far off."""
    from scipy.stats import sobol_indices, uniform

    emulated = made(meeting())
    ends = [uniform(low, high - low) for low, high in emulated.box]
    drawn = sobol_indices(func=lambda x: emulated.ln_f(x.T).T, n=2**11, dists=ends, rng=1)
    first, total, _ = variance_shares(emulated)
    assert abs(first - drawn.first_order).max() < 0.01
    assert abs(total - drawn.total_order).max() < 0.01
