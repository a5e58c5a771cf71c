"""How study 3 is scored, by trials made by hand.

Effects that a test could detect, judged before anything is measured, against lambda by its
formula.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import exp, log
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.protocol import Protocol
from tyrecal.studies.blind.ruler import Difficulty, Ruler, measure, ruler_of
from tyrecal.studies.diagnose.several import priors
from tyrecal.studies.fit.targets import USUAL_LABELS, labels_to_measure
from tyrecal.studies.inference.model import Answer, Query
from tyrecal.studies.inference.separability import VISIBLE
from tyrecal.tyre.case.schema import Targets

from .archive import unpack
from .study3.cases import Group, weighed_again
from .study3.draw import NAMED_AS_A_RULE, powers
from .study3.score import Scored, foretold
from .study3.tables import figures, misses, risen, table, table_of_unlike, unlike
from .toy import CASE, Scale, protocol


def answered(effects: str, top: str, lam: float = 30.0, **more: Any) -> Scored:
    """A trial by hand; "a" cannot be told from "like_a"."""
    ids = tuple(effects.split("+")) if effects else ()
    hard = {id: Difficulty(lam, lam, (id, f"like_{id}"), 1.0) for id in ids}
    kind = {0: "none", 1: "effect"}.get(len(ids), "several")
    named = None if top in ("none", "outside") else top
    verdict = {"none": "no_gap", "outside": "outside"}.get(top, "named")
    rest = (named, True, (top,), 0.9, frozenset(top.split("+")), True, (), 1.0, 0.5, "")
    return replace(Scored("", kind, ids, hard, verdict, *rest), **more)


def test_one_of_several_effects_is_named_for_its_group_and_for_one_truth_only() -> None:
    assert answered("a+b", "like_b+a").right and answered("a", "like_a").right
    assert answered("", "none").right and not answered("a+b", "a").right
    assert answered("a+b", "a").found(["a"]) == 1 and answered("a+b", "c").found(["c"]) == 0
    assert answered("a+b", "a+like_a").found(["a", "like_a"]) == 1
    assert not answered("a", "a+b").right


def test_what_is_named_comes_before_what_is_likeliest_with_more() -> None:
    """The verdict names b, which all explanations hold; without a name the likeliest says."""
    named = answered("a+b", "b", ranked=("c+b", "b"))
    assert named.first_right and not replace(named, named=None).first_right
    assert not answered("a+b", "c", ranked=("b",)).first_right


def test_a_rate_counts_its_own_trials_and_few_are_not_shown() -> None:
    pairs = [answered("a+b", "a+b")] * 45 + [answered("a+b", "c")] * 15
    weak = [answered("a+b", "none", lam=3.0)] * 100
    rates = figures(pairs + weak, 60)
    name = "two effects, each lambda from 15: all in the 90 % set"
    assert rates[name] == "45 of 60, 75 % (62 to 85)"
    assert rates["named: right, or in part of several"].startswith("45 of 60")
    assert figures(pairs[1:], 60)[name] == "not shown (59)"
    seen = "two, together from 25, too: one of them named first"
    hidden = [replace(each, together=12.0) for each in pairs]
    assert figures(pairs + hidden, 60)[seen] == figures(pairs, 60)[seen] == rates[seen]
    assert rates[seen].startswith("45 of 60")


def test_sizes_are_held_by_the_catalogues_law_and_springs_by_what_they_are() -> None:
    spring = answered("a", "a", held=(False,), compliances=(True,))
    rates = figures([spring] * 60 + [answered("b", "b", held=(True,))] * 20, 60)
    assert rates["90 % interval holds the size"].startswith("20 of 80")
    assert rates["90 % interval holds a spring's own compliance"].startswith("60 of 60")


def test_shrinkage_is_of_what_was_named_and_strong_and_exchanged_labels_count_for_nothing() -> None:
    """0.8 by least squares, 0.9 at most, 0.5 by the diagnosis' own fit; sound tyres by chance to
    0.25."""
    named = [answered("a", "a", usual=(1.0, 0.2), least=0.1)] * 60
    weak, undecided = answered("a", "a", lam=9.0), answered("a", "a", verdict="undecided")
    sound = [answered("", "none", usual=(1.0, 0.75), after=0.9)] * 5
    rates = figures([*named, answered("a", "a"), weak, undecided, *sound], 60)
    start, end = "held out by ", ", named, lambda from 25: median shrinkage"
    assert rates[f"{start}least squares{end}"] == "0.80 (chance 0.25)"
    assert rates[f"{start}the diagnosis{end}"] == "0.50 (chance 0.10)"
    known = "least squares that know the effect and its best size"
    assert rates[f"{start}{known}{end}"] == "0.90"
    few = figures([*named[1:], answered("a", "a"), *sound], 60)
    assert few[f"{start}least squares{end}"] == "not shown (59)"


def test_what_is_named_likeliest_may_be_there_with_others() -> None:
    """Right in part by all that it names, sure by all explanations that have it."""
    part = answered("a+b", "a", stated=0.5, there=0.9)
    assert part.in_part and not part.right
    assert not answered("a", "a+b").in_part and not answered("a", "none").in_part
    assert answered("", "none").in_part and not answered("", "a").in_part
    rates = figures([part] * 60, 60)
    assert rates["calibration error (95 % quantile)"].startswith("0.500 ")
    name = "the same of what is named likeliest, whatever else is there"
    assert rates[name].startswith("0.100 ")


def test_what_is_named_besides_and_is_not_there_counts() -> None:
    trials = [answered("a", "a+b")] * 20 + [answered("a+b", "a")] * 20 + [answered("a", "c")] * 20
    rates = figures(trials, 60)
    assert rates["named: right, or in part of several"].startswith("40 of 60")
    assert rates["named: all of it is there"].startswith("20 of 60")


def test_outside_counts_by_what_it_moved() -> None:
    seen = replace(
        answered("", "outside"),
        kind="outside",
        hard={"outside": Difficulty(30.0, 30.0, ("outside",), None)},
    )
    weak = replace(seen, hard={"outside": Difficulty(3.0, 3.0, ("outside",), None)})
    rates = figures([seen] * 60 + [replace(weak, verdict="no_gap")] * 60, 60)
    assert rates["outside: said so, or undecided"].startswith("60 of 120")
    assert rates["outside, lambda from 25: said so, or undecided"].startswith("60 of 60")
    alias = replace(seen, hard={"outside": Difficulty(30.0, 8.0, ("outside", "a"), None)})
    rates = figures([seen] * 60 + [replace(alias, verdict="named")] * 20, 60)
    assert rates["outside, lambda from 25: named"].startswith("20 of 80")
    assert rates["outside, lambda from 25, like no effect: named"].startswith("0 of 60")


def test_misses_are_what_was_named_wrongly_and_what_should_have_been_found() -> None:
    right = [answered("a", "a"), answered("a+b", "a+b"), answered("", "none")]
    weak = answered("a", "none", lam=9.0)
    wrong = [answered("a", "c"), answered("a+b", "a"), answered("a", "none"), answered("", "a")]
    words = misses({Group("205/60R15", True): [*right, weak, *wrong]}).splitlines()[2:]
    assert [line.split(" | ")[2] for line in words] == ["a", "a+b", "a", "none"]
    assert [line.split(" | ")[5] for line in words] == ["c", "a", "", "a"]


def test_what_was_foretold_is_the_tyre_s_own_frequency() -> None:
    """At the pressure held out, the mean of a pair, without noise; old answers foretell nothing."""
    at = lambda p, f: {"pressure_kPa": p, "ln_f": {"[1,0]": np.log(f), "[2,0]": np.log(f) + 1}}
    truth = {"swapped": False, "with_effect": [at(160.0, [9.0, 9.0]), at(200.0, [9.9, 10.1])]}
    expected = {"[1,0]": [9.5, 9.0, 10.1], "[2,0]": [10.0, 9.9, 10.1]}
    assert foretold(truth, {"expected_Hz": expected}, 200.0) == (True, False)
    assert foretold(truth, {}, 200.0) == foretold({"swapped": True}, {}, 200.0) == ()
    figures_of = lambda flags: figures([answered("a", "a", foretold=flags)] * 60, 60)
    name = "90 % intervals hold frequencies held out"
    assert figures_of((True, False))[name] == "50 % of 60 trials' (50 to 50)"
    assert figures_of(())[name] == "not shown (0)"


def test_answers_are_weighed_again_as_if_they_had_been_told_of_further_effects() -> None:
    """By Bayes' rule about the priors that the diagnosis has of so many effects."""
    ids, likelihood = ["a", "b", "c"], {"none": 1.0, "outside": 2.0, "a": 5.0, "a+b": 40.0}
    likelihood |= {"a+b+c": 90.0}

    def posterior(f: float) -> dict[str, float]:
        prior = {key: priors(len(ids), f)[key.count("+") + 1] for key in likelihood}
        prior |= {"none": 0.25, "outside": 0.10}
        whole = sum(likelihood[key] * prior[key] for key in prior)
        return {key: likelihood[key] * prior[key] / whole for key in prior}

    assert weighed_again(posterior(0.05), 0.05, 0.6) == pytest.approx(posterior(0.6))
    again = replace(answered("a+b", "a", stated=1.0), if_told=answered("a+b", "a+b", stated=1.0))
    rates = figures([again] * 60, 60)
    assert rates["calibration error (95 % quantile)"].startswith("1.000 ")
    assert rates["the same, told how many effects tyres have"].startswith("0.000 ")
    assert rates["90 % set holds the truth, told so"].startswith("60 of 60")


