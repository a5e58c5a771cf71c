"""Rules of the diagnosis at their limits, verdicts in words, and small formulas by hand."""

from __future__ import annotations

from dataclasses import replace
from math import comb
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from tyrecal.studies.diagnose.evidence import (
    INFLATION,
    UNKNOWN,
    Fitted,
    Hypothesis,
    explain,
    outside,
    refit,
)
from tyrecal.studies.diagnose.gap import ResidualGroup, _chi2, _corrected, find_gap
from tyrecal.studies.diagnose.labelings import _near
from tyrecal.studies.diagnose.several import HIDDEN_PAIRS, priors, weigh_hypotheses
from tyrecal.studies.diagnose.verdict import decide, no_gap_words
from tyrecal.studies.diagnose.where import section_map
from tyrecal.studies.inference.inverse_problem import Assumed, Toggle
from tyrecal.studies.inference.model import Answer, EffectRange, Query
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.studies.inference.plain_fit import plain_fit
from tyrecal.studies.inference.regions import SectionPart
from tyrecal.tyre.effects import catalogue

from ..chance import generator
from ..conftest import CASES
from .toy import LABELS, Toy, drawn, problem

pytestmark = pytest.mark.numbers


Array = np.ndarray


def test_holms_correction_by_hand() -> None:
    """p-values 0.01, 0.04, 0.03, 0.5: times 4, 2, 3 and 1 by their order, never falling."""
    groups = [ResidualGroup("k", str(p), 0.0, 0.0, 1, p, p) for p in (0.01, 0.04, 0.03, 0.5)]
    assert [g.corrected for g in _corrected(groups)] == pytest.approx([0.04, 0.09, 0.09, 0.5])
    high = [ResidualGroup("k", str(p), 0.0, 0.0, 1, p, p) for p in (0.6, 0.9)]
    assert [g.corrected for g in _corrected(high)] == [1.0, 1.0]


def test_residuals_without_scatter_in_a_direction_count_in_the_others() -> None:
    C = np.diag([4.0, 1.0, 0.9e-6 * 4, 1.1e-6 * 4])
    value, freedom = _chi2(np.array([2.0, 3.0, 5.0, 0.0]), C)
    assert freedom == 3 and value == pytest.approx(1 + 9)
    assert _chi2(np.zeros(2), np.zeros((2, 2)))[1] == 0


def test_a_gap_by_its_formula() -> None:
    """r^T P r with splits, what calibration absorbs of an effect, and what it makes of x."""
    toy = Toy(effects=2, bend=0.0, pressures=(240.0, 320.0))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    toy.ranges["e1"] = EffectRange(-2.0, 1.0)
    base = problem(toy)
    y = drawn(toy, base, generator("gap"), {"e0": 0.5}, 0.3)
    p = base.measured(y)
    pairs = np.where(np.arange(len(y)) % 2, 0.005, np.nan)
    p = replace(p, observations=replace(p.observations, split=pairs, split_scatter=0.8 * pairs))
    d = refit(p, {}, 1).d[0]
    gap = find_gap(p, d, ("A", "B", "C"))
    marginal = np.linalg.inv(p.sigma + toy.J @ np.diag(toy.spread**2) @ toy.J.T)
    r = y - toy.base - toy.J @ d
    splits = np.isfinite(pairs).sum() * 0.005**2 / (0.004**2 + 0.003**2)
    assert gap.chi2 == pytest.approx(r @ marginal @ r + splits)
    assert gap.freedom == len(y) - 3 + np.isfinite(pairs).sum()
    assert gap.p_value == pytest.approx(chi2.sf(gap.chi2, gap.freedom))
    assert gap.residuals == pytest.approx(r)
    assert gap.rms_percent == pytest.approx(100 * np.sqrt(np.mean(r**2)))
    for id, e in (("e0", 1.0), ("e1", -2.0)):
        g, S = e * toy.g[id], np.linalg.inv(p.sigma)
        assert gap.absorbed[id] == pytest.approx(1 - g @ marginal @ g / (g @ S @ g))
        information = toy.J.T @ S @ toy.J + np.diag(toy.spread**-2.0)
        x = np.linalg.solve(information, toy.J.T @ S @ g)
        assert [gap.bias_percent[n][id] for n in "ABC"] == pytest.approx(100 * np.expm1(x))


