"""Rules of the diagnosis at their limits, and small formulas by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.stats import chi2

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.diagnosis import _asked_again
from tyrecal.studies.diagnose.evidence import (
    INFLATION,
    UNKNOWN,
    Fitted,
    Hypothesis,
    explain,
    ln_splits,
    outside,
    refit,
)
from tyrecal.studies.diagnose.expansion import (
    Expansion,
    Nodes,
    _more,
    _nodes,
    expand,
    hermite,
    lagrange,
    node_values,
)
from tyrecal.studies.diagnose.gap import ResidualGroup, _chi2, _corrected, find_gap
from tyrecal.studies.diagnose.inverse_problem import Assumed, Toggle
from tyrecal.studies.diagnose.label_swap import _near
from tyrecal.studies.diagnose.model import Answer, Query, Span
from tyrecal.studies.diagnose.next_measurement import CHECKED, Look, rank
from tyrecal.studies.diagnose.observations import Observable, Observations
from tyrecal.studies.diagnose.plain_fit import plain_fit
from tyrecal.studies.diagnose.regions import SectionPart
from tyrecal.studies.diagnose.separability import separate
from tyrecal.studies.diagnose.several import priors, weigh
from tyrecal.studies.diagnose.study import _reaching
from tyrecal.studies.diagnose.verdict import decide
from tyrecal.studies.diagnose.where import section_map
from tyrecal.tyre.effects import catalogue

from ..chance import generator
from ..conftest import CASES
from .toy import LABELS, Toy, drawn, problem

pytestmark = pytest.mark.numbers

Array = np.ndarray


def explained(p_value: float, rows: int, variables: int, parameters: int = 1) -> Hypothesis:
    """The effect "a" whose best fit has that p-value with so many degrees of freedom; a fit beside
    the best one is far worse."""
    value = float(chi2.isf(p_value, max(1, rows - variables - parameters)))
    ln, none = np.array([-3.0, -1.0, -2.0]), np.zeros((3, 1))
    fitted = Fitted(ln, none, np.array([1e4, value, 1e4]), none[:, :, None], none[:, :0])
    return Hypothesis("a", 0.5, -1.0, {f"a{i}": ln for i in range(parameters)}, ln, fitted)


def judged(a: float, none: float, outside: float = 0.0, p_value: float = 0.5, **of: int) -> Any:
    """What is decided where the effects a and b, none and outside have these probabilities."""
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
    toy.spans["e1"] = Span(-2.0, 1.0)
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
    found, rank_ = section_map(p, P, r, parts)
    at = {place.region: place for place in found}
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
    assert [place.evidence for place in found] == sorted((q.evidence for q in found), reverse=True)
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
        found, _ = section_map(p, 1e4 * np.eye(n), one, parts)
        assert [bool(place.same_as) for place in found] == [same, same]


def test_splits_are_folded_normal() -> None:
    """s = |N(apart, tau^2)|: both signs, tau with the usual split of 0.3 %; it integrates to 1."""
    toy = Toy(effects=1, pressures=(240.0,))
    p = problem(toy)
    n = len(p.places)

    def ln(s: float, apart: float) -> float:
        one = np.where(np.arange(n) == 4, s, np.nan)
        seen = replace(p.observations, split=one, split_scatter=np.full(n, 0.004))
        return float(ln_splits(replace(p, observations=seen), np.full((1, n), apart))[0])

    tau = 0.005
    for s, apart in ((0.0, 0.0), (0.01, 0.004), (0.003, 0.012)):
        density = sum(np.exp(-(((s - x) / tau) ** 2) / 2) for x in (apart, -apart))
        assert ln(s, apart) == pytest.approx(np.log(density / tau / np.sqrt(2 * np.pi)))
    grid = np.linspace(0, 0.06, 2001)
    total = np.trapezoid([np.exp(ln(s, 0.004)) for s in grid], grid)
    assert total == pytest.approx(1, abs=1e-3)


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
    found = outside(p)
    assert found.prior == 0.1
    assert found.ln_evidence == pytest.approx(np.logaddexp(*kinds) - np.log(2), abs=1e-6)
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
    found = explain(p, ["e0", "e1"], 1.0)
    assert found.ln_evidence == pytest.approx(wanted, abs=0.2)
    assert found.mean()["e0"] == pytest.approx(0.4321, abs=0.01)


def test_prior_probabilities_are_one_together() -> None:
    """A quarter for none, a tenth for what is outside; of the rest each further effect has a
    twentieth of what one less has, over all sets, tried or not."""
    toy = Toy(effects=6, pressures=(240.0,))
    base = problem(toy)
    found = {h.key: h for h in weigh(base.measured(drawn(toy, base, generator(1), {}, 0.3)))}
    assert found["none"].prior == 0.25 and found["outside"].prior == 0.1
    singles = [h for key, h in found.items() if key in toy.spans]
    pairs = [h for key, h in found.items() if "+" in key]
    assert sum(h.prior for h in singles) == pytest.approx(0.65 / 1.0525)
    pairs = [h for h in pairs if h.key.count("+") == 1]
    assert [h.prior for h in pairs] == pytest.approx([0.0325 / 1.0525 / 15] * 14)
    for further in (0.1, 0.5):
        prior = priors(25, further)
        shares = {k: each * comb(25, k) for k, each in prior.items()}
        assert sum(shares.values()) == pytest.approx(0.65)
        assert [shares[k] / shares[k - 1] for k in (2, 3)] == pytest.approx([further] * 2)
    best = sorted(singles, key=lambda h: -h.ln_evidence)[:4]
    left = {h.key for h in singles} - {h.key for h in best}  # of these two no pair is tried
    assert "+".join(sorted(left)) not in found
    alone = {h.key: h.prior for h in weigh(base, pairs=False)}
    assert sum(alone.values()) == pytest.approx(1)
    one = replace(base.expansion, nodes={"e3": base.expansion.nodes["e3"]})
    known = weigh(replace(base, expansion=one))
    assert {h.key: h.prior for h in known}["e3"] == pytest.approx(0.65)


def test_where_an_effect_is_asked() -> None:
    """At Lobatto's points of a cubic to the farther end, or at two places on either side."""
    assert node_values(Span(0.0, 2.0)) == pytest.approx([0.5, 1.5, 2.0])
    assert node_values(Span(-2.0, 0.0)) == pytest.approx([-2.0, -1.5, -0.5])
    assert node_values(Span(-3.0, -1.0)) == pytest.approx([-3.0, -2.25, -0.75])
    assert node_values(Span(-2.0, 4.0)) == pytest.approx([-2.0, -1.0, 2.0, 4.0])
    assert node_values(Span(0.0, 2.0, also=(3.0,))) == pytest.approx([0.5, 1.5, 2.0, 3.0])


