"""Several effects at once, and constants: which, how surely; on a tyre in closed form."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tyrecal.report.diagnosis import page
from tyrecal.studies.diagnose.diagnosis import Diagnosis, diagnose
from tyrecal.studies.diagnose.evidence import COVERAGE, explain
from tyrecal.studies.diagnose.posteriors import constants_posterior
from tyrecal.studies.diagnose.result import diagnosis_result
from tyrecal.studies.diagnose.robustness import robustness
from tyrecal.studies.diagnose.several import (
    PARTNERS,
    _gains,
    before,
    next_candidates,
    present,
    probabilities,
    weigh_hypotheses,
)
from tyrecal.studies.diagnose.study import DiagnosedCase
from tyrecal.studies.diagnose.verdict import Further, decide, most_sure, perhaps
from tyrecal.studies.inference.expansion import anchored
from tyrecal.studies.inference.model import EffectRange, Query

from ..chance import generator
from .toy import Toy, drawn, problem

pytestmark = pytest.mark.numbers


def exact(toy: Toy, effects: dict[str, float], **keys: Any) -> Diagnosis:
    """Diagnosis of the toy's own data without scatter."""
    base = problem(toy)
    y = toy.base + sum(e * toy.g[id] for id, e in effects.items())
    observations = base.measured(y).observations
    return diagnose(toy, toy.rows, observations, assumed=base.assumed, **keys)


def test_the_most_effects_that_are_sure_are_named_whatever_else_there_is() -> None:
    p = {"a": 0.45, "a+b": 0.3, "a+c": 0.12, "b": 0.03, "none": 0.02, "outside": 0.08}
    assert present(p, ["a"]) == pytest.approx(0.87) and most_sure(p) == "a"
    further = {each.id: each.probability for each in perhaps(p, "a")}
    assert list(further) == ["b", "c"] and list(further.values()) == pytest.approx([0.3, 0.12])
    assert most_sure({**p, "a+b": 0.7, "a": 0.05}) == "a+b"
    assert most_sure({"a": 0.4, "b": 0.4, "none": 0.2}) is None


