"""Scoring: figures of answers made by hand, exact bounds, calibration, the ruler's distances."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from scipy.stats import binom

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.protocol import Protocol
from tyrecal.studies.blind.ruler import EffectShifts, Ruler, difficulty, measure
from tyrecal.studies.blind.score import (
    Scored,
    calibration_error,
    calibration_quantile,
    clopper_pearson,
)
from tyrecal.studies.inference.model import Query

from ..chance import Chance
from .tables import brier, full_summary, guesses, repeatability
from .toy import Scale

pytestmark = pytest.mark.numbers

RULES = Protocol("by hand", "", {})


@pytest.fixture(autouse=True)
def no_error_of_form(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tyrecal.studies.blind.ruler.form_error", lambda label: 0.0)


@pytest.mark.parametrize("right, count", [(0, 59), (4, 200), (54, 60), (60, 60), (7, 9)])
def test_clopper_and_pearson_s_bounds_are_where_the_tails_hold_2_5_percent(
    right: int, count: int
) -> None:
    low, high = clopper_pearson(right, count)
    assert low <= right / count <= high
    if right:
        assert binom.sf(right - 1, count, low) == pytest.approx(0.025)
    if right < count:
        assert binom.cdf(right, count, high) == pytest.approx(0.025)
    assert (low, high) == ((0.0, high) if not right else (low, 1.0 if right == count else high))


def test_bounds_of_published_tables() -> None:
    assert clopper_pearson(0, 10) == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert clopper_pearson(5, 10) == pytest.approx((0.1871, 0.8129), abs=1e-4)
    assert clopper_pearson(0, 0) == (0.0, 1.0)


def test_calibration_error_counts_distance_of_rate_from_stated_probability() -> None:
    assert calibration_error(np.array([1.0, 1.0]), np.array([1.0, 1.0])) == 0
    assert calibration_error(np.full(10, 0.9), np.zeros(10)) == pytest.approx(0.9)
    halves = np.array([0.5, 0.5, 0.95, 0.95]), np.array([1.0, 0.0, 0.0, 0.0])
    assert calibration_error(*halves) == pytest.approx(0.95 / 2)


@pytest.mark.slow
def test_a_calibrated_answerer_stays_below_the_quantile_in_95_of_100_studies(
    chance: Chance,
) -> None:
    """The quantile itself is drawn, so 1 or 2 of 100 are allowed for; one who says 0.95 and is
    right in 0.6 of 200 is eight standard deviations beyond it.

    False failures: 1e-7.
    """
    random, below = chance.random, []
    for _ in range(60):
        stated = random.uniform(0.2, 1.0, 80)
        right = (random.random(80) < stated).astype(float)
        below.append(calibration_error(stated, right) <= calibration_quantile(stated))
    chance.often(below, 0.93, 0.97)
    sure = np.full(200, 0.95)
    overconfident = calibration_error(sure, (random.random(200) < 0.6).astype(float))
    assert overconfident > calibration_quantile(sure)


def test_brier_score_by_hand() -> None:
    assert brier([{"a": 1.0}], ["a"]) == 0
    assert brier([{"a": 1.0, "b": 0.0}], ["b"]) == 2
    assert brier([{"a": 0.5, "b": 0.5}], ["a"]) == 0.5
    assert brier([{"a": 1.0}], ["b"]) == 2  # a key that was not even offered


def trial(kind: str, law: str, p: dict[str, float], **more: object) -> Scored:
    """An answer by hand; its verdict is named where an effect has 0.7."""
    truth = law if kind == "effect" else kind
    ranked = tuple(sorted(p, key=lambda key: -p[key]))
    sure = p[ranked[0]] >= 0.7 and ranked[0] not in ("none", "outside")
    verdict = (
        "named" if sure else {"none": "no_gap", "outside": "outside"}.get(ranked[0], "undecided")
    )
    group = (truth,)
    made = Scored(
        id=f"{kind}{law}",
        kind=kind,
        law=law,
        size=1.0,
        swapped=False,
        group=group,
        lam=30.0,
        band=30.0,
        verdict=verdict,
        named=ranked[0] if sure else None,
        probabilities=p,
        in_set=truth in ranked[:1],
        parameter_held=None,
        before=0.01,
        after=0.002,
    )
    return replace(made, **more)  # type: ignore[arg-type]


def test_figures_of_answers_made_by_hand() -> None:
    trials = [
        trial("effect", "a", {"a": 0.9, "b": 0.1}, parameter_held=True),
        trial("effect", "a", {"b": 0.8, "a": 0.2}, group=("a", "b"), band=12.0),
        trial("effect", "b", {"c": 0.8, "b": 0.2}, band=5.0),
        trial("effect", "c", {"none": 0.9, "c": 0.1}, lam=1.0, band=1.0),
        trial("none", "", {"none": 0.95, "a": 0.05}, after=0.009),
        trial("none", "", {"a": 0.75, "none": 0.25}, after=0.008),
        trial("outside", "odd", {"outside": 0.9, "a": 0.1}),
        trial("outside", "odd", {"a": 0.7, "outside": 0.3}),
    ]
    f = full_summary(trials, {t.id: {"AIC": "a"} for t in trials})
    assert f["trials"] == {"effect": 4, "none": 2, "outside": 2}
    best, middle = f["by_band"][3], f["by_band"][2]
    assert (best["top_1_group"]["right"], best["top_1_group"]["count"]) == (1, 1)
    assert middle["top_1_group"]["right"] == 1 and middle["top_1"]["right"] == 0
    assert f["by_band"][1]["top_1_group"]["right"] == 0
    assert f["by_band"][1]["top_2_group"]["right"] == 1
    assert (f["false_alarms"]["right"], f["false_alarms"]["count"]) == (1, 2)
    assert (f["named_right"]["right"], f["named_right"]["count"]) == (2, 5)
    assert f["outside_recognised"]["right"] == f["outside_named"]["right"] == 1
    assert f["mean_probability_on_group"] == pytest.approx((0.9 + 1.0) / 2)
    assert f["interval_holds_parameter"]["count"] == 1
    assert f["held_out"]["median_shrinkage"] == pytest.approx(0.8)
    assert 0.1 < f["held_out"]["placebo_95"] < 0.2
    assert f["baselines"]["AIC"]["right"] == 2 and f["baselines"]["diagnosis"]["right"] == 4
    assert f["confusion"]["none"] == {"none": 1, "a": 1}
    assert len(f["misses"]) == 4


def ruler() -> Ruler:
    """Four rows of one mode each, one variable that moves all alike, two effects."""
    rows = tuple((Label(n, 0), 240.0) for n in (1, 2, 3, 4))
    sizes = np.array([0.0, 0.5, 1.0])
    line = lambda g: EffectShifts(sizes, np.outer(sizes, g), np.zeros((3, 4, 1)), np.zeros((3, 4)))
    return Ruler(
        rows,
        np.zeros(1),
        np.array([100.0]),
        np.zeros(4),
        np.ones((4, 1)),
        np.zeros((4, 1, 1)),
        np.zeros((4, 1)),
        {"a": line(np.array([0.02, 0, 0, 0])), "b": line(np.array([0, 0.02, 0, 0]))},
    )


def test_lambda_and_distances_in_closed_form() -> None:
    places, counts = np.arange(4), np.full(4, 2)
    shift, none = np.array([0.02, 0, 0, 0]), np.zeros(4)
    hard = difficulty(ruler(), RULES, "a", np.zeros(1), places, counts, (shift, none))
    sigma2 = RULES.noise**2 / 2
    # a free mean takes a quarter of it: |g - mean g|^2 = g^2 (1 - 1/4)
    assert hard.lam == pytest.approx(0.02**2 * 0.75 / sigma2, rel=1e-3)
    # g - e b, least over e: e = -1/3 is out of range, so e = 0
    assert hard.nearest == pytest.approx(hard.lam, rel=1e-3)
    assert hard.group == ("a",) and hard.equivalent == pytest.approx(1.0)
    half = difficulty(ruler(), RULES, "a", np.zeros(1), places, counts, (shift / 2, none))
    assert half.lam == pytest.approx(hard.lam / 4) and half.equivalent == pytest.approx(0.5)
    weak = difficulty(ruler(), RULES, "a", np.zeros(1), places, counts, (shift / 20, none))
    assert weak.group == ("a", "b")


def test_the_mass_scatters_by_the_scale_s_own_measure() -> None:
    weighed = replace(ruler(), rows=((None, 0.0), *ruler().rows[1:]))
    sigma = weighed.sigma(np.arange(4), np.array([1, 2, 2, 2]), RULES)
    assert np.diag(sigma) == pytest.approx([0.005**2] + 3 * [0.002**2 / 2])


def test_splits_count_where_both_members_were_measured() -> None:
    places, split = np.arange(4), np.array([0.01, 0, 0, 0.01])
    tau2 = 2 * RULES.noise**2 + RULES.split**2
    for counts, seen in (([2, 2, 2, 2], 2), ([2, 2, 2, 1], 1), ([1, 2, 2, 1], 0)):
        hard = difficulty(
            ruler(), RULES, "a", np.zeros(1), places, np.array(counts), (np.zeros(4), split)
        )
        assert hard.lam == pytest.approx(seen * 1e-4 / tau2)


def test_the_ruler_of_a_model_is_its_own_sensitivities() -> None:
    scale = Scale()
    content = measure(scale, scale.model_rows)
    assert np.allclose(content["jacobian"], scale.answers([_at(scale)])[0].jacobian)  # type: ignore[union-attr]
    e1 = content["signatures"]["e1"]
    assert e1["sizes"] == [0.0, 0.15, 0.5, 1.0]
    assert np.allclose(e1["shift"][-1][1:], scale.g["e1"], atol=1e-8)


def test_baselines_find_a_strong_effect_and_none_where_there_is_none() -> None:
    r, places = ruler(), np.arange(4)
    sigma = repeatability(r, places, np.full(4, 2), RULES)
    by_baseline = guesses(r, np.array([0.02, 0, 0, 0]) + 0.1, places, sigma)
    assert set(by_baseline.values()) == {"a"}
    assert set(guesses(r, np.full(4, 0.1), places, sigma).values()) == {"none"}
    assert sqrt(sigma[0, 0]) == pytest.approx(RULES.noise / sqrt(2))


def _at(scale: Scale) -> Query:
    return Query(scale.start, constants=True)