def test_an_effect_reaches_as_far_as_there_are_solutions() -> None:
    """Nodes from 0 outwards to the first that fails; those beyond the range do not widen it."""
    n, none = 4, np.zeros((4, 2))
    answer = lambda e: Answer(np.full(n, e), np.full((n, 2), 3 * e), np.full(n, abs(e)))
    plain = Expansion(np.zeros(2), np.zeros(n), none, np.zeros((n, 2, 2)), np.zeros(n), none, {})
    failed = ValueError("no such tyre")
    span = Span(-1.0, 1.0)
    asked = {-1.0: answer(-1), -0.5: failed, 0.5: answer(0.5), 1.0: answer(1), 1.5: answer(1.5)}
    made = _nodes("e0", plain, span, asked)
    assert made and made.values.tolist() == [0.0, 0.5, 1.0, 1.5] and made.reach == (0.0, 1.0)
    shift, tilt, split = made.at(np.array([0.25, 1.25]))
    assert shift[:, 0] == pytest.approx([0.25, 1.25])
    assert tilt[:, 0, 0] == pytest.approx([0.75, 3.75])
    assert split[:, 0] == pytest.approx([0.25, 1.25])
    assert _nodes("e0", plain, span, dict.fromkeys(asked, failed)) is None
    assert isinstance(made, Nodes)


def test_hermites_polynomials_take_values_and_slopes() -> None:
    """Those of a polynomial of as many coefficients: that polynomial. Without slopes Lagrange's."""
    nodes, sloped = np.array([-2.0, 0.0, 0.5, 3.0]), np.array([True, False, True, True])
    made = Polynomial([0.3, -1.0, 0.5, 0.2, -0.4, 0.1, 0.02])
    e = np.array([-1.5, 0.0, 0.2, 0.5, 2.0])
    values, slopes = hermite(nodes, sloped, e)
    assert values @ made(nodes) + slopes @ made.deriv()(nodes) == pytest.approx(made(e))
    assert values[1] == pytest.approx([0, 1, 0, 0]) and abs(slopes[[1, 3]]).max() == 0
    assert (slopes[:, 1] == 0).all()  # none is given there
    cubic = Polynomial([0.3, -1.0, 0.5, 0.2])
    assert lagrange(nodes, e) @ cubic(nodes) == pytest.approx(cubic(e))
    values, slopes = hermite(nodes, np.zeros(4, bool), e)
    assert values == pytest.approx(lagrange(nodes, e)) and (slopes == 0).all()


