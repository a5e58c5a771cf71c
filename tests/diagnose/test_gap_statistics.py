"""The gap and lambda of drawn tyres in closed form: their distributions, and what splits add."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from tyrecal.studies.diagnose.evidence import NONE, refit
from tyrecal.studies.diagnose.gap import find_gap, projection
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.inference.inverse_problem import Toggle
from tyrecal.studies.inference.separability import separate

from ..chance import Chance
from .toy import drawn, flat, problem

pytestmark = pytest.mark.numbers
NAMES = ("A", "B", "C")


def test_the_gap_is_chi2_where_there_is_none(chance: Chance) -> None:
    """p-values of the whole, of every group, and of contrasts are uniform on effect-free tyres.

    False failures: 1.8e-6.
    """
    toy = flat()
    base = problem(toy)
    whole, groups, contrasts = [], [], []
    for _ in range(200):
        p = base.measured(drawn(toy, base, chance.random, {}, 1.0))
        gap = find_gap(p, refit(p, {}, 1).d[0], NAMES)
        whole.append(gap.p_value)
        groups.append([g.p_value for g in gap.groups])
        contrasts.append([c.p_value for c in gap.contrasts])
    for values in (whole, *np.transpose(groups), *np.transpose(contrasts)):
        chance.distributed(values, "uniform")


@pytest.mark.slow
def test_lambda_is_the_noncentrality(chance: Chance) -> None:
    """r^T P r with an effect is noncentral chi2 with n - v degrees of freedom and lambda; without
    lambda it is not.

    False failures: 1e-7.
    """
    toy = flat(size=0.01)
    base = problem(toy)
    P, _, _ = projection(base, np.zeros(3))
    wanted = separate(base, P, {"e0": 1.0}).full["e0"]
    values = []
    for _ in range(200):
        p = base.measured(drawn(toy, base, chance.random, {"e0": 1.0}, 1.0))
        values.append(find_gap(p, refit(p, {}, 1).d[0], NAMES).chi2)
    freedom = len(base.places) - 3
    chance.distributed(values, ncx2(freedom, wanted).cdf)
    assert wanted > 25  # with none, half of the values would lie beyond 0.99 of the distribution
    assert np.mean(np.array(values) > chi2(freedom).ppf(0.99)) > 0.5


@pytest.mark.slow
def test_a_known_change_is_in_every_hypothesis(chance: Chance) -> None:
    """The switched run has e1 = 0.5 on purpose: without any effect there is no gap.

    False failures: 2e-7.
    """
    toy = flat(size=0.02)
    switched = problem(toy, changes=(Toggle("e1", 0.5),))
    p_values, none = [], []
    for _ in range(20):
        y = drawn(toy, switched, chance.random, {}, 1.0)
        y[len(toy.base) :] += 0.5 * toy.g["e1"]
        p = switched.measured(y)
        p_values.append(find_gap(p, refit(p, {}, 1).d[0], NAMES).p_value)
        share = probabilities(weigh_hypotheses(p, pairs=False))
        none.append(max(share, key=lambda key: share[key]) == NONE)
    chance.distributed(p_values, "uniform")
    chance.often(none, 0.9)


def test_splits_speak_for_what_splits() -> None:
    toy = flat(size=0.004)
    toy.splits["e0"] = np.full(len(toy.base), 0.02)
    base = problem(toy)
    n = len(toy.base)
    pair = np.array([label.c > 0 for label, _ in toy.rows])
    seen = lambda s: replace(
        base.observations, split=np.where(pair, s, np.nan), split_scatter=np.full(n, 0.003)
    )
    apart = replace(base, observations=seen(0.01))
    joined = replace(base, observations=seen(0.001))
    assert probabilities(weigh_hypotheses(apart, pairs=False))["e0"] > 0.95
    assert probabilities(weigh_hypotheses(joined, pairs=False))["e0"] < 0.05
    far = replace(base, observations=seen(0.02))
    assert chi2.sf(find_gap(far, np.zeros(3), NAMES).chi2, n - 3 + pair.sum()) < 1e-6