def test_few_trials_are_shown_where_that_is_asked_for() -> None:
    """Robust verdicts and sizes too; a scatter needs two."""
    trials = [answered("a", "a", foretold=(True,))]
    few, all = (table({Group("205/60R15", True): trials}, least) for least in (None, 1))
    row = "named and called robust: likewise"
    assert f"| {row} | not shown (1)" in few
    assert f"| {row} | 1 of 1, 100 % (3 to 100)" in all
    assert all.count("| 90 % intervals hold frequencies held out | not shown (1)") == 2


def test_a_rise_is_the_tyre_s_own_beyond_the_model_s_at_its_numbers() -> None:
    """ln f = x + 2 g + ln p / 2 in the model; the tyre's first member 1 % higher at 320 kPa."""
    label, rows = Label(1, 0), [(None, 0.0), (Label(1, 0), 160.0), (Label(1, 0), 320.0)]
    eta = np.array([0.0, *np.log([160.0, 320.0]) / 2])
    J, g = np.array([[0.0], [1.0], [1.0]]), np.array([[0.0, 9.0], [2.0, 9.0], [2.0, 9.0]])
    ruler = Ruler(tuple(rows), np.zeros(1), np.ones(1), eta, J, np.zeros((3, 1, 1)), g, {})
    values = {p: 0.3 + 2 * 0.5 + log(p) / 2 for p in (160.0, 320.0)}
    table = [
        {"pressure_kPa": 320.0, "ln_f": {str(label): [values[320.0] + 0.01, values[320.0] + 0.01]}},
        {"pressure_kPa": 160.0, "ln_f": {str(label): [values[160.0]] * 2}},
    ]
    truth = {"variables": {"A": exp(0.3)}, "constants": {"density": 0.5}, "without": table}
    assert risen(ruler, ["density"], truth) == {label: pytest.approx(0.01)}