class Sloped(Toy):
    """eta + 2e-4 e^power, with slopes by the effect, or the one where it is 0."""

    def __init__(self, power: int, at_0: bool = False, span: Span | None = None):
        super().__init__(effects=1, size=0.0, pressures=(240.0,))
        self.curve, self.at_0 = 2e-4 * Polynomial([0.0] * power + [1.0]), at_0
        self.spans = {"e0": span or Span(0.0, 1.0)}
        self.sloped, self.sloped_at_0 = ((), ("e0",)) if at_0 else (("e0",), ())
        self.points: list[Query] = []

    def answers(self, points: Sequence[Query]) -> list[Answer | Exception]:
        self.points += points
        return super().answers(points)

    def _answer(self, point: Query) -> Answer:
        found, e = super()._answer(point), point.effects.get("e0", 0.0)
        assert not point.slopes or (e == 0) == self.at_0
        slope = np.full(len(found.eta), self.curve.deriv()(e))
        slope[-1] = np.nan  # the last row has none
        eta = found.eta + self.curve(e)
        return replace(found, eta=eta, slopes=dict.fromkeys(point.slopes, slope))


@pytest.mark.parametrize(
    ("at_0", "span", "power", "wanted"),
    [
        (False, Span(0.0, 1.0), 4, [0, 0.25, 1]),
        (False, Span(-2.0, 0.0), 4, [-2, -0.5, 0]),
        (False, Span(-0.5, 1.0), 4, [-0.5, 0, 1]),
        (True, Span(0.0, 1.0), 3, [0, 0.25, 1]),
    ],
)
def test_two_sizes_and_their_slopes_make_a_quartic(
    at_0: bool, span: Span, power: int, wanted: list[float]
) -> None:
    """The slope where the effect is 0 and two sizes a cubic; no slope is asked in vain."""
    toy = Sloped(power, at_0, span)
    nodes = expand(toy, np.zeros(3)).nodes["e0"]
    assert nodes.values.tolist() == pytest.approx(wanted)
    e = np.linspace(span.low, span.high, 7)
    assert nodes.at(e)[0][:, 0] == pytest.approx(toy.curve(e), abs=1e-12)
    asked = [q for q in toy.points if q.slopes]
    assert [q.constants for q in asked] == ([True] if at_0 else [False, False])
    by_values = lagrange(nodes.values, e) @ toy.curve(nodes.values)
    assert nodes.at(e)[0][:, -1] == pytest.approx(by_values, abs=1e-12)


def test_where_splits_do_not_matter_one_size_and_the_slope_at_0_make_a_quadratic() -> None:
    toy = Sloped(2, at_0=True)
    nodes = expand(toy, np.zeros(3), splits=False).nodes["e0"]
    assert nodes.values.tolist() == [0, 1] and nodes.sloped.tolist() == [True, False]
    e = np.linspace(0, 1, 7)
    assert nodes.at(e)[0][:, 0] == pytest.approx(toy.curve(e), abs=1e-12)
    both = Sloped(2, at_0=True, span=Span(-1.0, 1.0))
    assert expand(both, np.zeros(3), splits=False).nodes["e0"].values.tolist() == [-1, 0, 1]
    own = Sloped(2)
    assert expand(own, np.zeros(3), splits=False).nodes["e0"].values.tolist() == [0, 0.25, 1]


def test_a_nearer_size_is_asked_where_the_far_end_has_no_solution() -> None:
    class Stops(Sloped):
        far = 0.5

        def _answer(self, point: Query) -> Answer:
            if point.effects.get("e0", 0.0) > self.far:
                return ValueError("no such tyre")  # type: ignore[return-value]
            return super()._answer(point)

    toy = Stops(2, at_0=True)
    nodes = expand(toy, np.zeros(3), splits=False).nodes["e0"]
    assert nodes.values.tolist() == [0, 0.25] and nodes.reach == (0.0, 0.25)
    toy.far = 0.1
    found = expand(toy, np.zeros(3), splits=False)
    assert not found.nodes and found.failed == {"e0": "no such tyre"}


def test_an_effect_is_not_asked_again_where_it_was_asked() -> None:
    """Near a node, or 0, and near x0: what was asked there is known; elsewhere it is asked."""
    for size, move, wanted in (
        (1.0, 0.0, False),
        (0.74, 0.02, False),
        (0.02, 0.2, False),
        (1.0, 0.2, True),
        (0.5, 0.0, True),
        (0.64, 0.0, True),
    ):
        toy = Toy(effects=1, size=0.3, pressures=(160.0, 240.0), bend=0.0)
        toy.tilt["e0"] *= 0
        base = problem(toy, assumed=Assumed(form=1e-6, law=0.0), noise=1e-5)
        p = base.measured(toy.base + toy.J @ np.array([move, 0.0, 0.0]) + size * toy.g["e0"])
        hypotheses = weigh(p)
        best = next(h for h in hypotheses if h.key == "e0")
        assert best.values["e0"][best.best] == pytest.approx(size, abs=0.02)
        assert best.fitted.d[best.best][0] == pytest.approx(move, abs=0.03)
        before = toy.asked
        again, changed = _asked_again(p, toy, hypotheses)
        assert changed == wanted and toy.asked - before == wanted
        anchor = again.expansion.nodes["e0"].anchor
        assert (anchor is not None) == wanted
        if wanted:  # and not a second time
            assert not _asked_again(again, toy, weigh(again))[1]


