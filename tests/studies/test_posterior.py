"""The posterior of a box and its draws: closed forms, all optima, what draws are worth.

Shares of the variance: a closed form, a grid, and scipy's estimate from samples.

Known posteriors are of a linear tyre in closed form, and of one with two optima.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tyrecal.errors import InputError
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.emulator import Evaluated, fitted, spread, up_to
from tyrecal.studies.inference.observations import Observable
from tyrecal.studies.sample import predict as module
from tyrecal.studies.sample.box import sample_box
from tyrecal.studies.sample.chains import (
    ENOUGH,
    WARM_UP,
    autocorrelation_time,
    enough_draws,
    needs_emcee,
    walk,
    walkers,
)
from tyrecal.studies.sample.posterior import Posterior, optima
from tyrecal.studies.sample.predict import variance_shares
from tyrecal.studies.sample.study import rows_of
from tyrecal.studies.variable import DesignVariable
from tyrecal.tyre.state import TyreState

from ..chance import Chance, generator
from .test_emulator import MODES, made, meeting, polynomial

Array = np.ndarray


LABELS = (Label(1, 0), Label(2, 0), Label(3, 0))
J = np.array([[0.5, 0.1], [0.2, -0.4], [0.1, 0.3]])
VARIABLES = (DesignVariable("A", 1.0, 1e-3, 1e3), DesignVariable("B", 0.5, -50.0, 51.0, False))
BOUNDS = np.array([[np.log(1e-3), np.log(1e3)], [0.0, 1.0]])
SIGMA = np.array([0.01, 0.02, 0.015])


def posterior(
    box: Array, eta: Callable[[Array], Array] | None = None, y: Array | None = None
) -> Posterior:
    """Posterior of a tyre with ln f = 4 + J x, or another, measured at x = (0, 0.5)."""
    t = spread(14, 2)
    centre, half = box.mean(1), np.ptp(box, axis=1) / 2
    if eta is None:
        eta = lambda x: 4 + x @ J.T
    x, samples = centre + half * t, []
    named = lambda each: dict(zip(LABELS, each, strict=True))
    for each in x:
        rise = np.array([(eta(each + e) - eta(each - e)) / 2e-4 for e in 1e-4 * np.eye(2)]).T
        samples.append(Evaluated(each, named(eta(each)), named(rise), 0.0))
    made = fitted(VARIABLES, LABELS, centre, half, samples)
    rows = np.array([[0, i] for i in range(3)])
    values = eta(np.array([0.0, 0.5])) if y is None else y
    return Posterior((made,), np.zeros((1, 1)), rows, values, np.diag(1 / SIGMA), box)


COVARIANCE = np.linalg.inv((J.T / SIGMA**2) @ J)
WIDTH = np.sqrt(np.diag(COVARIANCE))
CENTRE = np.array([0.0, 0.5])
WIDE = np.stack([CENTRE - 7 * WIDTH, CENTRE + 7 * WIDTH], 1)


def two_valleys(x: Array) -> Array:
    """The same frequencies at x and at its mirror image."""
    A = x[..., 0] - 0.0
    return np.stack([4 + A**2, 4 + x[..., 1] + 0.02 * A, 5 - x[..., 1]], -1)


pytestmark = pytest.mark.numbers


def test_a_linear_tyre_has_the_normal_posterior_of_the_closed_form(chance: Chance) -> None:
    """Draws ten autocorrelation times apart, made independent standard normal ones by the closed
    form: mean, scatter and distribution. False failures: 7e-7."""
    draws = sample_box(posterior(WIDE), BOUNDS, 100_000, int(chance.random.integers(2**31)))
    assert np.allclose(draws.covariance, COVARIANCE, rtol=1e-6)
    assert np.allclose(draws.optima, CENTRE[None], atol=1e-6 * WIDTH)
    chains = draws.chains
    assert chains.enough and 0.2 < chains.acceptance < 0.6 and (chains.tau > 1).all()
    apart = chains.draws[:: int(10 * chains.tau.max())].reshape(-1, 2)
    z = np.linalg.solve(np.linalg.cholesky(COVARIANCE), (apart - CENTRE).T)
    assert len(apart) >= 1000
    for each in z:
        chance.mean(each, 0.0, 0.0)
        chance.scatter(each, 1.0)
        chance.distributed(each, "norm")
    chance.mean(z[0] * z[1], 0.0, 0.0)


def test_what_each_rim_tells_adds_up() -> None:
    """Information and ln p of two rims, with an emulator each, are the sums of both."""
    other = J @ np.array([[0.2, 0.0], [0.0, 1.5]])
    one, two = posterior(WIDE), posterior(WIDE, lambda x: 4.5 + x @ other.T)
    both = Posterior(
        (*one.emulators, *two.emulators),
        np.array([[0.0], [1.0]]),
        np.vstack([one.rows, two.rows + np.array([1, 0])]),
        np.concatenate([one.y, two.y]),
        np.diag(1 / np.tile(SIGMA, 2)),
        WIDE,
    )
    x = np.stack([CENTRE, CENTRE + 0.5 * WIDTH])
    assert both(x) == pytest.approx(one(x) + two(x), abs=1e-6)
    assert np.allclose(both.information(x), one.information(x) + two.information(x), rtol=1e-6)
    assert both.evaluations == 2 * one.evaluations and len(both.stated_errors) == 6
    free = both.emulators[1]
    C = np.array([[4.0, 1.0, 0.0], [1.0, 9.0, 2.0], [0.0, 2.0, 1.0]])
    rough = replace(both, emulators=(one.emulators[0], replace(free, error_covariance=C)))
    rough = replace(rough, states=np.array([[0.0], [1.0], [1.0]]))
    rough = replace(rough, rows=np.vstack([rough.rows, [2, 1]]))
    covariance = rough.emulator_covariance
    assert not covariance[:3, 3:].any()  # an emulator each
    assert np.allclose(covariance[3:6, 3:6], C)
    assert np.allclose(covariance[6, 3:], [0.5, 4.5, 1.0, 9.0])  # half of it at another pressure
    states = [TyreState(240.0), TyreState(240.0, 0.0, "free")]
    measured = [Observable("frequency_Hz", LABELS[2], 240.0, rim=rim) for rim in ("free", None)]
    assert rows_of(measured, states, [LABELS, LABELS[1:]]).tolist() == [[1, 1], [0, 2]]


def test_draws_are_worth_as_many_as_their_autocorrelation_says() -> None:
    chains = sample_box(posterior(WIDE), BOUNDS, 40_000, 3).chains
    flat, tau = chains.flat, chains.tau.max()
    assert len(flat) == chains.draws.shape[0] * chains.draws.shape[1]
    assert chains.effective == pytest.approx(len(flat) / tau)
    apart = max(1, int(tau / 2))
    assert len(chains.thinned) == -(-chains.draws.shape[0] // apart) * chains.draws.shape[1]
    assert chains.dropped + len(chains.draws) == 400 and 20 < chains.dropped < 100
    assert sample_box(posterior(WIDE), BOUNDS, 2000, 3).chains.enough  # more are drawn by itself


def test_more_draws_have_more_walkers_until_their_steps_tell_tau() -> None:
    """The number of draws suffices for a tau a fifth longer than a chain stated."""
    counts = 3000, 40_000, 60_000, 160_000, 10**6
    assert [walkers(count, 2) for count in counts] == [100, 100, 150, 400, 400]
    assert walkers(3000, 40) == 160
    for tau in (3.0, 10.0, 10.7, 40.0):
        count = int(enough_draws(tau))
        assert count / walkers(count, 2) - WARM_UP * 1.2 * tau >= ENOUGH * 1.2 * tau
    assert walk(posterior(WIDE), CENTRE[None], COVARIANCE, 60_000, 1).draws.shape[1] == 150


def test_tau_is_known_as_well_as_said(chance: Chance) -> None:
    """Tau = 9 of x(t + 1) = a x(t) + noise is known to 5 and 10 % with 400 and 100 walkers over
    20 tau, by which `ENOUGH` was chosen. False failures: 2e-7."""
    a, tau = 0.8, 9.0
    for number, share in ((400, 0.05), (100, 0.10)):
        noise = chance.random.normal(size=(int(ENOUGH * tau), number, 40))
        noise[0] /= np.sqrt(1 - a**2)
        x = lfilter([np.sqrt(1 - a**2)], [1, -a], noise, axis=0)
        off = [autocorrelation_time(each[:, :, None])[0] / tau - 1 for each in np.moveaxis(x, 2, 0)]
        assert np.sqrt(np.mean(np.square(off))) < 1.6 * share


def test_the_autocorrelation_time_is_that_of_the_closed_form() -> None:
    """The time of x(t + 1) = a x(t) + noise is (1 + a) / (1 - a), that of independent draws 1;
    walkers that stay apart from each other have a long one."""
    random, times = generator("autocorrelation"), []
    for a in (0.0, 0.5, 0.9):
        x = [random.normal(size=(50, 1))]
        for _ in range(4000):
            x.append(a * x[-1] + np.sqrt(1 - a**2) * random.normal(size=(50, 1)))
        times.append(float(autocorrelation_time(np.array(x))[0]))
    assert times == pytest.approx([1.0, 3.0, 19.0], rel=0.1)
    apart = random.normal(size=(1000, 50, 1)) + 10 * (np.arange(50) % 2)[:, None]
    assert autocorrelation_time(apart)[0] > 300


def test_the_same_seed_gives_the_same_draws_and_another_one_others() -> None:
    first, same, other = (
        walk(posterior(WIDE), CENTRE[None], COVARIANCE, 3000, seed).flat for seed in (1, 1, 2)
    )
    assert first.tobytes() == same.tobytes() != other.tobytes()


def test_walkers_begin_within_the_box_however_wide_they_are_sent_out() -> None:
    corner = np.stack([CENTRE, CENTRE + 4 * WIDTH], 1)
    for box, start in ((WIDE, CENTRE), (corner, CENTRE)):
        far = walk(posterior(box), start[None], 1e6 * COVARIANCE, 3000, 1)
        assert ((far.flat >= box[:, 0]) & (far.flat <= box[:, 1])).all()
        assert np.unique(far.draws[0], axis=0).shape == (100, 2)


def test_the_density_ends_at_the_box() -> None:
    density = posterior(WIDE)
    x = np.array([CENTRE, WIDE[:, 0], WIDE[:, 1], WIDE[:, 1] * [1.01, 1], WIDE[:, 0] * [1, 0.99]])
    values = density(x)
    assert np.isfinite(values[:3]).all() and np.isneginf(values[3:]).all()
    off = x[1] - CENTRE
    assert values[1] == pytest.approx(-0.5 * off @ np.linalg.inv(COVARIANCE) @ off)
    assert np.isneginf(density(WIDE[:, 1][None] + 1)).all()


def test_all_optima_of_a_box_are_found_and_walkers_start_from_the_likely_ones() -> None:
    box = np.array([[-1.0, 1.0], [0.2, 0.8]])
    density = posterior(box, two_valleys, two_valleys(np.array([0.5, 0.5])))
    best, height = optima(density)
    assert len(best) == 2 and height[0] > height[1] > height[0] - 10
    assert np.allclose(best, [[0.5, 0.5], [-0.5, 0.505]], atol=0.02)
    for each in best:  # no place around is likelier
        around = density(each + 1e-3 * generator("around").normal(size=(200, 2)))
        assert around.max() <= density(each[None])[0] + 1e-9
    x = sample_box(density, BOUNDS, 20_000, 0).chains.flat[:, 0]
    ratio = np.exp(height[1] - height[0])
    assert np.mean(x < 0) == pytest.approx(ratio / (1 + ratio), abs=0.1)


def test_an_optimum_at_the_edge_of_the_box_is_held_there() -> None:
    box = np.array([[0.05, 0.3], [0.2, 0.8]])
    best, _ = optima(posterior(box))
    assert best[0, 0] == 0.05
    y = np.linspace(0.2, 0.8, 4001)
    line = posterior(box)(np.column_stack([np.full(len(y), 0.05), y]))
    assert best[0, 1] == pytest.approx(y[line.argmax()], abs=2e-4)


def test_a_missing_emcee_is_told_in_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(InputError, match=r"needs the package emcee.*pip install '\.\[sample]"):
        needs_emcee()


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