def test_makers_and_catalogue_mean_the_same_by_a_spring(tmp_path: Path) -> None:
    """Calibration and constants leave nothing of one spring's shift that the other spring does not
    leave; the table gives the number of springs."""
    group = Group("205/60R15", True, 15)
    unpack(group.name, tmp_path / "trials", tmp_path / "truth")
    by_effect = unlike(tmp_path / "trials", tmp_path / "truth")
    springs = [
        each for id, several in by_effect.items() if id.startswith("spindle") for each in several
    ]
    left, ratio = np.array(springs).T
    assert len(springs) > 5 and left.max() < 0.05 and abs(np.log(ratio)).max() < 0.4
    count = len(by_effect["bead_filler"])
    table = table_of_unlike([(group, by_effect), (Group("205/60R15", False, 15), {})])
    assert f"({count}) |" in table and table.splitlines()[0] == "| effect | 205/60R15 own |"


SCALE = Scale()

RULER = ruler_of(measure(SCALE, SCALE.model_rows))
RULES = protocol()
FOUND = {power.id: power for power in powers(RULER, RULES)}


def test_all_designs_are_asked_for_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the progress has one total, and workers always something to do."""
    scale, counts = Scale(), list[int]()
    answers = scale.answers

    def counted(points: Sequence[Query]) -> list[Answer | Exception]:
        counts.append(len(points))
        return answers(points)

    monkeypatch.setattr(scale, "answers", counted)
    measure(scale, scale.model_rows)
    assert len(counts) == 1 and counts[0] > 3 * len(scale.ranges)


def lam(id: str, e: float) -> float:
    """lambda by shift, covariance and projection, of rows that are given."""
    rows = [i for i, (x, p) in enumerate(SCALE.model_rows) if not x or p in RULES.given_kPa]
    at = np.array(rows)
    labels = [SCALE.model_rows[i][0] for i in rows]
    counts = np.array([2 if label and label.c else 1 for label in labels])
    P = RULER.projection(np.zeros(3), at, RULER.sigma(at, counts, RULES))
    shift = np.append(0.0, e * SCALE.g[id])[at]
    return float(shift @ P @ shift)


@pytest.mark.parametrize("id", sorted(SCALE.g))
def test_sizes_are_where_lambda_is_ten_and_twenty_five(id: str) -> None:
    power = FOUND[id]
    assert power.full == pytest.approx(lam(id, 1.0), rel=1e-4)
    for size, least in ((power.seen, VISIBLE), (power.named, NAMED_AS_A_RULE)):
        assert (size is None) == (power.full < least)
        if size is not None:
            assert lam(id, size) == pytest.approx(least, rel=1e-3)


def test_pressures_lie_about_the_tyres_own_and_any_tyre_has_modes() -> None:
    assert Protocol("", "", {}).about(240.0) == Protocol("", "", {})
    truck = Protocol("", "", {}).about(830.0)
    assert truck.given_kPa == (553, 830, 1107) and truck.held_out_kPa == 692
    bare = replace(CASE, case=CASE.case.model_copy(update={"targets": Targets()}))
    assert set(labels_to_measure(bare)) == set(labels_to_measure(CASE)) == set(USUAL_LABELS)
