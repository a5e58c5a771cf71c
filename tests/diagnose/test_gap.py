"""The gap's contrasts by hand, and that the mass is none of the modes.

The gap and lambda of drawn tyres in closed form: their distributions, and what splits add.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, ncx2

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.evidence import NONE, refit
from tyrecal.studies.diagnose.gap import _as_number, _contrasts, family, find_gap, projection
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.inference.inverse_problem import Toggle
from tyrecal.studies.inference.observations import Observable
from tyrecal.studies.inference.separability import separate

from ..chance import Chance, generator
from .toy import LABELS, drawn, flat, problem

pytestmark = pytest.mark.numbers

ROWS = tuple(
    Observable("frequency_Hz", label, p) for p in (160.0, 240.0, 320.0) for label in LABELS
)
MASS = Observable("mass_kg", None, 240.0)


def found(rows: tuple[Observable, ...], r: np.ndarray) -> dict[str, float]:
    return {c.name: c.percent for c in _contrasts(rows, r, np.eye(len(rows)))}


def test_groups_of_residuals_come_in_order() -> None:
    """Names first, then numbers as they rise."""
    assert sorted(["10", "0.5", "b", "2", "a"], key=_as_number) == ["a", "b", "0.5", "2", "10"]


def test_the_mass_is_in_no_contrast() -> None:
    r = generator(0).standard_normal(len(ROWS))
    with_mass = found((*ROWS, MASS), np.append(r, 1e3))
    assert with_mass == pytest.approx(found(ROWS, r), rel=1e-12)
    assert len(with_mass) == 6


def test_contrasts_are_means_and_slopes() -> None:
    """Residuals that grow linearly with c and ln p, with a step of the lateral modes."""
    lateral = np.array([family(row) == "lateral" for row in ROWS])
    plane = np.array([family(row) == "in-plane" for row in ROWS])
    c = np.array([row.label.c for row in ROWS if row.label])
    p = np.array([row.pressure_kPa for row in ROWS])
    by = lambda r: found(ROWS, r)
    assert sum(plane) == 4 * 3 and sum(lateral) == 3 * 3
    grows = by(0.02 * np.log(p))
    assert grows.pop("growth with pressure, 320 over 160 kPa") == pytest.approx(2 * np.log(2))
    assert grows.pop("all modes") == pytest.approx(2 * np.log(p).mean())
    assert list(grows.values()) == pytest.approx([0.0] * 4, abs=1e-9)
    rises = by(0.01 * c)
    assert rises["slope over the harmonic, c = 4 over c = 1"] == pytest.approx(3.0)
    assert rises["c = 1 less c of 2 and more"] == pytest.approx(1 - c[c > 1].mean())
    assert rises["c = 0 less the others"] == pytest.approx(-c[c > 0].mean())
    steps = by(0.01 * lateral)
    assert steps["lateral less in-plane"] == pytest.approx(1.0)
    assert steps["all modes"] == pytest.approx(lateral.mean())


def test_the_spread_of_a_contrast_is_that_of_its_weights() -> None:
    """The mean of k independent residuals scatters by 1 / sqrt(k)."""
    contrasts = {c.name: c for c in _contrasts(ROWS, np.ones(len(ROWS)), 4e-4 * np.eye(len(ROWS)))}
    whole = contrasts["all modes"]
    assert whole.sigma_percent == pytest.approx(2 / np.sqrt(27))
    assert whole.percent == pytest.approx(100.0) and whole.p_value < 1e-9


def test_a_contrast_without_modes_is_left_out() -> None:
    rows = tuple(row for row in ROWS if row.label and row.label.c == 0)
    names = list(found(rows, np.ones(len(rows))))
    assert names == ["all modes", "growth with pressure, 320 over 160 kPa"]


def test_six_modes_at_one_pressure_have_no_growth_with_it() -> None:
    """Nor what rounding makes of the mean of equal logarithms."""
    rows = tuple(Observable("frequency_Hz", Label(c, 0), 160.0) for c in range(3, 9))
    assert not [name for name in found(rows, np.ones(6)) if name.startswith("growth")]


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
