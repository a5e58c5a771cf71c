"""The statistics alone, on a tyre in closed form: against integration by brute force, by
simulation, and by what must not change the answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial.hermite import hermgauss
from scipy.stats import chi2, multivariate_normal, ncx2

from tyrecal.studies.diagnose.covariance import covariance, model_form
from tyrecal.studies.diagnose.evidence import NONE, Hypothesis, explain, refit
from tyrecal.studies.diagnose.gap import find_gap, projection
from tyrecal.studies.diagnose.inverse_problem import Assumed, Toggle
from tyrecal.studies.diagnose.label_swap import exchanged, with_exchanged
from tyrecal.studies.diagnose.model import Answer, Query, Span
from tyrecal.studies.diagnose.observations import Observable
from tyrecal.studies.diagnose.separability import separate
from tyrecal.studies.diagnose.several import PRIOR_NONE, probabilities, weigh
from tyrecal.studies.diagnose.verdict import decide

from ..chance import Chance, generator
from .toy import LABELS, Toy, drawn, problem

pytestmark = pytest.mark.numbers

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
    y = drawn(toy, base, generator(1), {"e0": 0.5}, 0.3)
    p = base.measured(y)
    S = p.sigma + toy.J @ np.diag(toy.spread**2) @ toy.J.T
    ln = lambda e: multivariate_normal(toy.base + e * toy.g["e0"], S).logpdf(y)
    assert refit(p, {}, 1).ln_evidence[0] == pytest.approx(ln(0.0), abs=1e-7)
    grid = (np.arange(4001) + 0.5) / 4001
    wanted = np.log(np.mean(np.exp([ln(e) for e in grid])))
    assert explain(p, ["e0"], 1.0).ln_evidence == pytest.approx(wanted, abs=1e-5)


def test_what_an_effects_law_may_be_off_is_scatter_of_its_own() -> None:
    """As so much more covariance, parameter by parameter; none where there is no effect."""
    toy = flat(pressures=(160.0, 240.0))
    loose = problem(toy, assumed=Assumed(form=0.001, law=0.1)).measured(toy.base + toy.g["e0"])
    strict = replace(loose, assumed=Assumed(form=0.001, law=0.0))
    e = np.array([0.4, 1.0])
    found = refit(loose, {"e0": e}, 2)
    for i, more in enumerate(loose.law(loose.added({"e0": e}, 2))):
        own = refit(strict, {"e0": e[i : i + 1]}, 1, more)
        assert more.any() and found.ln_evidence[i] == pytest.approx(own.ln_evidence[0])
    assert refit(loose, {}, 1).ln_evidence == pytest.approx(refit(strict, {}, 1).ln_evidence)


def test_what_else_an_effect_is_is_integrated_over() -> None:
    """z ~ N(0, 1) times a shift that grows as the effect does: as so much more covariance. It is
    asked for at the ends of the range alone; laws of two effects are off by themselves."""
    toy, more = flat(pressures=(160.0, 240.0)), generator(7).normal(0, 0.01, 18)
    toy.spans["e0"] = Span(-1.0, 0.5, second=True)
    asked, plain = [], toy._answer

    def told(point: Query) -> Answer:
        if not point.beside:
            return plain(point)
        asked.append(point.effects["e0"])
        return replace(plain(point), beside=2 * point.effects["e0"] * more)

    toy._answer = told  # type: ignore[method-assign]
    p = problem(toy, assumed=Assumed(form=0.001)).measured(toy.base + 0.4 * toy.g["e0"])
    assert sorted(asked) == [-1.0, 0.5]
    e = np.array([-0.5, 0.4])
    found = refit(p, {"e0": e}, 2)
    for i in range(2):
        shift, beside = 0.04 * e[i] * toy.g["e0"], 2 * e[i] * more
        extra = np.outer(shift, shift) * p._alike + np.outer(beside, beside)
        bare = replace(p, assumed=Assumed(form=0.001, law=0.0))
        nodes = {**p.expansion.nodes, "e0": replace(p.expansion.nodes["e0"], beside={})}
        bare = replace(bare, expansion=replace(p.expansion, nodes=nodes))
        own = refit(bare, {"e0": e[i : i + 1]}, 1, extra)
        assert found.ln_evidence[i] == pytest.approx(own.ln_evidence[0])
    both, one, other = (
        p.law(p.added(effects, 2)) for effects in ({"e0": e, "e1": e**2}, {"e0": e}, {"e1": e**2})
    )
    np.testing.assert_allclose(both, one + other, atol=1e-16)


@pytest.mark.parametrize("far", [(0, 0, 0), (2, 2, 2), (-2, 2, 0), (3, 0, -3)])
def test_evidence_against_quadrature_where_the_model_bends(far: tuple[int, int, int]) -> None:
    """Laplace in x against Gauss and Hermite's rule, 24 nodes each way, at and far from x0."""
    toy = Toy(pressures=(240.0,), effects=1, bend=0.1)
    toy.spread = np.full(3, 0.05)
    base = problem(toy, noise=0.01)
    (answer,) = toy.answers([Query(toy.spread * far)])
    assert isinstance(answer, Answer)
    p = base.measured(answer.eta)
    fitted = refit(p, {}, 1)
    nodes, weights = hermgauss(24)
    grid = np.stack(np.meshgrid(*[np.sqrt(2) * nodes] * 3), -1).reshape(-1, 3)
    L = np.linalg.cholesky(fitted.covariance[0])
    x = fitted.d[0] + grid @ L.T
    eta = toy.base + x @ toy.J.T + np.outer((x**2).sum(1), toy.bend)
    ln = multivariate_normal(np.zeros(len(p.places)), p.sigma).logpdf(answer.eta - eta)
    ln += multivariate_normal(np.zeros(3), np.diag(toy.spread**2)).logpdf(x)
    ln += np.log(np.einsum("i,j,k->ijk", *[weights] * 3).ravel()) + (grid**2).sum(1) / 2
    wanted = np.logaddexp.reduce(ln) + 1.5 * np.log(2) + np.linalg.slogdet(L)[1]
    assert fitted.ln_evidence[0] == pytest.approx(wanted, abs=0.03)


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