def test_what_was_switched_on_purpose_is_no_part_of_another_effect() -> None:
    """A second run with e1 = 0.5: what calibration hides of e0 is what it hides of two runs."""
    toy = Toy(effects=2, bend=0.0, pressures=(240.0,))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    p = problem(toy, changes=(Toggle("e1", 0.5),))
    gap = find_gap(p, np.zeros(3), ("A", "B", "C"))
    J, g = np.vstack([toy.J, toy.J]), np.concatenate([toy.g["e0"], toy.g["e0"]])
    marginal = np.linalg.inv(p.sigma + J @ np.diag(toy.spread**2) @ J.T)
    share = 1 - g @ marginal @ g / (g @ np.linalg.inv(p.sigma) @ g)
    assert gap.absorbed["e0"] == pytest.approx(share)


def test_a_part_of_the_section_by_its_formula() -> None:
    """change = b / (a + 1 / s^2) for g by unit change, with s = 20 % of stiffness, 10 % of mass."""
    toy = Toy(effects=1)
    p = problem(toy)
    n, random = len(p.places), generator("where")
    P, r = np.diag(random.uniform(1e4, 4e4, n)), random.normal(0, 0.01, n)
    k, m = random.normal(0, 0.05, (2, n))
    parts = [
        SectionPart("a", k, 0 * m, ""),
        SectionPart("b", 0 * k, m, ""),
        SectionPart("c", 3 * k, 1e-9 * m, ""),
    ]
    places, rank_ = section_map(p, P, r, parts)
    at = {place.region: place for place in places}
    for g, s, part in ((k, 0.2, "a"), (m, 0.1, "b")):
        a, b = g @ P @ g, g @ P @ r
        change = b / (a + 1 / s**2)
        ln = b**2 / (a + 1 / s**2) / 2 - np.log(1 + s**2 * a) / 2
        kind = "stiffness" if part == "a" else "mass"
        assert getattr(at[part], f"{kind}_percent") == pytest.approx(100 * change)
        sigma = 100 / np.sqrt(a + 1 / s**2)
        assert getattr(at[part], f"{kind}_sigma") == pytest.approx(sigma)
        assert at[part].evidence == pytest.approx(max(ln, 0.0))
    assert at["a"].mass_percent == at["b"].stiffness_percent == 0.0
    assert [place.evidence for place in places] == sorted(
        (q.evidence for q in places), reverse=True
    )
    assert section_map(p, P, r, []) == ([], 0)
    assert rank_ == 2  # a and c are one direction, b the other


def test_parts_look_alike_from_a_cosine_of_095_on() -> None:
    toy = Toy(effects=1)
    p = problem(toy)
    n = len(p.places)
    one, other = np.eye(n)[:2]
    near = lambda cosine: cosine * one + np.sqrt(1 - cosine**2) * other
    for cosine, same in ((0.96, True), (0.94, False), (-0.96, True)):
        parts = [SectionPart("a", one, 0 * one, ""), SectionPart("b", near(cosine), 0 * one, "")]
        places, _ = section_map(p, 1e4 * np.eye(n), one, parts)
        assert [bool(place.same_as) for place in places] == [same, same]


def test_outside_is_half_unknown_effects_and_half_errors_of_reading() -> None:
    """ln of the mean evidence of each kind; what it names is the likeliest."""
    toy = Toy(effects=1, pressures=(160.0, 240.0))
    base = problem(toy)
    p = base.measured(drawn(toy, base, generator("outside"), {}, 0.3))
    rows, S = p.observations.rows, p.sigma
    same = np.array(
        [
            [
                (a.label == b.label) * (0.9 if a.pressure_kPa != b.pressure_kPa else 1.0)
                for b in rows
            ]
            for a in rows
        ]
    )
    ln = lambda extra: refit(p, {}, 1, extra).ln_evidence[0]
    unknown = [ln(size**2 * same) for size in UNKNOWN] + [ln((k**2 - 1) * S) for k in INFLATION]
    between = np.array(
        [[0.9 if a.pressure_kPa != b.pressure_kPa else 1.0 for b in rows] for a in rows]
    )
    labels, y = [row.label for row in rows], p.observations.y
    kind = lambda label: "[0,0]" if label.kind else label.family
    for near in (
        [[(kind(a) == kind(b)) * np.exp(-((a.c - b.c) ** 2) / 8) for b in labels] for a in labels],
        np.exp(-2 * (y[:, None] - y) ** 2),
    ):
        unknown += [ln(size**2 * between * np.array(near)) for size in UNKNOWN]
    misread = []
    for label in LABELS:
        hit = np.array([row.label == label for row in rows])
        misread.append(ln(0.04 * same * np.outer(hit, hit)))
    kinds = [np.logaddexp.reduce(each) - np.log(len(each)) for each in (unknown, misread)]
    hypothesis = outside(p)
    assert hypothesis.prior == 0.1
    assert hypothesis.ln_evidence == pytest.approx(np.logaddexp(*kinds) - np.log(2), abs=1e-6)
    assert (UNKNOWN, INFLATION) == ((0.005, 0.01, 0.02, 0.04), (2.0, 4.0))


