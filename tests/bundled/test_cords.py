"""The cord law W = (EA / 2s) ln^2(lambda): consistency, invariance, uniaxial stretch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import qr
from tyrecal_solvers.bundled.section.parts.cords import TRANSITION, LogarithmicCord

Array = np.ndarray
H = 1e-30
STIFFNESS = np.array([1e5, 2e6, 3e7, 4e6])
CORD = LogarithmicCord(STIFFNESS)


@pytest.fixture
def q(random: np.random.Generator) -> Array:
    return random.normal(size=(4, 3)) * 0.2 + [0.9, 0.3, -0.4]


def close(got: Array, wanted: Array, tolerance: float = 1e-13) -> None:
    assert abs(got - wanted).max() <= tolerance * abs(wanted).max()


def test_force_and_tangent_by_complex_step(q: Array) -> None:
    """f = dW/dq and D = df/dq, D symmetric."""
    steps = np.eye(3) * 1j * H
    force = np.stack([CORD.energy(q + s).imag / H for s in steps], -1)
    close(CORD.force(q), force)
    D = np.stack([CORD.force(q + s).imag / H for s in steps], -1)
    close(CORD.tangent(q), D)
    close(CORD.tangent(q), D.swapaxes(1, 2))


def test_a_cord_that_bears_no_compression_is_slack_below_its_length(q: Array) -> None:
    """W, f and D are 0 there, and those of any cord above it, less a constant of W."""
    one = replace(CORD, compressed=np.array([0.0, 0.0, 1.0, 1.0]))
    q *= (np.array([0.9, 1.1, 0.9, 1.1]) / np.sqrt((q * q).sum(-1)))[:, None]
    for got, any_cord in ((one.energy, CORD.energy), (one.force, CORD.force), (one.tangent,) * 2):
        assert not got(q)[0].any()
        np.testing.assert_array_equal(got(q)[2:], any_cord(q)[2:])
    np.testing.assert_array_equal(one.force(q)[1], CORD.force(q)[1])
    np.testing.assert_array_equal(one.tangent(q)[1], CORD.tangent(q)[1])
    constant = STIFFNESS[1] * TRANSITION**2 / 10
    assert one.energy(q)[1] == pytest.approx(CORD.energy(q)[1] + constant, rel=1e-14)


@pytest.mark.parametrize("share", [-1.001, -0.999, -0.3, 0.0, 0.8, 0.999, 1.001])
def test_a_cord_goes_slack_smoothly(q: Array, share: float) -> None:
    """Force and tangent are derivatives by complex steps throughout, and all three are continuous:
    next to the ends of the transition they are those of the ends."""
    slack = replace(CORD, compressed=np.zeros(4))
    direction = q / np.sqrt((q * q).sum(-1))[:, None]
    at = np.exp(share * TRANSITION) * direction
    steps = np.eye(3) * 1j * H
    force = np.stack([slack.energy(at + s).imag / H for s in steps], -1)
    np.testing.assert_allclose(slack.force(at), force, rtol=1e-11, atol=1e-9)
    D = np.stack([slack.force(at + s).imag / H for s in steps], -1)
    np.testing.assert_allclose(slack.tangent(at), D, rtol=1e-11, atol=1e-4)
    end = np.exp(np.sign(share) * TRANSITION) * direction
    if abs(abs(share) - 1) < 0.01:
        for law in (slack.energy, slack.force, slack.tangent):
            largest = abs(law(np.exp(TRANSITION) * direction)).max()
            assert abs(law(at) - law(end)).max() < 2e-3 * largest


def test_an_artificial_tension_holds_every_direction_alike(q: Array) -> None:
    """The artificial tension has no energy and no force, but a tangent, with its weight."""
    taut, weights = CORD.tautened(7.0), np.array([1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(taut.energy(q), CORD.energy(q))
    np.testing.assert_array_equal(taut.force(q), CORD.force(q))
    more = taut.tangent(q, weights) - CORD.tangent(q, weights)
    np.testing.assert_allclose(more, 7 * weights[:, None, None] * np.eye(3), atol=1e-6)
    np.testing.assert_allclose(
        CORD.tangent(q, weights), weights[:, None, None] * CORD.tangent(q), rtol=1e-14
    )


def test_frame_indifference(q: Array, random: np.random.Generator) -> None:
    """W(Qq) = W(q), f(Qq) = Q f(q), D(Qq) = Q D(q) Q^T for a rotation Q."""
    Q = qr(random.normal(size=(3, 3)))[0]
    close(CORD.energy(q @ Q.T), CORD.energy(q))
    close(CORD.force(q @ Q.T), CORD.force(q) @ Q.T)
    close(CORD.tangent(q @ Q.T), Q @ CORD.tangent(q) @ Q.T)


@pytest.mark.parametrize("stretch", [0.9, 1.0, 1.2])
def test_uniaxial_stretch(stretch: float) -> None:
    """Along a: W' = EA/s ln(l) / l and W'' = EA/s (1 - ln l) / l^2; across: W' / l, the stiffness
    of a taut string of unit reference length."""
    a = np.array([0.6, 0.0, 0.8])
    q = np.tile(stretch * a, (4, 1))
    log = np.log(stretch)
    np.testing.assert_allclose(CORD.force(q) @ a, STIFFNESS * log / stretch, rtol=1e-13)
    D = CORD.tangent(q)
    across = np.array([0.0, 1.0, 0.0])
    np.testing.assert_allclose(a @ (D @ a).T, STIFFNESS * (1 - log) / stretch**2, rtol=1e-13)
    np.testing.assert_allclose((D @ across) @ across, STIFFNESS * log / stretch**2, rtol=1e-13)