def test_probabilities_are_calibrated_where_the_truth_is_drawn_from_the_prior(
    chance: Chance,
) -> None:
    """Of all that is given a probability p, the share p is true, in each of ten bins; and the truth
    is given more than beforehand in 7 of 10 tyres at least.

    False failures: 1.1e-6.
    """
    toy = flat(size=0.004, effects=5, pressures=(240.0,))
    base, random = problem(toy), chance.random
    ids = list(toy.spans)
    before = {NONE: PRIOR_NONE / 0.9} | {id: 0.65 / 0.9 / len(ids) for id in ids}
    given, true = [], []
    for _ in range(200):
        id = random.choice(list(before), p=list(before.values()))
        effects = {} if id == NONE else {id: random.uniform(0, 1)}
        there = base.measured(drawn(toy, base, random, effects, 1.0))
        plain = refit(there, {}, 1)  # none, and singles: no truth is outside here
        none = Hypothesis(NONE, PRIOR_NONE, plain.ln_evidence[0], {}, np.zeros(1), plain)
        p = probabilities([none, *(explain(there, [id], 0.65 / len(ids)) for id in ids)])
        given.append([p[key] for key in before])
        true.append([key == id for key in before])
    p, hit = np.array(given), np.array(true)
    for k in range(10):  # whether the truth is among a bin's: once a tyre, with the sum of its p
        here = np.minimum((10 * p).astype(int), 9) == k
        share = (p * here).sum(1)
        chance.zero_on_average((hit * here).sum(1) - share, 1.0, np.sum(share * (1 - share)))
    chance.often((p * hit).sum(1) > hit @ list(before.values()), 0.7)