def test_peaks_of_a_pair_are_integrated() -> None:
    """ln Z against a fine grid, where the model is linear in both sizes: one of them is seen to a
    few hundredths of its range, the other not at all, so that the peak is a ridge."""
    toy = Toy(effects=2, size=0.03, bend=0.0, pressures=(240.0,))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    toy.g["e1"] = 0.03 * toy.g["e1"]
    base = problem(toy)
    G = np.stack([toy.g["e0"], toy.g["e1"]], 1)
    p = base.measured(toy.base + G @ [0.4321, 0.5])
    whole = p.sigma + toy.J @ np.diag(toy.spread**2) @ toy.J.T
    A, n = G.T @ np.linalg.inv(whole) @ G, len(p.places)
    assert 500 < A[0, 0] < 1000 and A[1, 1] < 1
    points = (np.arange(2000) + 0.5) / 2000 - 0.4321, (np.arange(100) + 0.5) / 100 - 0.5
    off = np.stack(np.meshgrid(*points, indexing="ij"))
    ln = -np.einsum("iab,ij,jab->ab", off, A, off) / 2
    scale = -(np.linalg.slogdet(whole)[1] + n * np.log(2 * np.pi)) / 2
    wanted = np.log(np.mean(np.exp(ln))) + scale
    hypothesis = explain(p, ["e0", "e1"], 1.0)
    assert hypothesis.ln_evidence == pytest.approx(wanted, abs=0.2)
    assert hypothesis.mean()["e0"] == pytest.approx(0.4321, abs=0.01)


def test_prior_probabilities_are_one_together() -> None:
    """A quarter for none, a tenth for what is outside; of the rest each further effect has a
    twentieth of what one less has, over all sets, tried or not."""
    toy = Toy(effects=9, pressures=(240.0,))
    base = problem(toy)
    by_key = {
        h.key: h for h in weigh_hypotheses(base.measured(drawn(toy, base, generator(1), {}, 0.3)))
    }
    assert by_key["none"].prior == 0.25 and by_key["outside"].prior == 0.1
    singles = [h for key, h in by_key.items() if key in toy.ranges]
    pairs = [h for key, h in by_key.items() if "+" in key]
    assert sum(h.prior for h in singles) == pytest.approx(0.65 / 1.0525)
    pairs = [h for h in pairs if h.key.count("+") == 1]
    assert [h.prior for h in pairs] == pytest.approx([0.0325 / 1.0525 / 36] * 30)
    for further in (0.1, 0.5):
        prior = priors(25, further)
        shares = {k: each * comb(25, k) for k, each in prior.items()}
        assert sum(shares.values()) == pytest.approx(0.65)
        assert [shares[k] / shares[k - 1] for k in (2, 3)] == pytest.approx([further] * 2)
    best = sorted(singles, key=lambda h: -h.ln_evidence)[:4]
    left = {h.key for h in singles} - {h.key for h in best}
    assert sum(set(h.values) <= left for h in pairs) == HIDDEN_PAIRS  # of ten of theirs
    alone = {h.key: h.prior for h in weigh_hypotheses(base, pairs=False)}
    assert sum(alone.values()) == pytest.approx(1)
    one = replace(base.expansion, nodes={"e3": base.expansion.nodes["e3"]})
    known = weigh_hypotheses(replace(base, expansion=one))
    assert {h.key: h.prior for h in known}["e3"] == pytest.approx(0.65)


def test_the_plain_fit_ends_near_the_minimum_and_takes_no_leaps() -> None:
    """The model bends and the fit starts from afar; no step goes beyond 0.7 in any x."""
    toy = Toy(effects=0, bend=0.02)
    p = problem(toy)
    (there,) = toy.answers([Query(np.array([1.5, -1.2, 0.8]))])
    assert isinstance(there, Answer)
    visited: list[Array] = []
    answers = toy.answers
    toy.answers = lambda points: [visited.append(q.x) for q in points] and answers(points)  # type: ignore[func-returns-value, method-assign, assignment]
    x = plain_fit(toy, p.measured(there.eta).observations, p.places, 0.001)
    steps = np.abs(np.diff(visited, axis=0)).max(1)
    assert steps[0] == pytest.approx(0.7) and steps.max() < 0.7 + 1e-9 and len(visited) <= 10
    value = lambda x: float(np.sum((toy._answer(Query(x)).eta - there.eta) ** 2))
    assert np.array_equal(x, visited[-1]) and np.array_equal(
        x, visited[-2]
    )  # for the covariance again
    assert abs(x - [1.5, -1.2, 0.8]).max() < 0.05 and value(x) < value(visited[-3]) / 2
    evaluations = len(visited)
    again = plain_fit(toy, p.measured(there.eta).observations, p.places, 0.001, begin=x)
    assert abs(again - x).max() < 0.05 and len(visited) - evaluations <= 3