def test_three_effects_are_found() -> None:
    """Each seen many times over, in data without scatter, whatever lies outside the catalogue."""
    toy = Toy(effects=5, size=0.02, bend=0.0, pressures=(160.0, 320.0))
    base = problem(toy)
    truth = {"e0": 0.8, "e2": 0.7, "e4": 0.9}
    y = toy.base + sum(e * toy.g[id] for id, e in truth.items())
    hypotheses = weigh_hypotheses(base.measured(y))
    p = probabilities(hypotheses)
    assert decide(hypotheses, p, len(y), 3).key == "e0+e2+e4" and p["e0+e2+e4"] > 0.9
    best = next(h for h in hypotheses if h.key == "e0+e2+e4")
    assert best.mean() == pytest.approx(truth, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("sizes", [{}, {"e1": 0.4}, {"e0": 0.8, "e2": 0.7}])
def test_few_points_are_enough_for_sets_that_do_not_matter(sizes: dict[str, float]) -> None:
    """ln Z within 0.5 of that by the full rule, whose narrow peaks it finds; probabilities within
    1e-3 of those where every set has the full rule."""
    toy = Toy(effects=5)
    p = problem(toy).measured(toy.base + sum(e * toy.g[id] for id, e in sizes.items()))
    hypotheses = weigh_hypotheses(p)
    several = [h for h in hypotheses if len(h.values) > 1]
    assert any(h.few for h in several)
    full = {h.key: explain(p, list(h.values), h.prior) for h in several}
    for h in several:
        assert h.ln_evidence == pytest.approx(full[h.key].ln_evidence, abs=0.5 if h.few else 1e-9)
    every = probabilities([full.get(h.key, h) for h in hypotheses])
    assert probabilities(hypotheses) == pytest.approx(every, abs=1e-3)


@pytest.mark.slow
def test_what_the_model_was_asked_nothing_more_of_stands() -> None:
    """As weighed anew: after one effect was asked again, and after two were together."""
    toy = Toy(effects=3, bend=0.05)
    base = problem(toy, x0=np.array([0.1, 0.0, -0.1]))
    base = base.measured(toy.base + 0.6 * toy.g["e0"] + 0.5 * toy.g["e2"])
    first, x = weigh_hypotheses(base), base.expansion.x0 + 0.2
    for sizes in ({"e0": 0.6}, {"e0": 0.6, "e2": 0.5}):
        again = replace(base, expansion=anchored(base.expansion, toy, [Query(x, sizes)]))
        later, anew = weigh_hypotheses(again, before=(base, first)), weigh_hypotheses(again)
        assert [h.key for h in later] == [h.key for h in anew]
        for h, other in zip(later, anew, strict=True):
            assert h.ln_evidence == pytest.approx(other.ln_evidence, abs=1e-12)
        stood = {h.key for h in later if any(h is each for each in first)}
        assert stood and not any(set(sizes) <= set(key.split("+")) for key in stood)


def test_a_third_effect_is_looked_for_where_the_rest_of_the_gap_is_like_it() -> None:
    """Data without scatter, in a linear model: the effect that is there comes before all others."""
    toy = Toy(effects=8, bend=0.0)
    for id in toy.tilt:
        toy.tilt[id] = 0 * toy.tilt[id]
    base = problem(toy)
    p = base.measured(toy.base + 0.8 * toy.g["e1"] + 0.5 * toy.g["e4"] + 0.6 * toy.g["e7"])
    assert next_candidates(p, explain(p, ["e1", "e4"], 1.0))[0] == "e7"


def test_a_gain_does_not_depend_on_the_unit_of_another_effect() -> None:
    gains = []
    for unit in (1.0, 0.1):
        toy = Toy(effects=2, bend=0.0)
        toy.ranges["e0"] = EffectRange(0.0, unit)
        toy.g["e0"], toy.tilt["e0"] = toy.g["e0"] / unit, toy.tilt["e0"] / unit
        p = problem(toy).measured(toy.base + 0.5 * unit * toy.g["e0"] + 0.3 * toy.g["e1"])
        gains.append(_gains(p, explain(p, ["e0"], 1.0))["e1"][0])
    np.testing.assert_allclose(*gains, rtol=1e-6)


def test_two_effects_that_hide_one_another_are_found() -> None:
    """The two effects are v + u and v - u: no calibration sees them, v and u are orthogonal in the
    measure Sigma, and u is six times as long. Of 2 v, which both move, either alone explains a part
    in 37; each of four others, v and something of its own, explains more; both explain all."""
    toy = Toy(effects=6, size=0.004, bend=0.0, pressures=(160.0, 240.0))
    for id in toy.tilt:
        toy.tilt[id] = 0 * toy.tilt[id]
    root = np.linalg.cholesky(problem(toy).sigma)
    Q, _ = np.linalg.qr(np.linalg.solve(root, np.column_stack([toy.J, toy.g["e0"], toy.g["e1"]])))
    v, u = 5 * root @ Q[:, 3], 30 * root @ Q[:, 4]
    toy.g = {id: v + g for id, g in toy.g.items()} | {"e0": v + u, "e1": v - u}
    base = problem(toy)
    hypotheses = weigh_hypotheses(base.measured(toy.base + 0.9 * (toy.g["e0"] + toy.g["e1"])))
    alone = sorted((h for h in hypotheses if len(h.values) == 1), key=lambda h: -h.ln_evidence)
    assert {h.key for h in alone[:PARTNERS]}.isdisjoint({"e0", "e1"})
    assert decide(hypotheses, probabilities(hypotheses), len(base.places), 3).key == "e0+e1"


def test_a_size_that_the_case_states_as_possible_is_a_constant() -> None:
    """Within two of its standard deviations it counts to what is without the effect, before the
    data and after; the sum stays 1, and nothing changes where nothing is stated."""
    toy = Toy(effects=3, size=0.03)
    base = problem(toy)
    p = base.measured(toy.base + 0.3 * toy.g["e0"])
    ranges = {**toy.ranges, "e0": replace(toy.ranges["e0"], prior_sd=0.2)}
    stated = replace(p, ranges=ranges)
    plain, hypotheses = weigh_hypotheses(p), weigh_hypotheses(stated)
    one, other = probabilities(plain), probabilities(hypotheses)
    assert sum(other.values()) == pytest.approx(1) and sum(one.values()) == pytest.approx(1)
    h = next(h for h in plain if h.key == "e0")
    far = abs(h.values["e0"]) > COVERAGE * 0.2
    assert other["e0"] == pytest.approx(one["e0"] * h.posterior[far].sum(), abs=1e-9)
    assert one["e0"] > 0.7 > 0.1 > other["e0"] and other["none"] > 0.7
    prior = before(hypotheses)
    assert prior["e0"] == pytest.approx(before(plain)["e0"] * 0.6, rel=0.05)
    assert prior["none"] > before(plain)["none"]
    assert decide(plain, one, len(base.places), 3).key == "e0"
    assert decide(hypotheses, other, len(base.places), 3).kind == "no_gap"


def test_what_the_data_say_of_constants() -> None:
    """A tyre whose gauge is off by two standard deviations: E z in closed form, and never an
    effect's name."""
    toy = Toy(effects=2, bend=0.0)
    toy.constants = 3 * toy.constants
    base = problem(toy)
    y = toy.base + 2 * toy.constants[:, 1]
    d = diagnose(toy, toy.rows, base.measured(y).observations, assumed=base.assumed)
    assert d.verdict.kind == "no_gap"
    shifts = {each.name: each.shift_in_sd for each in constants_posterior(d)}
    whole = base.sigma + toy.J @ toy.J.T
    wanted = toy.constants.T @ np.linalg.inv(whole) @ (y - toy.base)
    assert [shifts[name] for name in toy.sources] == pytest.approx(wanted, abs=0.01)
    assert next(iter(shifts)) == "gauge" and 1.5 < shifts["gauge"] < 2
    result = diagnosis_result(d).content()
    assert result["constants"][0]["name"] == "gauge" and result["effect"] is None


def test_several_effects_are_told_with_what_each_shrinks() -> None:
    d = exact(Toy(effects=2, size=0.05, pressures=(160.0, 240.0)), {"e0": 0.8, "e1": 0.6})
    assert d.verdict.key == "e0+e1" and d.leading == "e0+e1"
    content = diagnosis_result(d).content()
    assert set(content["parameters"]) == {"e0", "e1"} and content["also"] == []
    assert set(content["shrinkage"]["each"]) == {"e0", "e1"}
    assert min(content["shrinkage"]["each"].values()) > 0.3


@pytest.mark.slow
def test_an_effect_that_others_may_stand_beside_has_one_size() -> None:
    """Over all explanations that have it, by their probabilities."""
    toy = Toy(effects=4, size=0.012, pressures=(240.0,))
    base = problem(toy)
    y = drawn(toy, base, generator("beside"), {"e0": 0.9, "e1": 0.3}, 0.3)
    d = diagnose(toy, toy.rows, base.measured(y).observations, assumed=base.assumed)
    keys = [h for h in d.hypotheses if "e0" in h.key.split("+")]
    weights = np.array([h.prior * np.exp(h.ln_evidence - keys[0].ln_evidence) for h in keys])
    means = [h.mean()["e0"] for h in keys]
    assert d.parameter("e0")["value"] == pytest.approx(weights @ means / weights.sum())


@pytest.mark.slow
def test_what_a_strong_verdict_hangs_on() -> None:
    """On nothing; its probability over priors of none, half and twice as large, lies inside."""
    d = exact(Toy(effects=3, size=0.05, pressures=(160.0, 240.0)), {"e0": 0.8})
    assert d.verdict.key == "e0" and d.robustness.robust and not d.robustness.hangs_on
    assert 0.9 < d.robustness.low <= present(d.probabilities, ["e0"]) <= d.robustness.high <= 1
    content = diagnosis_result(d).content()["robust"]
    assert content == {
        "robust": True,
        "hangs_on": [],
        "range": [d.robustness.low, d.robustness.high],
    }


def test_what_a_verdict_by_a_constant_hangs_on() -> None:
    """A gauge that looks like e0: e0 is named while that is thought to be well known, and not where
    it is known half as well; every probability comes from the priors as they should."""
    toy = Toy(effects=2, bend=0.0, pressures=(160.0, 240.0))
    toy.constants = np.stack([toy.constants[:, 0], 0.16 * toy.g["e0"]], 1)
    d = exact(toy, {"e0": 0.7})
    assert d.verdict.key == "e0"
    result = d.robustness
    assert "the standard deviation of gauge twice as large (then undecided)" in result.hangs_on
    assert not any("half as large" in each and "gauge" in each for each in result.hangs_on)
    p = d.probabilities["none"]
    assert result.low < 1 - 2 * p / (1 + p)


def test_the_range_is_that_of_the_priors_where_nothing_else_is_in_doubt() -> None:
    """Data that are far beyond their form, laws and constants: p / (p + k (1 - p)) and its like,
    computed from the evidences."""
    toy = Toy(effects=2, size=0.02, bend=0.0)
    base = problem(toy)
    hypotheses = weigh_hypotheses(base.measured(toy.base + 0.3 * toy.g["e0"]))
    p = probabilities(hypotheses)
    verdict = decide(hypotheses, p, len(base.places), 3)
    ranges = []
    for keys in (["none"], ["outside"], ["e0+e1"], ["e0", "e0+e1"]):
        for factor in (0.5, 2.0):
            total = sum(each * (factor if key in keys else 1) for key, each in p.items())
            e0 = sum(p[key] * (factor if key in keys else 1) for key in ("e0", "e0+e1"))
            ranges.append(e0 / total)
    judged = robustness(
        base.measured(toy.base + 0.3 * toy.g["e0"]), hypotheses, verdict, toy.sources
    )
    assert judged.low <= min(ranges) + 1e-9 and max(ranges) - 1e-9 <= judged.high


def test_the_page_says_what_it_hangs_on_and_what_is_perhaps_there_first() -> None:
    toy = Toy(effects=2, bend=0.0, pressures=(160.0, 240.0))
    toy.constants = np.stack([toy.constants[:, 0], 0.16 * toy.g["e0"]], 1)
    ranges = {**toy.ranges, "e0": replace(toy.ranges["e0"], prior_sd=0.2)}
    toy.ranges = ranges
    d = exact(toy, {"e0": 0.7})
    also = replace(d.verdict, also=(Further("e1", 0.25),))
    words = page(
        DiagnosedCase(replace(d, verdict=also), (), False, {}, (), toy),  # type: ignore[arg-type]
        "tyre",
        "a.csv",
    )
    first = words.partition("## Is there a gap?")[0]
    assert "## Named: e0, and perhaps e1" in first
    assert "Perhaps there too: e1 (`e1`), probability 0.25." in first
    assert "The verdict depends on the standard deviation of gauge twice as large" in first
    assert "times the standard deviation of the case" in first
    assert f"between {d.robustness.low:.2f} and {d.robustness.high:.2f}" in first
    assert "The case states `e0` as uncertain. Within 2 standard deviations" in words
    plain = exact(toy, {"e0": 0.01})
    text = page(DiagnosedCase(plain, (), False, {}, (), toy), "tyre", "a.csv")  # type: ignore[arg-type]
    assert text.startswith("# The model of tyre against its measurements")
    assert "the probability of no effect is between" in text