def test_more_sizes_where_two_and_their_slopes_are_not_enough() -> None:
    """At 60 % of the range, where the far slope is worth 0.1 % and more half way to it, of the
    fifth order at 0, 1/4 and 1 (double): e (e - 1/4)^2 (e - 1) / (3/4)^2 at 5/8."""
    last = 0.625 * 0.375**3 / 0.75**2
    for slope, more in ((0.00099, []), (0.00101, [0.6])):
        toy = Sloped(4)
        own = Polynomial([0, 1]) * Polynomial([-0.25, 1]) ** 2 * Polynomial([-1, 1]) / 0.75**2
        toy.curve = slope / last * own
        values = expand(toy, np.zeros(3)).nodes["e0"].values
        assert values.tolist() == pytest.approx([0, 0.25, *more, 1])


def test_more_nodes_where_a_cubic_is_not_enough() -> None:
    """At 8 % and at half of the range, where Newton's last term is 0.3 % and more."""
    last = 0.875 * 0.625 * 0.125  # the bend's own part half way between the last two nodes
    for size, more in ((0.0, False), (0.0029 / last, False), (0.0031 / last, True)):
        toy = Toy(effects=1, size=1e-3, pressures=(240.0,))
        plain = toy._answer

        def bent(point: Query, size: float = size, plain: Any = plain) -> Answer:
            found = plain(point)
            e = point.effects.get("e0", 0.0)
            return replace(found, eta=found.eta + size * e * (e - 0.25) * (e - 0.75))

        toy._answer = bent  # type: ignore[method-assign]
        nodes = expand(toy, np.zeros(3)).nodes["e0"].values
        wanted = [0, 0.08, 0.25, 0.5, 0.75, 1] if more else [0, 0.25, 0.75, 1]
        assert nodes.tolist() == pytest.approx(wanted)


def test_where_a_far_node_has_no_solution_the_rest_may_bend_too() -> None:
    """Three nodes do, two cannot tell: asked more towards the farthest that has an answer."""
    n, none = 2, np.zeros((2, 1))
    answer = lambda e: Answer(np.full(n, e * e), none, np.zeros(n))
    plain = Expansion(np.zeros(1), np.zeros(n), none, np.zeros((n, 1, 1)), np.zeros(n), none, {})
    failed, span = ValueError("no such tyre"), Span(0.0, 1.0)
    found = {0.25: answer(0.25), 0.75: answer(0.75), 1.0: failed}
    more = lambda span, found: _more(_nodes("e0", plain, span, found))
    assert more(span, found) == pytest.approx([0.75 * 0.08, 0.75 * 0.5])
    assert more(span, {**found, 0.75: failed}) == []
    back = {-e: each for e, each in found.items()}
    assert more(Span(-1.0, 0.0), back) == pytest.approx([-0.75 * 0.08, -0.75 * 0.5])


def test_curvature_is_that_of_two_slopes() -> None:
    toy = Toy(effects=0, bend=0.1)
    found = expand(toy, np.array([0.2, -0.1, 0.3]))
    assert found.hessian == pytest.approx(2 * toy.bend[:, None, None] * np.eye(3), abs=1e-9)


def test_the_plain_fit_ends_near_the_minimum_and_takes_no_leaps() -> None:
    """Of a model that bends, from afar; no step beyond 0.7 in any x."""
    toy = Toy(effects=0, bend=0.02)
    p = problem(toy)
    (there,) = toy.answers([Query(np.array([1.5, -1.2, 0.8]))])
    assert isinstance(there, Answer)
    asked: list[Array] = []
    answers = toy.answers
    toy.answers = lambda points: [asked.append(q.x) for q in points] and answers(points)  # type: ignore[func-returns-value, method-assign, assignment]
    x = plain_fit(toy, p.measured(there.eta).observations, p.places, 0.001)
    steps = np.abs(np.diff(asked, axis=0)).max(1)
    assert steps[0] == pytest.approx(0.7) and steps.max() < 0.7 + 1e-9 and len(asked) <= 10
    value = lambda x: float(np.sum((toy._answer(Query(x)).eta - there.eta) ** 2))
    assert np.array_equal(x, asked[-1])  # where the covariance was looked at again
    assert abs(x - [1.5, -1.2, 0.8]).max() < 0.05 and value(x) < value(asked[-2]) / 2


def test_the_plain_fit_steps_back_from_what_has_no_solution() -> None:
    toy = Toy(effects=0, bend=0.0)
    p = problem(toy)
    (there,) = toy.answers([Query(np.array([0.6, 0.0, 0.0]))])
    assert isinstance(there, Answer)
    answer = toy._answer

    def walled(point: Query) -> Answer:
        return ValueError("wall") if point.x[0] > 0.1 else answer(point)  # type: ignore[return-value]

    toy._answer = walled  # type: ignore[method-assign]
    x = plain_fit(toy, p.measured(there.eta).observations, p.places, 0.001)
    assert 0.05 < x[0] <= 0.1