def test_false_alarms_and_hits(chance: Chance) -> None:
    """Effect-free: named in 1 of 50 at most. Effects with lambda from 25 on: the most probable in
    93 of 100.

    False failures: 2e-7.
    """
    toy = Toy(effects=8, size=0.01, pressures=(160.0, 320.0))
    base, random = problem(toy), chance.random
    P, _, _ = projection(base, np.zeros(3))
    alarms, right = [], []
    for _ in range(40):
        found = weigh(base.measured(drawn(toy, base, random, {}, 0.3)), pairs=False)
        verdict = decide(found, probabilities(found), len(base.places), 3)
        alarms.append(verdict.kind == "named")
        id, e = f"e{random.integers(8)}", random.uniform(0.2, 1)
        while separate(base, P, {id: e}).lambdas[id] < 25:
            id, e = f"e{random.integers(8)}", random.uniform(0.2, 1)
        found = weigh(base.measured(drawn(toy, base, random, {id: e}, 0.3)), pairs=False)
        p = probabilities(found)
        right.append(max(p, key=lambda key: p[key]) == id)
    chance.often(alarms, 0.0, 0.02)
    chance.often(right, 0.93)


def test_nothing_depends_on_units_or_order() -> None:
    toy = Toy()
    base = problem(toy)
    y = drawn(toy, base, generator(8), {"e2": 0.5}, 0.3)
    p = base.measured(y)
    order = generator(9).permutation(len(y))
    shuffled = replace(
        p,
        places=p.places[order],
        observations=replace(
            p.observations, rows=tuple(p.observations.rows[i] for i in order), y=y[order]
        ),
    )
    one, other = probabilities(weigh(p)), probabilities(weigh(shuffled))
    assert {k: other[k] for k in one} == pytest.approx(one, abs=1e-9)
    # all frequencies, measured and computed, in another unit
    scaled = Toy()
    scaled.base = scaled.base + np.log(2 * np.pi)
    again = problem(scaled, y + np.log(2 * np.pi))
    assert probabilities(weigh(again)) == pytest.approx(one, abs=1e-9)


def test_twins_that_nothing_tells_apart_share_their_probability() -> None:
    """0.98 times an effect, its change with x included: the evidences are integrals of one function
    over 0 to 0.98 and 0 to 1, of the same density, whatever was drawn; by a rule that is right to
    0.2 %."""
    toy = Toy(twin=True)
    toy.tilt["twin"] = 0.98 * toy.tilt["e0"]
    base = problem(toy)
    p = base.measured(drawn(toy, base, generator(10), {"e0": 0.6}, 0.3))
    found = weigh(p, pairs=False)
    share = probabilities(found)
    assert share["twin"] / share["e0"] == pytest.approx(1 / 0.98, rel=2e-3)
    P, _, _ = projection(p, np.zeros(3))
    groups = separate(p, P, {"e0": 0.6, "twin": 0.6}).groups(["e0", "twin", "e1"])
    assert ["e0", "twin"] in groups
    verdict = decide(found, share, len(p.places), 3)
    assert verdict.kind == "undecided" and {"e0", "twin"} <= set(verdict.candidates)


def test_near_twins_have_the_probability_together(chance: Chance) -> None:
    """Twins that change a little otherwise with x are told apart by some tyres and not by others;
    the sum is sure in 19 of 20, and whichever is named is one of the two.

    False failures: 2e-7.
    """
    toy = Toy(twin=True)
    base = problem(toy)
    together, one = [], []
    for _ in range(20):
        p = base.measured(drawn(toy, base, chance.random, {"e0": 0.6}, 0.3))
        found = weigh(p, pairs=False)
        share = probabilities(found)
        together.append(share["e0"] + share["twin"] > 0.8)
        verdict = decide(found, share, len(p.places), 3)
        one.append({verdict.key, *verdict.candidates[:1]} & {"e0", "twin"})
    chance.often(together, 0.95)
    chance.often([bool(each) for each in one], 0.95)


