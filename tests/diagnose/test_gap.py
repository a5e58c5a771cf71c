"""The gap's contrasts by hand, and how far an effect or a placebo shrinks held-out errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import chi2, ncx2

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.evidence import NONE, explain, refit
from tyrecal.studies.diagnose.gap import _as_number, _contrasts, family, find_gap, projection
from tyrecal.studies.diagnose.several import probabilities, weigh_hypotheses
from tyrecal.studies.diagnose.shrinkage import _placebo, held_out, shrink
from tyrecal.studies.inference.inverse_problem import Assumed, Toggle
from tyrecal.studies.inference.model import EffectRange, Query
from tyrecal.studies.inference.observations import Observable
from tyrecal.studies.inference.separability import separate

from ..chance import Chance, generator
from .test_diagnosis import diagnosed
from .toy import LABELS, Toy, drawn, flat, problem

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


@pytest.mark.parametrize(
    ("pressures", "held"),
    [((160.0, 240.0, 320.0), {240.0}), ((160.0, 240.0), {160.0}), ((240.0,), set())],
)
def test_what_is_held_out_follows_a_rule(pressures: tuple[float, ...], held: set[float]) -> None:
    rows = [Observable("frequency_Hz", x, p) for p in pressures for x in LABELS]
    rows.append(Observable("mass_kg", None, 0.0))
    mask, _ = held_out(rows)
    chosen = [row for row, h in zip(rows, mask, strict=True) if h]
    if held:
        assert {row.pressure_kPa for row in chosen} == held
        assert len(chosen) == len(LABELS)
    else:
        assert {row.label for row in chosen} == {Label(4, 0), Label(3, 1)}
    assert all(row.label for row in chosen)


@pytest.mark.slow
def test_an_effect_shrinks_the_held_out_error(chance: Chance) -> None:
    """Beyond the placebo's quantile, and least squares' error too, in 17 of 20 tyres.

    False failures: 2e-7.
    """
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    base, shrunk, usual = problem(toy), [], []
    for _ in range(12):
        there = base.measured(drawn(toy, base, chance.random, {"e1": 0.9}, 0.3))
        s = shrink(there)
        assert s is not None and s.low <= s.high
        shrunk.append(s.effect == "e1" and s.fraction > s.placebo_95)
        usual.append(s.least_squares_after_percent < s.least_squares_before_percent)
    chance.often(shrunk, 0.85)
    chance.often(usual, 0.85)


@pytest.mark.slow
def test_an_effect_is_told_with_the_rung_that_its_shrinkage_gives() -> None:
    diagnosis = diagnosed(Toy(size=0.02, pressures=(160.0, 200.0, 240.0)), {"e1": 0.9}, 1)
    s = diagnosis.shrinkage
    assert s is not None
    named = diagnosis.verdict.kind == "named"
    assert diagnosis.rung == 2 or not (named and s.effect == "e1" and s.fraction > s.placebo_95)


@pytest.mark.slow
def test_without_an_effect_the_error_shrinks_beyond_the_placebo_in_one_of_twenty(
    chance: Chance,
) -> None:
    """The placebo's quantile is of 200 draws, and of a model linear in x: 3 to 8 of 100.

    False failures: 1e-7.
    """
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    base, beyond = problem(toy), []
    for _ in range(16):
        there = base.measured(drawn(toy, base, chance.random, {}, 0.0))
        fake = shrink(there)
        assert fake is not None
        beyond.append(fake.fraction > fake.placebo_95)
    chance.often(beyond, 0.03, 0.08)


@pytest.mark.parametrize("without", [True, False])
def test_a_calibration_as_usual_stands_beside(without: bool) -> None:
    """Least squares of the other rows, by SciPy on the tyre itself, without and with the effect."""
    toy = Toy(size=0.02, pressures=(160.0, 200.0, 240.0))
    toy.spread = np.array([0.003, 0.01, 0.03])  # so that the bounds count
    base = problem(toy)
    y = drawn(toy, base, generator(1), {"e1": 0.9}, 0.03)
    there = base.measured(y)
    s = shrink(there, "e1")
    assert s is not None
    hold, _ = held_out(there.observations.rows)
    (h,) = (h for h in weigh_hypotheses(there.only(~hold)) if h.key == "e1")
    effects = {} if without else h.mean()

    def off(x: np.ndarray) -> np.ndarray:
        return toy._answer(Query(x, effects)).eta - y

    weighed = lambda x: np.concatenate([off(x)[~hold] / 0.002, (x - toy.start) / toy.spread])
    best = least_squares(weighed, toy.start, xtol=1e-14, ftol=1e-14).x
    expected = 100 * np.sqrt(np.mean(off(best)[hold] ** 2))
    got = s.least_squares_before_percent if without else s.least_squares_after_percent
    assert got == pytest.approx(expected, rel=1e-6)


@pytest.mark.slow
def test_the_placebo_is_what_tyres_without_an_effect_would_show() -> None:
    """Each drawn tyre by itself: the likeliest effect of the rows that are kept, at its likeliest
    size, lowers the error of those held out by R; 95 % of them show less."""
    toy = Toy(effects=2, size=0.02, pressures=(200.0, 240.0), bend=0.0)
    toy.tilt = {id: 200 * tilt for id, tilt in toy.tilt.items()}
    toy.ranges["e1"] = EffectRange(0.0, 0.7)
    p = problem(toy, assumed=Assumed(form=0.001, response_error=0.04))
    hold, _ = held_out(p.observations.rows)
    noise = np.random.default_rng(7).multivariate_normal(
        np.zeros(len(hold)), p.sigma, 200, method="cholesky"
    )
    kept, out = p.only(~hold), p.only(hold)
    shares = []
    for each in noise:
        there = kept.measured(kept.plain(np.zeros(3))[0] + each[~hold])
        before = each[hold] - out.plain(np.zeros(3))[1] @ refit(there, {}, 1).d[0]
        best = max((explain(there, [id], 1.0) for id in toy.g), key=lambda h: h.ln_evidence)
        assert best.fitted is not None
        e, d = {best.key: best.values[best.key][[best.best]]}, best.fitted.d[best.best]
        shift, tilt, *_ = out.added(e, 1)
        after = each[hold] - shift[0] - (out.plain(np.zeros(3))[1] + tilt[0]) @ d
        shares.append(1 - np.sqrt(np.mean(after**2) / np.mean(before**2)))
    placebo = _placebo(p, hold, np.random.default_rng(7))
    assert placebo == pytest.approx(np.quantile(shares, 0.95), rel=1e-6)