def test_the_menu_of_measurements() -> None:
    """What is offered, at which price: pressures far from those measured, the next harmonics, the
    mass where it is not known; a likely effect switched off, sources by themselves."""
    toy = Toy(effects=3, pressures=(200.0, 250.0))
    p = problem(toy)
    sizes = {id: {id: np.array([0.4, 0.6])} for id in toy.spans}
    likely = {"none": 0.4, "e0": 0.3, "e1": 0.294, "e2": 0.006, "outside": 0.0}
    toy.spans["e0"] = Span(0, 1, toggle="take e0 out")
    p = replace(p, spans=toy.spans)
    rows: list = []

    def further(wanted: list) -> Any:
        rows.extend(wanted)
        count, random = len(wanted), generator("further")
        zero, J = np.zeros(count), random.normal(size=(count, 3))
        answer = Answer(zero, J, zero, np.zeros((count, 2)))
        by = lambda point: 0.1 * len(point.effects) * random.normal(size=count)
        moved = lambda point: replace(answer, eta=by(point))
        answers = lambda points: [answer, *map(moved, points[1:])]
        return SimpleNamespace(answers=answers, sloped_at_0=())

    found = rank(p, np.zeros(3), likely, sizes, ("rubber_density", "section gauge 1"), further)
    assert {c.what: c.hours for c in found} == {
        "measure by itself: rubber density": 1.0,
        "cut the tyre and measure its section": 8.0,
        "dismount the tyre, mount it again and measure all once more": 3.0,
        "take e0 out": 4.0,
        "measure again without e1": 4.0,
        "measure again without e2": 4.0,
        "measure the same modes at 320 kPa": 1.0,
        "measure [5,0] and [5,1], too": 1.0,
        "weigh the tyre": 0.1,
    }
    assert [c.gain for c in found] == sorted((c.gain for c in found), reverse=True)
    assert all(c.gain > -1e-9 for c in found)
    few = rank(p, np.zeros(3), {**likely, "e1": 0.295, "e2": 0.005}, sizes, ())
    assert not any("e2" in c.what for c in few)
    assert rank(p, np.zeros(3), {"e0": 0.995, "none": 0.005}, sizes, ()) == []
    assert rank(p, np.zeros(3), {"e0": 0.5, "strange": 0.5}, sizes, ()) == []


def test_what_further_rows_gain_from_an_effect_whose_slope_at_0_is_known() -> None:
    """It is not asked: its slope there, bent as in the rows that it was asked for; those of the
    others as they are asked."""
    toy = Sloped(2, at_0=True, span=Span(0.0, 1.0))
    toy.curve = 2e-3 * Polynomial([0.0, 1.0, -0.3])
    toy.spans["e1"], toy.g["e1"] = Span(0.0, 1.0), np.full(len(toy.rows), 0.001)
    toy.tilt["e1"], toy.splits["e1"] = np.zeros((len(toy.rows), 3)), np.zeros(len(toy.rows))
    p = problem(toy)
    likely = {"none": 0.4, "e0": 0.3, "e0+e1": 0.3}
    sizes = {"e0": {"e0": np.array([0.5])}, "e0+e1": {"e0": np.array([1.0]), "e1": np.array([0.5])}}
    asked: list[Query] = []

    def ranked(model: Any) -> float:
        found = rank(p, np.zeros(3), likely, sizes, (), lambda rows: model(len(rows)))
        return next(c.gain for c in found if "[5,0]" in c.what)

    def answered(count: int, straight: bool) -> Any:
        zero, J = np.zeros(count), np.tile([0.1, 0.2, 0.3], (count, 1))

        def answer(point: Query) -> Answer:
            asked.append(point)
            e0, e1 = (point.effects.get(id, 0.0) for id in ("e0", "e1"))
            eta = zero + 3 * toy.curve(e0) + 0.004 * e1
            slopes = dict.fromkeys(point.slopes, zero + 3 * toy.curve.deriv()(0.0))
            return Answer(eta, J, zero, np.zeros((count, 2)) if point.constants else None, slopes)

        known = ("e0",) if straight else ()
        return SimpleNamespace(answers=lambda q: [*map(answer, q)], sloped_at_0=known)

    whole = ranked(lambda count: answered(count, False))
    assert any(q.effects.get("e0") for q in asked)
    asked.clear()
    assert ranked(lambda count: answered(count, True)) == pytest.approx(whole, rel=1e-9)
    assert [dict(q.effects) for q in asked] == [{}, {}, {}, {"e1": 0.5}]
    assert asked[0].slopes == ("e0",) and asked[0].constants


def informed(p: Sequence[float], squared: Array) -> float:
    """The bound of information on explanations of one size each, squares of distances apart."""
    share = np.array(p) / sum(p)
    return float(-share @ np.log(np.exp(-squared / 8) @ share))


