"""The statistics alone, on a tyre in closed form: against integration by brute force, by
simulation, and by what must not change the answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest, multivariate_normal

from tyrecal.diagnose.covariance import covariance
from tyrecal.diagnose.evidence import (
    NONE,
    PRIOR_NONE,
    Hypothesis,
    probabilities,
    refit,
    single,
    weigh,
)
from tyrecal.diagnose.gap import find_gap, projection
from tyrecal.diagnose.problem import Assumed, Change
from tyrecal.diagnose.reading import exchanged, with_exchanged
from tyrecal.diagnose.separability import separate
from tyrecal.diagnose.verdict import decide

from .toy import LABELS, Toy, drawn, problem

NAMES = ("A", "B", "C")


def flat(**keys: object) -> Toy:
    """A toy that is linear in x and e together."""
    toy = Toy(bend=0.0, **keys)  # type: ignore[arg-type]
    for id in toy.tilt:
        toy.tilt[id] = 0 * toy.tilt[id]
    return toy


def test_evidence_against_the_marginal_in_closed_form() -> None:
    """Linear and Gaussian: y ~ N(eta0 + e g, Sigma + J J^T), its integral over e by 4001 points."""
    toy = flat(pressures=(240.0,), effects=2)
    base = problem(toy)
    y = drawn(toy, base, np.random.default_rng(1), {"e0": 0.5}, 0.3)
    p = base.measured(y)
    S = p.sigma + toy.J @ np.diag(toy.spread**2) @ toy.J.T
    ln = lambda e: multivariate_normal(toy.base + e * toy.g["e0"], S).logpdf(y)
    assert refit(p, {}, 1).ln_evidence[0] == pytest.approx(ln(0.0), abs=1e-7)
    grid = (np.arange(4001) + 0.5) / 4001
    wanted = np.log(np.mean(np.exp([ln(e) for e in grid])))
    assert single(p, "e0", 1.0).ln_evidence == pytest.approx(wanted, abs=1e-5)


def test_evidence_against_sampling_where_the_model_bends() -> None:
    """Laplace in x against an average over 400000 draws of x from its prior."""
    toy = Toy(pressures=(240.0,), effects=1, bend=0.1)
    toy.spread = np.full(3, 0.05)
    base = problem(toy, noise=0.01)
    y = drawn(toy, base, np.random.default_rng(2), {}, 0.05)
    p = base.measured(y)
    random = np.random.default_rng(3)
    x = random.normal(0, toy.spread, (400_000, 3))
    eta = toy.base + x @ toy.J.T + np.outer((x**2).sum(1), toy.bend)
    ln = multivariate_normal(np.zeros(len(y)), p.sigma).logpdf(y - eta)
    wanted = np.log(np.mean(np.exp(ln - ln.max()))) + ln.max()
    assert refit(p, {}, 1).ln_evidence[0] == pytest.approx(wanted, abs=0.03)


def test_the_gap_is_chi2_where_there_is_none() -> None:
    """p-values of the whole, of every group, and of contrasts are uniform on effect-free tyres."""
    toy = flat()
    base = problem(toy)
    random = np.random.default_rng(4)
    whole, groups, contrasts = [], [], []
    for _ in range(400):
        p = base.measured(drawn(toy, base, random, {}, 1.0))
        gap = find_gap(p, refit(p, {}, 1).d[0], NAMES)
        whole.append(gap.p_value)
        groups.append([g.p_value for g in gap.groups])
        contrasts.append([c.p_value for c in gap.contrasts])
    for values in (whole, *np.transpose(groups), *np.transpose(contrasts)):
        assert kstest(values, "uniform").pvalue > 1e-3


def test_lambda_is_the_noncentrality() -> None:
    """r^T P r with an effect has mean n - v + lambda; its distribution is noncentral chi2."""
    toy = flat(size=0.006)
    base = problem(toy)
    P, _, _ = projection(base, np.zeros(3))
    wanted = separate(base, P, {"e0": 1.0}).full["e0"]
    random = np.random.default_rng(5)
    values = []
    for _ in range(400):
        p = base.measured(drawn(toy, base, random, {"e0": 1.0}, 1.0))
        values.append(find_gap(p, refit(p, {}, 1).d[0], NAMES).chi2)
    freedom = len(base.places) - 3
    assert np.mean(values) == pytest.approx(freedom + wanted, rel=0.05)
    # a run of 400 with the wrong lambda would be seen
    assert abs(wanted) > 5


def test_probabilities_are_calibrated_where_the_truth_is_drawn_from_the_prior() -> None:
    """Of all that is given a probability p, the share p is true (ECE below that of chance)."""
    toy = flat(size=0.004, effects=5, pressures=(240.0,))
    base = problem(toy)
    random = np.random.default_rng(6)
    ids = list(toy.spans)
    given, true = [], []
    for _ in range(400):
        none = random.random() < PRIOR_NONE / (1 - 0.10)
        id = None if none else ids[random.integers(len(ids))]
        effects = {} if id is None else {id: random.uniform(0, 1)}
        there = base.measured(drawn(toy, base, random, effects, 1.0))
        plain = refit(there, {}, 1)  # none, and singles: no truth is outside here
        none = Hypothesis(NONE, PRIOR_NONE, plain.ln_evidence[0], {}, np.zeros(1), plain)
        p = probabilities([none, *(single(there, id, 0.65 / len(ids)) for id in ids)])
        for key in (NONE, *ids):
            given.append(p[key])
            true.append(key == (id or NONE))
    p, hit = np.array(given), np.array(true, float)
    assert ece(p, hit) <= np.quantile(
        [ece(p, random.random(len(p)) < p) for _ in range(200)], 0.99
    )  # fmt: skip
    brier, constant = np.mean((p - hit) ** 2), np.mean((hit.mean() - hit) ** 2)
    assert brier < 0.8 * constant


def ece(p: np.ndarray, hit: np.ndarray) -> float:
    """Expected calibration error over ten bins."""
    place = np.minimum((10 * p).astype(int), 9)
    return sum(abs((p - hit)[place == k].sum()) for k in range(10)) / len(p)


def test_false_alarms_and_hits() -> None:
    """Effect-free: hardly ever named. Effects with lambda from 25 on: nearly always, and right."""
    toy = Toy(effects=8, size=0.01, pressures=(160.0, 320.0))
    base = problem(toy)
    random = np.random.default_rng(7)
    count, alarms, right, visible = 40, 0, 0, 0
    for _ in range(count):
        found = weigh(base.measured(drawn(toy, base, random, {}, 0.3)), pairs=False)
        verdict = decide(found, probabilities(found), len(base.places), 3)
        alarms += verdict.kind == "named"
        id, e = f"e{random.integers(8)}", random.uniform(0.2, 1)
        P, _, _ = projection(base, np.zeros(3))
        if separate(base, P, {id: e}).lambdas[id] < 25:
            continue
        visible += 1
        found = weigh(base.measured(drawn(toy, base, random, {id: e}, 0.3)), pairs=False)
        p = probabilities(found)
        right += max(p, key=lambda key: p[key]) == id
    assert alarms <= 1
    assert visible > 20 and right >= 0.9 * visible


def test_nothing_depends_on_units_or_order() -> None:
    toy = Toy()
    base = problem(toy)
    y = drawn(toy, base, np.random.default_rng(8), {"e2": 0.5}, 0.3)
    p = base.measured(y)
    order = np.random.default_rng(9).permutation(len(y))
    shuffled = replace(
        p,
        places=p.places[order],
        observations=replace(
            p.observations,
            rows=tuple(p.observations.rows[i] for i in order),
            y=y[order],
        ),
    )
    one, other = probabilities(weigh(p)), probabilities(weigh(shuffled))
    assert {k: other[k] for k in one} == pytest.approx(one, abs=1e-9)
    # all frequencies, measured and computed, in another unit
    scaled = Toy()
    scaled.base = scaled.base + np.log(2 * np.pi)
    again = problem(scaled, y + np.log(2 * np.pi))
    assert probabilities(weigh(again)) == pytest.approx(one, abs=1e-9)


def test_twins_share_their_probability_and_are_a_group() -> None:
    toy = Toy(twin=True)
    base = problem(toy)
    y = drawn(toy, base, np.random.default_rng(10), {"e0": 0.6}, 0.3)
    p = base.measured(y)
    found = probabilities(weigh(p, pairs=False))
    assert found["e0"] == pytest.approx(found["twin"], rel=0.25)
    assert found["e0"] + found["twin"] > 0.8
    P, _, _ = projection(p, np.zeros(3))
    groups = separate(p, P, {"e0": 0.6, "twin": 0.6}).groups(["e0", "twin", "e1"])
    assert ["e0", "twin"] in groups
    verdict = decide(weigh(p, pairs=False), found, len(y), 3)
    assert verdict.kind == "undecided" and {"e0", "twin"} <= set(verdict.candidates)


def test_missing_values_only_widen_the_answer() -> None:
    toy = Toy()
    base = problem(toy)
    y = drawn(toy, base, np.random.default_rng(11), {"e1": 0.7}, 0.3)
    p = base.measured(y)
    keep = np.random.default_rng(12).random(len(y)) > 0.15
    width = lambda q: np.diff([single(q, "e1", 1.0).quantile("e1", s) for s in (0.05, 0.95)])[0]
    assert width(p.only(keep)) > width(p)
    assert max(probabilities(weigh(p.only(keep))).items(), key=lambda x: x[1])[0] == "e1"


def test_a_misread_label_is_outside_and_named() -> None:
    toy = Toy()
    base = problem(toy)
    y = drawn(toy, base, np.random.default_rng(13), {}, 0.03)
    for start in range(0, len(y), len(LABELS)):
        y[start + 6] += 0.08
    found = weigh(base.measured(y))
    verdict = decide(found, probabilities(found), len(y), 3)
    assert verdict.kind == "outside"
    assert f"{LABELS[6]} is misread" in verdict.words


@pytest.mark.parametrize("effects", [{}, {"e1": 0.9}])
def test_exchanged_labels_are_found_whatever_else_is_there(effects: dict[str, float]) -> None:
    toy = Toy()
    base = problem(toy)
    y = drawn(toy, base, np.random.default_rng(13), effects, 0.03)
    assert exchanged(base.measured(y)) is None
    swapped = base.measured(y)
    swapped = replace(swapped, observations=with_exchanged(swapped.observations, *LABELS[6:8]))
    assert abs(swapped.observations.y - y).max() > 0.02  # [3,0] and [3,1]: 5 % apart
    assert exchanged(swapped) == tuple(sorted(LABELS[6:8], key=str))
    back = with_exchanged(swapped.observations, *LABELS[6:8])
    assert np.array_equal(back.y, y)


def test_a_shift_of_modes_in_no_catalogue_is_not_named() -> None:
    toy = Toy(size=0.01)
    base = problem(toy)
    random = np.random.default_rng(14)
    outside = 0
    for _ in range(10):
        strange = np.tile(random.normal(0, 0.02, len(LABELS)), 3)
        y = drawn(toy, base, random, {}, 0.3) + strange
        found = weigh(base.measured(y))
        verdict = decide(found, probabilities(found), len(y), 3)
        assert verdict.kind != "no_gap"
        outside += verdict.kind == "outside"
    assert outside >= 8


def test_a_toggled_run_cancels_what_both_share() -> None:
    """A tyre whose constants hide the effect: lambda rises by the switched run alone."""
    toy = flat(size=0.01)
    toy.constants = np.stack([toy.g["e0"], toy.g["e1"]], 1)  # gauges that look like effects
    alone = problem(toy)
    both = problem(toy, changes=(Change("e0", 0.0),))
    lambdas = []
    for p in (alone, both):
        P, _, _ = projection(p, np.zeros(3))
        lambdas.append(separate(p, P, {"e0": 1.0}).full["e0"])
    assert lambdas[0] < 1 and lambdas[1] > 100
    y = drawn(toy, alone, np.random.default_rng(15), {}, 0.3)
    noise = np.random.default_rng(16).normal(0, 0.001, len(y))
    twice = np.concatenate([y + 0.8 * toy.g["e0"], y + noise])
    p = both.measured(twice)
    found = single(p, "e0", 1.0)
    assert found.mean()["e0"] == pytest.approx(0.8, abs=0.1)
    assert probabilities(weigh(p))["e0"] > 0.7


def test_a_known_change_is_in_every_hypothesis() -> None:
    """The switched run has e1 = 0.5 on purpose: without any effect there is no gap."""
    toy = flat(size=0.02)
    p = problem(toy, changes=(Change("e1", 0.5),))
    random = np.random.default_rng(17)
    y = drawn(toy, p, random, {}, 0.3)
    y[len(toy.base) :] += 0.5 * toy.g["e1"]
    p = p.measured(y)
    assert find_gap(p, refit(p, {}, 1).d[0], NAMES).p_value > 1e-3
    assert probabilities(weigh(p))[NONE] > 0.3


def test_covariance_is_what_it_says() -> None:
    """Model-form error: 0.9 between pressures, 0.97 between runs, none between modes."""
    toy = Toy(pressures=(160.0, 240.0))
    p = problem(toy, changes=(Change("e0", 0.0),), noise=1e-9)
    S = covariance(p.observations, 0 * p.constants, form=0.01) / 1e-4
    n = len(toy.base)
    assert S[0, len(LABELS)] == pytest.approx(0.9)
    assert S[0, n] == pytest.approx(0.97)
    assert S[0, n + len(LABELS)] == pytest.approx(0.9 * 0.97)
    assert S[0, 1] == 0 and np.linalg.eigvalsh(S).min() > 0


def test_an_effects_law_that_is_off_is_still_the_effect() -> None:
    """A real effect 10 % off the catalogue's, far beyond the scatter: named with the stated
    looseness of laws, judged outside without it."""
    toy = Toy(size=0.15)
    random = np.random.default_rng(18)
    strict = problem(toy, assumed=Assumed(form=0.001, law=0.0))
    real = np.tile(1 + 0.1 * random.normal(size=len(LABELS)), 3)
    y = toy.base + real * toy.g["e0"]
    said = []
    for law in (0.0, 0.1):
        found = weigh(replace(strict, assumed=Assumed(form=0.001, law=law)).measured(y))
        said.append(decide(found, probabilities(found), len(y), 3))
    assert [v.kind for v in said] == ["outside", "named"] and said[1].key == "e0"


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
    assert probabilities(weigh(apart, pairs=False))["e0"] > 0.95
    assert probabilities(weigh(joined, pairs=False))["e0"] < 0.05
    assert chi2.sf(find_gap(apart, np.zeros(3), NAMES).chi2, n - 3 + pair.sum()) < 1e-6


def test_the_interval_of_the_parameter_covers() -> None:
    """The 90 % interval holds the true parameter in 85 to 95 of 100 tyres, within chance."""
    toy = flat(size=0.01, pressures=(240.0,), effects=1)
    base, random, count, inside = problem(toy), np.random.default_rng(19), 300, 0
    for _ in range(count):
        e = random.uniform(0, 1)
        found = single(base.measured(drawn(toy, base, random, {"e0": e}, 1.0)), "e0", 1.0)
        inside += found.quantile("e0", 0.05) <= e <= found.quantile("e0", 0.95)
    assert 0.84 * count <= inside <= 0.96 * count