def test_fewer_values_only_widen_the_answer() -> None:
    """Where the model is linear, and the range of the effect is no limit, a posterior's width is
    the data's information alone, whatever was drawn."""
    toy = flat()
    toy.spans["e1"] = Span(-5.0, 5.0)
    base = problem(toy)
    keep = np.arange(len(base.places)) % 3 > 0
    width = lambda q: np.diff([explain(q, ["e1"], 1.0).quantile("e1", s) for s in (0.05, 0.95)])[0]
    for key in range(5):
        p = base.measured(drawn(toy, base, generator("fewer", key), {"e1": 0.7}, 0.3))
        assert width(p.only(keep)) > 1.05 * width(p)


def test_an_effect_is_found_with_values_missing(chance: Chance) -> None:
    """15 % of the values are gone, any of them: it is the most probable all the same, in 19 of 20.

    False failures: 1e-7.
    """
    toy = Toy()
    base, found = problem(toy), []
    for _ in range(20):
        p = base.measured(drawn(toy, base, chance.random, {"e1": 0.7}, 0.3))
        p = p.only(chance.random.random(len(p.places)) > 0.15)
        share = probabilities(weigh(p, pairs=False))
        found.append(max(share, key=lambda key: share[key]) == "e1")
    chance.often(found, 0.95)


def test_a_misread_label_is_outside_and_named(chance: Chance) -> None:
    """In 19 of 20 tyres.

    False failures: 1e-7.
    """
    toy = Toy()
    base, told = problem(toy), []
    for _ in range(20):
        y = drawn(toy, base, chance.random, {}, 0.03)
        y[6 :: len(LABELS)] += 0.08
        found = weigh(base.measured(y), pairs=False)
        verdict = decide(found, probabilities(found), len(y), 3)
        told.append(verdict.kind == "outside" and f"{LABELS[6]} is misread" in verdict.words)
    chance.often(told, 0.95)


def test_exchanged_labels_are_found_whatever_else_is_there(chance: Chance) -> None:
    """With an effect and without, and none where none are exchanged, in 99 of 100 tyres.

    False failures: 2e-7.
    """
    toy = Toy()
    base, quiet, found = problem(toy), [], []
    for effects in ({}, {"e1": 0.9}) * 10:
        plain = base.measured(drawn(toy, base, chance.random, effects, 0.03))
        y = plain.observations.y
        swapped = replace(plain, observations=with_exchanged(plain.observations, *LABELS[6:8]))
        quiet.append(exchanged(plain, weigh(plain), toy.rows) is None)
        found.append(
            exchanged(swapped, weigh(swapped), toy.rows) == tuple(sorted(LABELS[6:8], key=str))
        )
        back = with_exchanged(swapped.observations, *LABELS[6:8])
        assert np.array_equal(back.y, y)
    chance.often(quiet, 0.99)
    chance.often(found, 0.99)


def test_a_shift_of_modes_in_no_catalogue_is_not_named(chance: Chance) -> None:
    """Seen in 99 of 100 tyres, called outside in 8 of 10.

    False failures: 2e-7.
    """
    toy = Toy(size=0.01)
    base, seen, outside = problem(toy), [], []
    for _ in range(40):
        strange = np.tile(chance.random.normal(0, 0.02, len(LABELS)), 3)
        y = drawn(toy, base, chance.random, {}, 0.3) + strange
        found = weigh(base.measured(y), pairs=False)
        verdict = decide(found, probabilities(found), len(y), 3)
        seen.append(verdict.kind != "no_gap")
        outside.append(verdict.kind == "outside")
    chance.often(seen, 0.99)
    chance.often(outside, 0.8)


def test_a_trend_in_no_catalogue_is_not_named(chance: Chance) -> None:
    """Lateral modes off by 1 % a harmonic: seen in 99 of 100 tyres, named in 1 of 20; and likelier
    as a trend than mode by mode in 8 of 10.

    False failures: 3e-7.
    """
    toy = Toy(size=0.01)
    base, seen, named, trend = problem(toy), [], [], []
    lateral = [label.family == "out-of-plane" and label.c for label in LABELS]
    slope = 0.01 * np.array(lateral, float)
    for _ in range(30):
        y = drawn(toy, base, chance.random, {}, 0.3)
        y += np.tile(chance.random.choice([-1, 1]) * slope, 3)
        found = weigh(base.measured(y), pairs=False)
        verdict = decide(found, probabilities(found), len(y), 3)
        seen.append(verdict.kind != "no_gap")
        named.append(verdict.kind == "named")
        (other,) = (h for h in found if h.key == "outside")
        trend.append("smoothly over" in other.words)
    chance.often(seen, 0.99)
    chance.often(named, 0.0, 0.05)
    chance.often(trend, 0.8)