@pytest.mark.parametrize("wall", [0.1, 0.59])
def test_the_plain_fit_steps_back_from_what_has_no_solution(wall: float) -> None:
    """From far beyond it, and with the last short step."""
    toy = Toy(effects=0, bend=0.0)
    p = problem(toy)
    (there,) = toy.answers([Query(np.array([0.6, 0.0, 0.0]))])
    assert isinstance(there, Answer)
    answer = toy._answer

    def walled(point: Query) -> Answer:
        return ValueError("wall") if point.x[0] > wall else answer(point)  # type: ignore[return-value]

    toy._answer = walled  # type: ignore[method-assign]
    x = plain_fit(toy, p.measured(there.eta).observations, p.places, 0.001)
    assert wall - 0.05 < x[0] <= wall


def test_a_change_counts_from_what_the_case_has() -> None:
    """Set to a value, or times one."""
    e = {"a": np.array([0.0, 0.5]), "b": np.array([1.0, 2.0])}
    assert Toggle("a", 0.3, base=0.2).applied(e, 2)["a"] == pytest.approx([0.1, 0.1])
    assert Toggle("a", 3.0, True, 0.2).applied(e, 2)["a"] == pytest.approx([0.4, 1.9])
    assert Toggle("c", 3.0, True, 0.2).applied(e, 2)["c"] == pytest.approx([0.4, 0.4])
    assert Toggle("a", 0.3).applied(e, 2)["b"] is e["b"]


def test_labels_far_apart_are_not_taken_for_each_other() -> None:
    """Only what lies within 30 % of each other in some state."""
    rows = tuple(Observable("frequency_Hz", x, p) for x in LABELS[2:5] for p in (160.0, 240.0))
    y = np.array([0.0, 0.0, 0.29, -0.35, 0.31, 0.33])
    none = np.full(6, np.nan)
    pairs = set(_near(Observations(rows, y, none, 0.0, none, none)))
    assert pairs == {(LABELS[3], LABELS[2]), (LABELS[3], LABELS[4])}


def test_the_guide_says_what_is_assumed() -> None:
    """The guide gives the errors of an effect's law and of splits, and the form's error is the one
    on record."""
    guide = (CASES / "diagnosis.md").read_text()
    assumed = Assumed()
    laws = [100 * effect.response_error for effect in catalogue().values()]
    assert f"may be off by {min(laws):g} to {max(laws):g} % of its own shift" in guide
    _, _, integrated = guide.partition("Uncertain details of some effects are marginalised")
    integrated, _, _ = integrated.partition("\n\n")
    for effect in catalogue().values():
        assert (effect.shape_uncertainty is not None) == (f"`{effect.id}`" in integrated)
    assert assumed.response_error is None and assumed.form is None and assumed.split == 0.003


def explained(p_value: float, rows: int, variables: int, parameters: int = 1) -> Hypothesis:
    """The effect "a" whose best fit has that p-value with so many degrees of freedom; a fit beside
    the best one is far worse."""
    value = float(chi2.isf(p_value, max(1, rows - variables - parameters)))
    ln, none = np.array([-3.0, -1.0, -2.0]), np.zeros((3, 1))
    fitted = Fitted(ln, none, np.array([1e4, value, 1e4]), none[:, :, None], none[:, :0])
    return Hypothesis("a", 0.5, -1.0, {f"a{i}": ln for i in range(parameters)}, ln, fitted)


def judged(a: float, none: float, outside: float = 0.0, p_value: float = 0.5, **of: int) -> Any:
    """Verdict where the effects a and b, none and outside have these probabilities."""
    rows, variables = of.get("rows", 20), of.get("variables", 3)
    h = explained(p_value, rows, variables, of.get("parameters", 1))
    other = Hypothesis("outside", 0.1, 0.0, {}, np.zeros(1), h.fitted, "strange")
    share = {"a": a, "none": none, "outside": outside, "b": 1 - a - none - outside}
    return decide([h, replace(h, key="b"), other], share, rows, variables)