def test_the_gains_of_what_is_switched_and_checked_by_their_formula() -> None:
    """A run more without e0, and a source of error at a quarter of its deviation: further data tell
    what all of them tell less what the first did."""
    toy = Toy(effects=2, size=0.003, bend=0.0, pressures=(240.0,))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    p = problem(toy)
    sizes, likely = {id: {id: np.ones(1)} for id in ("e0", "e1")}, {"e0": 0.5, "e1": 0.3}
    found = {c.what: c for c in rank(p, np.zeros(3), likely, sizes, toy.sources)}

    def apart(S: Array, J: Array, off: Array) -> float:
        whole = S + J @ np.diag(toy.spread**2) @ J.T
        return float(off @ np.linalg.inv(whole) @ off)

    def bound(squared: float) -> float:
        return informed((0.5, 0.3), squared * (1 - np.eye(2)))

    off = toy.g["e0"] - toy.g["e1"]
    now = apart(p.sigma, toy.J, off)
    left = CHECKED**2 / (1 + CHECKED**2)  # of its variance
    S = p.sigma - (1 - left) * np.outer(toy.constants[:, 1], toy.constants[:, 1])
    checked = found["measure by itself: gauge"]
    assert checked.gain == pytest.approx(bound(apart(S, toy.J, off) - now), rel=1e-6)
    both = problem(toy, changes=(Toggle("e0", 0.0),))
    twice = np.vstack([toy.J, toy.J])
    for words, moved, hours in (
        ("measure again without e0", -toy.g["e1"], 4.0),
        ("dismount the tyre, mount it again and measure all once more", off, 3.0),
    ):
        squared = apart(both.sigma, twice, np.concatenate([off, moved])) - now
        assert found[words].gain == pytest.approx(bound(squared) / hours, rel=1e-6)


def test_information_is_none_of_what_is_known_and_at_most_what_is_open() -> None:
    """Beside the whole integral of two explanations, a normal distribution each, it is a lower
    bound; it grows with what is measured; and a reading that shows no effect tells nothing."""
    open_ = -0.6 * np.log(0.6) - 0.4 * np.log(0.4)
    y, before = np.linspace(-9, 29, 20001), 0.0
    for off in (1e-6, 0.5, 1.0, 2.0, 4.0, 8.0, 20.0):
        shifts = {"a": np.zeros((1, 2)), "b": np.array([[0.0, off]])}
        one = Look(np.eye(2), np.zeros((2, 1)), shifts)
        found = one.information(1, {"a": 0.6, "b": 0.4}, np.ones(1))
        normal = lambda m: np.exp(-((y - m) ** 2) / 2) / np.sqrt(2 * np.pi)
        both = 0.6 * normal(0) + 0.4 * normal(off)
        left = lambda p, both=both: -p * np.log(np.maximum(p / both, 1e-300))
        rest = np.trapezoid(left(0.6 * normal(0)) + left(0.4 * normal(off)), y)
        assert before <= found <= open_ - rest + 1e-9
        before = found
    assert found == pytest.approx(open_, rel=1e-9)
    known = Look(
        np.array([[1.0, 1.0], [1.0, 1.0 + 1e-9]]),
        np.zeros((2, 1)),
        shifts | {"b": np.array([[20.0, 20.0]])},
    )
    assert abs(known.information(1, {"a": 0.6, "b": 0.4}, np.ones(1))) < 1e-9
    wide = {"a": np.zeros((7, 2)), "b": np.linspace([0, 0], [0, 9.0], 7)}
    spread = Look(np.eye(2), np.zeros((2, 1)), wide | {"a": wide["b"]})
    assert abs(spread.information(1, {"a": 0.6, "b": 0.4}, np.ones(1))) < 1e-9  # alike in both


def test_tools_of_a_laboratory_are_offered_for_what_they_show() -> None:
    """The rim's width at an effect of the rim; a clamp without all that gives way; helium for air;
    and the one that shows the likelier explanation first."""
    toy = Toy(effects=5, pressures=(240.0,))
    names = dict(
        zip(
            toy.g,
            ("rim_width", "spindle_tilt", "wheel_free", "cavity_air", "belt_angle"),
            strict=True,
        )
    )
    for each in (toy.g, toy.tilt, toy.spans, toy.splits):
        for old, new in names.items():
            each[new] = each.pop(old)
    p = problem(toy)
    sizes = {id: {id: np.array([0.4, 0.5, 0.6])} for id in toy.spans}
    likely = {"none": 0.4, "rim_width": 0.2, "spindle_tilt": 0.15, "wheel_free": 0.15}
    found = rank(p, np.zeros(3), likely, sizes, ())
    assert {c.what: c.hours for c in found} == {
        "measure the rim between its flanges": 0.2,
        "clamp the rim rigidly in place of the spindle and measure again": 3.0,
        "dismount the tyre, mount it again and measure all once more": 3.0,
    }
    assert "rim" in found[0].what
    air = rank(p, np.zeros(3), {"none": 0.5, "cavity_air": 0.3, "belt_angle": 0.2}, sizes, ())
    assert {c.what: c.hours for c in air} == {
        "cut the tyre and measure its section": 8.0,
        "inflate with helium and measure again": 1.0,
        "dismount the tyre, mount it again and measure all once more": 3.0,
    }
    assert all(c.gain > 0 for c in (*found, *air))


