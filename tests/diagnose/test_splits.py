"""Splits of pairs: folded normal, a tyre's own the same in all states.

Groups of effects that data cannot tell apart.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.integrate import trapezoid

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.separability import Separability, smallest
from tyrecal.studies.inference.splits import Splits

from ..chance import Chance, generator

Array = np.ndarray
PRESSURES_kPa = (160.0, 240.0, 320.0)


def observed(s: Array, tau: Array | float) -> Observations:
    """Splits (pairs, states), NaN where none was measured; each pair has a label of its own."""
    rows = tuple(
        Observable("frequency_Hz", Label(c, 0), p)
        for c in range(1, len(s) + 1)
        for p in PRESSURES_kPa[: s.shape[1]]
    )
    tau = np.where(np.isnan(s), np.nan, tau).ravel()
    zero = np.zeros(s.size)
    return Observations(rows, zero, zero, 0.0, s.ravel(), tau)


def by_signs(s: Array, apart: Array, tau: Array, width: float) -> tuple[float, float]:
    """ln p, and s^T C^-1 s on the mean over signs, of one pair by its 2^k signs."""
    C = np.diag(tau**2) + width**2
    r = np.array(list(product((1, -1), repeat=len(s)))) * s - apart
    squares = np.einsum("pk,kl,pl->p", r, np.linalg.inv(C), r)
    weight = np.exp(-(squares - squares.min()) / 2)
    ln = np.logaddexp.reduce(-squares / 2) - np.linalg.slogdet(2 * np.pi * C)[1] / 2
    return float(ln), float(weight @ squares / weight.sum())


def test_one_split_is_folded_normal() -> None:
    """s = |N(apart, tau^2 + w^2)|, which integrates to 1."""
    ln = lambda s, apart: Splits.of(observed(np.array([[s]]), 0.004), 0.003).ln_likelihood(
        np.array([[apart]])
    )
    tau = 0.005
    for s, apart in ((0.0, 0.0), (0.01, 0.004), (0.003, 0.012), (0.08, 0.0)):
        terms = [-(((s - x) / tau) ** 2) / 2 for x in (apart, -apart)]
        wanted = np.logaddexp(*terms) - np.log(tau * np.sqrt(2 * np.pi))
        assert ln(s, apart) == pytest.approx([wanted], rel=1e-6)
    grid = np.linspace(0, 0.06, 2001)
    total = trapezoid([np.exp(ln(s, 0.004)[0]) for s in grid], grid)
    assert total == pytest.approx(1, abs=1e-3)
    none = Splits.of(observed(np.array([[0.05, 0.001]]), 0.004), 0.0)
    assert none.chi2() == pytest.approx((0.05**2 + 0.001**2) / 16e-6)
    one = Splits.of(observed(np.array([[0.01]]), 0.004), 0.003)
    assert one.chi2() == pytest.approx(0.01**2 / 25e-6) and one.count == 1


@pytest.mark.parametrize("tau", [3e-4, 2.8e-3])
@pytest.mark.parametrize("width", [3e-3, 3e-4, 1e-6])
def test_several_states_share_the_tyre_s_own_split_over_all_signs(tau: float, width: float) -> None:
    """Every pair of signs by itself; a pair that misses a state; effects of two sizes."""
    random = generator("splits", int(1e5 * tau), int(1e7 * width))
    s = abs(width * random.normal(size=(4, 1)) + tau * random.normal(size=(4, 3)))
    s[1, 2] = np.nan
    taus = tau * random.uniform(1, 2, s.shape)
    apart = abs(random.normal(0, 2 * width, (2, s.size)))
    splits = Splits.of(observed(s, taus), width)
    known = np.isfinite(s)
    assert splits.count == known.sum() == 11
    wanted = [
        sum(
            by_signs(s[i, k], each.reshape(s.shape)[i, k], taus[i, k], width)[0]
            for i, k in enumerate(known)
        )
        for each in apart
    ]
    assert splits.ln_likelihood(apart) == pytest.approx(wanted, rel=1e-6)
    same = np.tile(apart[:1], (3, 1))
    assert splits.ln_likelihood(same) == pytest.approx([wanted[0]] * 3, rel=1e-6)
    squares = [by_signs(s[i, k], 0 * s[i, k], taus[i, k], width)[1] for i, k in enumerate(known)]
    assert splits.chi2() == pytest.approx(sum(squares), rel=1e-5)


def test_a_split_that_is_the_same_everywhere_is_no_threefold_evidence() -> None:
    """1 % at three pressures is the tyre's own: chi2 10.7, of one 10.0; 30 if each counted."""
    own = lambda count: Splits.of(observed(np.full((1, count), 0.01), 1e-3), 3e-3).chi2()
    assert own(1) == pytest.approx(10.0) and own(3) == pytest.approx(10.7, abs=0.1)


def test_splits_count_as_many_as_they_are_on_the_mean(chance: Chance) -> None:
    """400 tyres of two pairs in three states. False failures: 1e-7."""
    width, tau = 3e-3, 2e-3
    values = []
    for _ in range(400):
        own, noise = chance.random.normal(size=(2, 1)), chance.random.normal(size=(2, 3))
        values.append(Splits.of(observed(abs(width * own + tau * noise), tau), width).chi2())
    chance.mean(values, 6.0, 6.0)


def test_pairs_of_which_one_member_was_measured_say_nothing() -> None:
    none = Splits.of(observed(np.full((2, 3), np.nan), 1e-3), 3e-3)
    assert none.count == 0 and none.chi2() == 0.0
    assert none.ln_likelihood(np.zeros((2, 6))).tolist() == [0.0, 0.0]


def judged(distances: np.ndarray, **lambdas: float) -> Separability:
    sizes = dict.fromkeys(lambdas, 1.0)
    return Separability(
        tuple(lambdas), sizes, lambdas, lambdas, np.eye(len(lambdas)), distances, {}
    )


def test_effects_are_linked_by_what_stands_between_them() -> None:
    """a is near b, b near c, c near d, each from one side alone: one group; e is by itself, and f,
    which nothing shows, links nothing."""
    far = np.full((6, 6), 45.0)
    for i, j in ((1, 0), (1, 2), (3, 2), (4, 5), (5, 0)):
        far[i, j] = 4.5
    separability = judged(far, a=20.0, b=20.0, c=20.0, d=20.0, e=20.0, f=4.5)
    assert [sorted(group) for group in separability.groups()] == [["a", "b", "c", "d"]]
    assert separability.groups(["a", "c", "d", "e"]) == [["c", "d"]]
    assert separability.groups(["a", "e", "f"]) == []


def test_at_the_limits() -> None:
    """delta^2 = 9 is apart, lambda = 9 is seen."""
    just = np.array([[0.0, 9.0], [9.0, 0.0]])
    assert judged(just, a=9.0, b=9.0).groups() == []
    assert judged(np.nextafter(just, 0), a=9.0, b=9.0).groups() == [["a", "b"]]


def test_thesmallest_that_is_seen() -> None:
    """lambda grows as the square: 10 is reached at sqrt(10 / a), nearest to 0 on either side; None
    where the whole range stays below."""
    grid = np.linspace(0.0, 2.0, 81)
    assert smallest(grid, 1000 * grid**2) == pytest.approx(0.1)
    assert smallest(grid, 40 * grid**2) == pytest.approx(0.5)
    assert smallest(grid, 2.4 * grid**2) is None
    assert smallest(grid, 2.5 * grid**2) == pytest.approx(2.0)
    both = np.linspace(-2.0, 2.0, 81)
    assert smallest(both, np.where(both < 0, 90, 40) * both**2) == pytest.approx(-1 / 3)
