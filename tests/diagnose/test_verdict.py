"""Verdicts and their words from probabilities, by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from tyrecal.studies.diagnose.evidence import Fitted, Hypothesis
from tyrecal.studies.diagnose.verdict import decide, no_gap_words

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