def test_a_change_counts_from_what_the_case_has() -> None:
    """Set to a value, or times one."""
    e = {"a": np.array([0.0, 0.5]), "b": np.array([1.0, 2.0])}
    assert Toggle("a", 0.3, base=0.2).applied(e, 2)["a"] == pytest.approx([0.1, 0.1])
    assert Toggle("a", 3.0, True, 0.2).applied(e, 2)["a"] == pytest.approx([0.4, 1.9])
    assert Toggle("c", 3.0, True, 0.2).applied(e, 2)["c"] == pytest.approx([0.4, 0.4])
    assert Toggle("a", 0.3).applied(e, 2)["b"] is e["b"]


def test_labels_far_apart_are_not_taken_for_each_other() -> None:
    """Only what lies within 30 % of each other wherever both were measured."""
    rows = tuple(Observable("frequency_Hz", x, p) for x in LABELS[2:5] for p in (160.0, 240.0))
    y = np.array([0.0, 0.0, 0.29, -0.29, 0.1, 0.31])
    none = np.full(6, np.nan)
    pairs = set(_near(Observations(rows, y, none, 0.0, none, none)))
    assert pairs == {(LABELS[3], LABELS[2])}


def test_the_guide_says_what_is_assumed() -> None:
    """Of an effect's law, of splits, and that the form's error is the one on record."""
    guide = (CASES / "diagnosis.md").read_text()
    assumed = Assumed()
    laws = [100 * effect.law for effect in catalogue().values()]
    assert f"may be off by {min(laws):g} to {max(laws):g} % of its own shift" in guide
    _, _, integrated = guide.partition("What else there is to some is integrated over")
    integrated, _, _ = integrated.partition("\n\n")
    for effect in catalogue().values():
        assert (effect.beside is not None) == (f"`{effect.id}`" in integrated)
    assert assumed.law is None and assumed.form is None and assumed.split == 0.003


def test_cosines_and_distances_by_their_formula() -> None:
    """Of shifts at the sizes that effects are judged at, in the metric P."""
    toy = Toy(effects=3, size=0.02, bend=0.0, pressures=(240.0,))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    p = problem(toy)
    P = np.diag(generator("metric").uniform(1e5, 4e5, len(p.places)))
    sizes = {"e0": 0.5, "e1": 0.75}  # e2 has none: it is judged at full size
    found = separate(p, P, sizes)
    at = {**sizes, "e2": 1.0}
    g = np.array([at[id] * toy.g[id] for id in found.ids])
    gram = g @ P @ g.T
    assert found.sizes == pytest.approx(at)
    assert [found.lambdas[id] for id in found.ids] == pytest.approx(np.diag(gram))
    whole = [toy.g[id] @ P @ toy.g[id] for id in found.ids]
    assert [found.full[id] for id in found.ids] == pytest.approx(whole)
    root = np.sqrt(np.diag(gram))
    assert found.cosines == pytest.approx(gram / np.outer(root, root))
    grid = np.linspace(0, 1, 81)
    for i, a in enumerate(found.ids):
        for j, b in enumerate(found.ids):
            off = grid[:, None] * toy.g[b] - at[a] * toy.g[a]
            wanted = np.einsum("qn,nm,qm->q", off, P, off).min() if i != j else 0.0
            assert found.distances[i, j] == pytest.approx(wanted)