def test_an_effect_at_the_bound_of_its_range_is_not_named() -> None:
    """A third more than its range holds, on a tyre whose model is right otherwise; of three times
    as much, which something else is likelier for, it is said, too."""
    toy = Toy(size=0.04, effects=3)
    base = problem(toy, assumed=Assumed(form=0.001, law=0.3))
    for e, kind in ((1.3, "undecided"), (0.8, "named"), (3.0, "outside")):
        found = weigh(base.measured(toy.base + e * toy.g["e1"]), pairs=False)
        verdict = decide(found, probabilities(found), len(toy.base), 3)
        assert verdict.kind == kind and verdict.best == "e1"
        assert verdict.candidates[0] == ("outside" if kind == "outside" else "e1")
        assert ("e1 at the bound of its range" in verdict.words) == (kind != "named")


def test_a_toggled_run_cancels_what_both_share(chance: Chance) -> None:
    """A tyre whose constants hide the effect: lambda rises by the switched run alone, and the 90 %
    interval then holds the truth in 9 of 10 (the e's are drawn from their prior).

    False failures: 2e-7.
    """
    toy = flat(size=0.01)
    toy.constants = np.stack([toy.g["e0"], toy.g["e1"]], 1)  # gauges that look like effects
    alone = problem(toy)
    both = problem(toy, changes=(Toggle("e0", 0.0),))
    lambdas = []
    for p in (alone, both):
        P, _, _ = projection(p, np.zeros(3))
        lambdas.append(separate(p, P, {"e0": 1.0}).full["e0"])
    assert lambdas[0] < 1 and lambdas[1] > 100
    inside, close = [], []
    for _ in range(100):
        e = chance.random.uniform(0, 1)
        y = drawn(toy, both, chance.random, {}, 1.0)
        y[: len(toy.base)] += e * toy.g["e0"]
        found = explain(both.measured(y), ["e0"], 1.0)
        inside.append(found.quantile("e0", 0.05) <= e <= found.quantile("e0", 0.95))
        close.append(abs(found.mean()["e0"] - e) < 0.1)
    chance.often(inside, 0.88, 0.92)
    chance.often(close, 0.8)


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
        share = probabilities(weigh(p, pairs=False))
        none.append(max(share, key=lambda key: share[key]) == NONE)
    chance.distributed(p_values, "uniform")
    chance.often(none, 0.9)


def test_a_refit_never_ends_above_where_it_began() -> None:
    """Where the model bends and nothing fits undamped steps jump from side to side."""
    random = generator("refit")
    for _ in range(20):
        toy = Toy(effects=0, bend=0.3, pressures=(240.0,))
        p = problem(toy, assumed=Assumed(form=0.02))
        p = p.measured(toy.base + random.normal(0, 0.3, len(toy.base)))
        inverse, start = np.linalg.inv(p.sigma), p.centre - p.expansion.x0

        def misfit(d: np.ndarray) -> float:
            r, off = p.observations.y - p.plain(d)[0], (d - start) / p.spread  # noqa: B023
            return float(r @ inverse @ r + off @ off)  # noqa: B023

        d = refit(p, {}, 1).d[0]
        assert misfit(d) <= misfit(0 * d)
        again = refit(p, {}, 1, near=d[None]).d[0]
        assert misfit(again) <= misfit(d) * (1 + 1e-12)


