"""Claims about draws: each test states how often it fails falsely, and all together stay rare."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest

from .chance import LIMIT, RATE, Chance, budget, generator

pytestmark = pytest.mark.numbers


def test_all_claims_together_fail_falsely_once_in_ten_thousand_runs() -> None:
    rates = budget()
    silent = [name for name, rate in rates.items() if rate < RATE]
    assert rates and not silent, f"no rate in the docstring of {silent}"
    assert sum(rates.values()) <= LIMIT


def test_a_claim_that_is_false_is_refused() -> None:
    for claim in (
        lambda c: c.often(c.random.random(100) < 0.5, 0.9),
        lambda c: c.often(c.random.random(100) < 0.5, 0.0, 0.1),
        lambda c: c.distributed(c.random.random(400) ** 2, "uniform"),
        lambda c: c.zero_on_average(c.random.random(400) - 0.2, 1.0, 400 / 12),
        lambda c: c.mean(c.random.random(400), 0.7, 0.8),
        lambda c: c.scatter(c.random.normal(size=200), 1.6),
        lambda c: c.normal(c.random.normal(size=20) + 20),
    ):
        with pytest.raises(AssertionError):
            claim(Chance("false"))


def test_binomial_bounds_are_missed_at_the_rate() -> None:
    """The least number of hits that is let pass, by summing the distribution."""
    for count, low in ((20, 0.95), (300, 0.89)):
        passes = [k for k in range(count + 1) if _holds(count, k, low)]
        below = sum(comb(count, k) * low**k * (1 - low) ** (count - k) for k in range(min(passes)))
        assert below <= RATE


def _holds(count: int, hits: int, low: float) -> bool:
    try:
        Chance("").often(np.arange(count) < hits, low)
    except AssertionError:
        return False
    return True


def test_draws_hang_on_seed_and_key_alone() -> None:
    assert generator("a", 1).random() == generator("a", 1).random()
    assert generator("a", 1).random() != generator("a", 2).random()