def test_named_is_what_is_sure_and_fits_and_nothing_rules_out() -> None:
    """p >= 0.7, a fit of p > 0.01, none below 0.05."""
    assert judged(0.7, 0.04).kind == "named" and judged(0.7, 0.04).key == "a"
    assert judged(0.69, 0.04).kind == "undecided" and judged(0.7, 0.05).kind == "undecided"
    assert judged(0.9, 0.04, p_value=0.011).kind == "named"
    assert judged(0.9, 0.04, p_value=0.009).kind == "outside"
    assert judged(0.69, 0.04, p_value=0.009).kind == "undecided"
    for parameters in (1, 2):  # freedom: rows less variables less parameters
        for rows in (7, 20):
            verdict = judged(0.9, 0.0, p_value=0.3, rows=rows, parameters=parameters)
            assert verdict.check == pytest.approx(0.3)


def test_outside_is_what_is_as_likely_as_all_else() -> None:
    """p >= 0.5, none below 0.05; its words are the likeliest reason's."""
    assert judged(0.2, 0.04, 0.5).kind == "outside" and "strange" in judged(0.2, 0.04, 0.5).words
    assert judged(0.2, 0.04, 0.49).kind == judged(0.2, 0.05, 0.5).kind == "undecided"


def test_no_gap_is_seen_where_none_is_likeliest_and_likelier_than_before() -> None:
    assert judged(0.2, 0.26).kind == "undecided"  # b is likelier
    assert judged(0.2, 0.6).kind == "no_gap"
    many = {f"e{i}": 0.75 / 9 for i in range(9)} | {"none": 0.25, "outside": 0.0}
    h = replace(explained(0.5, 20, 3), key="e0")
    assert decide([h], many, 20, 3).kind == "undecided"
    assert decide([h], {**many, "none": 0.251}, 20, 3).kind == "no_gap"


def test_words_say_whether_there_is_a_gap() -> None:
    assert judged(0.5, 0.049).words.startswith("there is a gap")
    assert judged(0.5, 0.05).words.startswith("there may be a gap")


def test_an_undecided_verdict_states_its_reason() -> None:
    """Next to a sure effect that is what keeps it from being named: the probability of no effect,
    whether it fits or not, its size, or few data; else that no effect is sure."""
    sure = judged(0.99, 0.0, rows=4), judged(0.9, 0.08), judged(0.9, 0.08, p_value=0.001)
    at_bound = replace(explained(0.5, 20, 3), ends={"a0": (-3.0, -1.0)})
    ends = Fitted(*(each[[0, 2, 1]] for each in at_bound.fitted))  # rising up to its end
    values = {"a0": np.array([-1.0, -2.0, -3.0])}
    at_bound = replace(at_bound, key="a0", fitted=ends, values=values)
    share = {"a0": 0.99, "none": 0.0, "outside": 0.01}
    bounded = decide([at_bound, replace(at_bound, key="outside", values={})], share, 20, 3)
    others = judged(0.5, 0.04), judged(0.5, 0.1), judged(0.35, 0.25, 0.4)
    none = {"none": 0.2} | {f"e{i}": 0.1 for i in range(7)} | {"outside": 0.1}
    h = replace(explained(0.5, 20, 3), key="e0")
    every = [*sure, bounded, *others, decide([h], none, 20, 3)]
    assert {each.kind for each in every} == {"undecided"}
    reasons = [each.words.partition("; " if "nearest" in each.words else ": ")[2] for each in every]
    assert all(len(reason) > 20 for reason in reasons) and len(set(reasons)) == 6
    assert all(each.best and each.best in each.words for each in (*sure, bounded))
    assert all("0.08" in each.words for each in sure[1:]) and "bound" in bounded.words
    assert all("0.7" in each.words for each in others) and "0.20" in every[-1].words


def test_candidates_hold_nine_tenths() -> None:
    assert judged(0.5, 0.4, 0.0).candidates == ("a", "none")
    assert judged(0.5, 0.39, 0.0).candidates == ("a", "none", "b")


def test_no_more_data_than_variables_tell_nothing() -> None:
    assert "no more data" in judged(0.9, 0.0, rows=3).words
    for parameters in (1, 2):  # one degree of freedom is left, or two
        one, two = (judged(0.9, 0.0, rows=n + parameters, parameters=parameters) for n in (4, 5))
        assert (one.kind, two.kind) == ("undecided", "named") and "so few data" in one.words
    empty = decide([], {"none": 0.9, "outside": 0.1}, 20, 3)
    assert empty.kind == "no_gap" and empty.check == 1.0


def test_no_gap_is_said_only_of_a_likely_absence() -> None:
    """Below 0.9 no effect is excluded, and the probability stands in the words."""
    assert no_gap_words(0.9) == "no gap is seen"
    assert no_gap_words(0.33) == "not seen, not excluded: no effect 0.33"
