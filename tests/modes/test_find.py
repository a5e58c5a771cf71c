"""Labelled modes of designs: a label that is not among the first modes is asked for again.

Labels of the real tyre against frequencies that another program named on a fine mesh.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.decks import steps
from tyrecal.simulate.evaluate.evaluator import Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.modes.find import MORE_MODES, LabelledModes, find_modes
from tyrecal.simulate.modes.label import Label, label_modes, labelled
from tyrecal.simulate.modes.match import margin, match

from ..fit.fake import LABELS, FakeEvaluator
from ..fit.known_truth import CASE, POWERS, START, TARGETS
from ..studies.labels import evaluate


class FewModes(FakeEvaluator):
    """Gives the last mode only where as many as ``enough`` are asked for."""

    enough: int | None = None

    def evaluate(self, question: Question):
        evaluation = super().evaluate(question)
        self.asked = [*getattr(self, "asked", []), question.modes_per_harmonic]
        if question.values["C10"] > START["C10"]:
            raise DeckRefused("too stiff")
        if self.enough and (question.modes_per_harmonic or 0) < self.enough:
            return replace(evaluation, modes=evaluation.modes[:-1])
        return evaluation


@pytest.mark.parametrize("enough", [None, *MORE_MODES, 99])
def test_a_lost_label_is_asked_for_with_more_modes(enough: int | None) -> None:
    evaluator = FewModes(TARGETS, POWERS, START)
    evaluator.enough = enough
    ((place, labelled),) = find_modes(evaluator, [Question(START)], [LABELS[-1]])
    assert place == 0
    wanted = [None, *MORE_MODES]
    assert evaluator.asked == wanted[: wanted.index(enough) + 1 if enough in wanted else None]
    if enough == 99:
        assert isinstance(labelled, EvaluationFailed) and labelled.cause == "lost_label"
        assert str(LABELS[-1]) in str(labelled)
    else:
        assert isinstance(labelled, LabelledModes) and list(labelled.wanted) == [LABELS[-1]]
        assert len(labelled.modes) == len(LABELS) and 0 < labelled.clarity <= 1


class AtAnEdge(FakeEvaluator):
    """Has no mode [4,0] where A_belt is above its start."""

    def evaluate(self, question: Question):
        evaluation = super().evaluate(question)
        if question.values["A_belt"] > START["A_belt"]:
            return replace(evaluation, modes=evaluation.modes[:-1])
        return evaluation


@pytest.mark.parametrize("wanted", [LABELS[:1], LABELS])
def test_without_exact_sensitivities_they_are_differences(wanted: list[Label]) -> None:
    """Above or, where that has no solution or lacks a wanted label, below; a mode whose label is
    not wanted has none where the neighbour lacks it."""
    fails = lambda values: values["C10"] > START["C10"]
    question, names = Question(START, tuple(START)), list(START)
    exact, differing = (
        dict(find_modes(AtAnEdge(TARGETS, POWERS, START, f, has), [question], wanted))[0]
        for f, has in ((lambda values: False, True), (fails, False))
    )
    assert isinstance(exact, LabelledModes) and isinstance(differing, LabelledModes)
    own, other = (
        np.array([each.evaluation.gradients[n] * START[n] for n in names])
        for each in (exact, differing)
    )
    known = np.isfinite(other)
    assert list(zip(*np.where(~known), strict=True)) == ([(0, 8)] if len(wanted) == 1 else [])
    assert other[known] == pytest.approx(own[known], abs=2e-3)  # Hz per logarithm
    assert differing.evaluation.mass_gradients == dict.fromkeys(START, 0.0)


@pytest.mark.parametrize(
    ("name", "value", "wanted"),
    [
        ("C10", 1e6, [1.1e6, 0.9e6]),  # a share of the value
        ("C10", 1e7, [9e6]),  # within the bounds, where it is there itself
        ("C10", 2e7, [2.2e7, 1.8e7]),
        ("linear", 2.0, [2.4, 1.6]),  # a share of the bounds' distance
        ("linear", 0.1, [0.5]),  # of its sign
        ("narrow", 0.1, [0.1 + 1e-3 / 3]),
        ("effects.bead_filler", 0.0, [0.3, -0.3]),  # of the range
        ("rebar_layers.carcass.angle_deg", 0.0, [9.0, -9.0]),  # of a quarter turn
        ("pressure_kPa", 200.0, [220.0, 180.0]),
    ],
)
def test_steps_of_numbers(name: str, value: float, wanted: list[float]) -> None:
    variables = {**CASE.case.variables}
    changes = {"scale": "linear", "lower": -1.0, "upper": 3.0}
    variables["linear"] = variables["C10"].model_copy(update=changes)
    changes = {"lower": 0.1, "upper": 0.101}
    variables["narrow"] = variables["C10"].model_copy(update=changes)
    case = replace(CASE, case=CASE.case.model_copy(update={"variables": variables}))
    assert sorted(steps(case, name, value, 0.1)) == pytest.approx(sorted(wanted))


def test_what_has_no_neighbour_fails_and_nothing_else() -> None:
    """All neighbours of a side are asked for together; a denied licence is asked for once."""
    fails = lambda values: START["C10"] != values["C10"] < 2 * START["C10"]
    tyre = FakeEvaluator(TARGETS, POWERS, START, fails, has_gradients=False)
    questions = [Question({**START, "C10": c}, ("C10",)) for c in (START["C10"], 4e6)]
    answers = dict(find_modes(tyre, questions, LABELS, jobs=8))
    assert isinstance(answers[0], EvaluationFailed) and isinstance(answers[1], LabelledModes)
    assert tyre.jobs == [2, 2, 1] and tyre.calls == 5


def test_each_has_its_place_those_that_wait_the_last_ones() -> None:
    """Refusals and failures are answers too, and cost no other question anything."""
    evaluator = FewModes(TARGETS, POWERS, START, lambda values: values["C10"] < START["C10"])
    evaluator.enough = 4
    soft, stiff = ({**START, "C10": START["C10"] * factor} for factor in (0.5, 2.0))
    # the plain one alone wants the mode that is not there at first
    answers = list(
        find_modes(evaluator, [Question(START), Question(soft), Question(stiff)], [LABELS[-1]])
    )
    assert [place for place, _ in answers] == [1, 2, 0]
    kinds = [type(answer) for _, answer in answers]
    assert kinds == [EvaluationFailed, DeckRefused, LabelledModes]


def test_labels_may_hang_on_the_modes() -> None:
    evaluator = FakeEvaluator(TARGETS, POWERS, START)
    ((_, labelled),) = find_modes(
        evaluator, [Question(START)], lambda _, modes: [m.label for m in modes if m.label.c == 2]
    )
    assert isinstance(labelled, LabelledModes) and set(labelled.wanted) == {
        x for x in LABELS if x.c == 2
    }


def test_modes_rise_in_frequency() -> None:
    evaluator = FakeEvaluator(TARGETS, POWERS, START)
    hertz = [mode.frequency_Hz for mode in labelled(evaluator.evaluate(Question(START)))]
    assert hertz == sorted(hertz) and len(hertz) == len(LABELS)


REFERENCE = Path(__file__).parents[1] / "data" / "reference.json"


def label(key):
    c, m, *kind = key.split(",")
    return Label(int(c), int(m), *kind)


@pytest.mark.parametrize("number", [0, 1, 2])
def test_the_nine_modes_of_the_paper_have_the_reference_frequencies(number):
    point = json.loads(REFERENCE.read_text())["sections"]["p235_75r17"][number]
    values = {name: point[name] for name in ("A_belt", "A_carcass", "C10")}
    modes = label_modes(evaluate(values, point["pressure_kPa"], 2))
    expected = {label(key): hertz for key, hertz in point["modes"].items()}
    matched = match(modes, list(expected))
    assert {k: v.frequency_Hz for k, v in matched.items()} == pytest.approx(expected, rel=6e-3)
    assert margin(matched) > 0.8