def test_covariance_is_what_it_says() -> None:
    """Model-form error: exp(-ln(1.5)^2 / (2 0.6^2)) between 160 and 240 kPa, 0.97 between runs,
    none between modes."""
    toy = Toy(pressures=(160.0, 240.0))
    p = problem(toy, changes=(Toggle("e0", 0.0),), noise=1e-9)
    S = covariance(p.observations, 0 * p.constants, 0.0, form=0.01) / 1e-4
    n = len(toy.base)
    smooth = np.exp(-(np.log(1.5) ** 2) / (2 * 0.54**2))
    assert S[0, len(LABELS)] == pytest.approx(smooth)
    assert S[0, n] == pytest.approx(0.97)
    assert S[0, n + len(LABELS)] == pytest.approx(0.97 * smooth)
    assert S[0, 1] == 0 and np.linalg.eigvalsh(S).min() > 0


def test_material_laws_are_off_in_all_modes_by_family_and_by_mode_smoothly() -> None:
    """3 % each beside the form on record, 0.4 in ln p apart: exp(-0.4^2 / (2 0.8^2)) alike; [0,0]
    torsional and [1,0] move in the plane, [1,1] does not; a stated form stands for both; the mass
    has neither."""
    toy = Toy(pressures=(160.0, 160.0 * np.exp(0.4)))
    p = problem(toy, noise=1e-9)
    mass = Observable("mass_kg", None, 0.0)
    rows = (*p.observations.rows, mass)
    added = (model_form(rows, 0.03) - model_form(rows, 0.0)) / 0.03**2
    n, near = len(LABELS), np.exp(-(0.4**2) / (2 * 0.8**2))
    said = [str(label) for label in LABELS]
    torsional, lateral, vertical = map(said.index, ("[0,0] torsional", "[1,1]", "[1,0]"))
    assert added[0, 0] == added[n, n] == pytest.approx(3.0)
    assert added[0, n] == pytest.approx(3 * near)
    assert added[vertical, torsional] == added[0, lateral] == pytest.approx(2.0)
    assert added[lateral, vertical] == pytest.approx(1.0)
    assert added[lateral, vertical + n] == pytest.approx(near)
    assert not added[-1].any() and np.linalg.eigvalsh(added).min() > -1e-12
    assert np.array_equal(model_form(rows, 0.03, form=0.01), model_form(rows, 0.0, form=0.01))


def test_an_effects_law_that_is_off_is_still_the_effect(chance: Chance) -> None:
    """A real effect 10 % off the catalogue's, far beyond the scatter: named with the stated
    looseness of laws in 9 of 10, judged outside without it in 9 of 10.

    False failures: 2e-7.
    """
    toy = Toy(size=0.15)
    strict = problem(toy, assumed=Assumed(form=0.001, law=0.0))
    outside, named = [], []
    for _ in range(20):
        real = np.tile(1 + 0.1 * chance.random.normal(size=len(LABELS)), 3)
        y = toy.base + real * toy.g["e0"]
        for law, told in ((0.0, outside), (0.1, named)):
            p = replace(strict, assumed=Assumed(form=0.001, law=law)).measured(y)
            found = weigh(p, pairs=False)
            verdict = decide(found, probabilities(found), len(y), 3)
            told.append((verdict.kind, verdict.key))
    chance.often([kind == "outside" for kind, _ in outside], 0.9)
    chance.often([each == ("named", "e0") for each in named], 0.9)


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


def test_the_interval_of_the_parameter_covers(chance: Chance) -> None:
    """The 90 % interval holds the true parameter, drawn from its prior, in 90 of 100 tyres, and one
    at most for the grid.

    False failures: 1e-7.
    """
    toy = flat(size=0.01, pressures=(240.0,), effects=1)
    base, inside = problem(toy), []
    for _ in range(300):
        e = chance.random.uniform(0, 1)
        found = explain(base.measured(drawn(toy, base, chance.random, {"e0": e}, 1.0)), ["e0"], 1.0)
        inside.append(found.quantile("e0", 0.05) <= e <= found.quantile("e0", 0.95))
    chance.often(inside, 0.89, 0.91)