def test_the_gains_of_further_rows_by_their_formula() -> None:
    """Two more modes at the scatter of the others, or the mass to half a per cent, with form,
    constants and what an effect does there."""
    toy = Toy(effects=2, size=0.003, bend=0.0, pressures=(240.0,))
    toy.tilt = {id: 0 * tilt for id, tilt in toy.tilt.items()}
    p = problem(toy)
    p = replace(p, observations=replace(p.observations, scatter=np.linspace(1e-3, 3e-3, 9)))
    sizes = {id: {id: np.array([0.5])} for id in ("e0", "e1")}
    likely = {"e0": 0.4, "e1": 0.3, "none": 0.2}
    random = generator("rows")
    eta, J, c = random.normal(size=50), random.normal(size=(50, 3)), random.normal(size=(50, 2))
    moved = {"e0": random.normal(0, 0.002, 50), "e1": random.normal(0, 0.002, 50)}
    rows: list = []

    def answer(point: Query) -> Answer:
        n = slice(0, len(rows))
        shift = sum((e * moved[id][n] for id, e in point.effects.items()), np.zeros(len(rows)))
        own = 0.003 * c[n] if point.constants else None
        return Answer(eta[n] + shift, J[n], np.zeros(len(rows)), own)

    def further(wanted: list) -> Any:
        rows.extend(wanted)
        answers = lambda points: [answer(point) for point in points]
        return SimpleNamespace(answers=answers, sloped_at_0=())

    found = {c.what: c for c in rank(p, np.zeros(3), likely, sizes, (), further)}
    assert len(found) == 7  # repeats, two toggles, 160 and 320 kPa, harmonics, the mass
    assert found.keys() > {"measure the same modes at 160 kPa", "measure the same modes at 320 kPa"}

    def apart(at: list[int], form: float) -> Array:
        whole = np.vstack([toy.J, J[at]])
        constants = np.vstack([toy.constants, 0.003 * c[at]])
        noise = [*np.linspace(1e-3, 3e-3, 9), *(2e-3 if rows[i][0] else 0.005 for i in at)]
        sizes = np.array([0.001] * 9 + [form] * len(at))
        same = np.eye(len(whole))
        for k, i in enumerate(at):
            if rows[i][0] in LABELS:
                mode = LABELS.index(rows[i][0])
                same[9 + k, mode] = same[mode, 9 + k] = np.exp(
                    -(np.log(rows[i][1] / 240.0) ** 2) / (2 * 0.6**2)
                )
        S = np.diag(np.square(noise)) + same * np.outer(sizes, sizes) + constants @ constants.T
        S = S + 1e-12 * np.eye(len(S)) + whole @ np.diag(toy.spread**2) @ whole.T
        g = {id: 0.5 * np.append(toy.g[id], moved[id][at]) for id in moved}
        g["none"] = np.zeros(len(whole))
        off = lambda a, b: (g[a] - g[b]) @ np.linalg.inv(S) @ (g[a] - g[b])
        return np.array([[off(a, b) for b in likely] for a in likely])

    now = apart([], 0.001)
    for what, hours, at, form in (
        ("weigh the tyre", 0.1, [rows.index((None, 0.0))], 0.0),
        (
            "measure [5,0] and [5,1], too",
            1.0,
            [rows.index((Label(5, m), 240.0)) for m in (0, 1)],
            0.001,
        ),
        (
            "measure the same modes at 320 kPa",
            1.0,
            [rows.index((label, 320.0)) for label in sorted(LABELS, key=str)],
            0.001,
        ),
    ):
        gain = informed(list(likely.values()), apart(at, form) - now) / hours
        assert found[what].gain == pytest.approx(gain, rel=1e-6), what


def test_what_is_not_asked_twice_or_has_no_answer_is_not_offered() -> None:
    """Pressures nearer than 60 kPa to one measured; the mass where it is known; nothing where the
    model fails; ten explanations at most."""
    toy = Toy(effects=12, pressures=(220.0, 260.0))
    p = problem(toy)
    sizes = {id: {id: np.array([0.5])} for id in toy.spans}
    likely = {id: 0.07 + 0.001 * i for i, id in enumerate(sizes)}
    asked: list = []

    def further(wanted: list) -> Any:
        asked.append(wanted)
        return SimpleNamespace(answers=lambda q: [ValueError("no")] * len(q), sloped_at_0=())

    words = [c.what for c in rank(p, np.zeros(3), likely, sizes, (), further)]
    assert sorted(what for what in words if "without" in what) == [
        *(f"measure again without e{i}" for i in (10, 11, *range(2, 10)))
    ]
    assert len(words) == 11  # and mounted again
    (rows,) = asked
    assert {pressure for _, pressure in rows} == {160.0, 320.0, 220.0, 260.0, 0.0}
    o = p.observations
    weighed = replace(
        p, observations=replace(o, rows=(*o.rows[:-1], Observable("mass_kg", None, 0.0)))
    )
    rank(weighed, np.zeros(3), likely, sizes, (), further)
    assert (None, 0.0) not in asked[1]


def test_a_change_beyond_the_range_is_asked_where_it_was_measured() -> None:
    """Counted from what the case has; within the range, at 0, or as a factor nothing is added."""
    span = Span(-0.3, 0.7, base=0.3)  # of an effect from 0 to 1
    reached = lambda value, times=False: _reaching(span, Toggle("a", value, times, 0.3)).also
    assert reached(1.5) == (pytest.approx(1.2),) and reached(-0.2) == (pytest.approx(-0.5),)
    for value in (1.0, 0.0, 0.3, 0.65):
        assert reached(value) == ()
    assert reached(5.0, True) == ()
    twice = _reaching(_reaching(span, Toggle("a", 1.5, base=0.3)), Toggle("a", 1.5, base=0.3))
    assert len(twice.also) == 1
    zero = _reaching(Span(0.5, 1.0), Toggle("a", 0.0))  # 0 is a node anyway
    assert zero.also == ()
