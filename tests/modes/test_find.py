"""Labelled modes of designs, and shapes followed from one state to the next."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.decks import steps
from tyrecal.simulate.evaluate.evaluator import Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode
from tyrecal.simulate.modes.find import MORE_MODES, LabelledModes, find_modes, margin, match
from tyrecal.simulate.modes.label import Label, Mode, label_modes, labelled
from tyrecal.simulate.modes.rings import follow, harmonic_of, on_rings

from ..chance import generator
from ..fit.fake import CASE, LABELS, POWERS, START, TARGETS, FakeEvaluator
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


ANGLES = np.arange(24) / 24 * 2 * np.pi


NODES = np.arange(4)


POINTS = np.array([[0.30, -0.1], [0.39, -0.05], [0.39, 0.05], [0.30, 0.1]])


RNG = generator(2)


def shape(n):
    made = RNG.standard_normal((4, 3)) + 1j * RNG.standard_normal((4, 3)) * (n > 0)
    return HarmonicShape(n, NODES, POINTS, made)


def mode(label, made, ring_turn=None):
    if ring_turn is not None:
        made = on_rings(made, NODES, ANGLES, ring_turn)
    return Mode(label, 50.0, 1, 1.0, 0, RawMode(50.0, made, 1))


@pytest.mark.numbers
@pytest.mark.parametrize(("n", "phase"), [(0, 0.0), (1, 0.4), (3, 2.0)])
def test_a_sample_gives_its_harmonic_shape_back(n, phase):
    made = shape(n)
    ring = on_rings(made, NODES, ANGLES, phase)
    mixed = RNG.permutation(len(ring.points))
    ring = type(ring)(ring.points[mixed], ring.displacement[mixed])
    recovered = harmonic_of(ring, n)
    order = np.lexsort(POINTS.T[::-1])
    assert recovered.points == pytest.approx(POINTS[order])
    assert recovered.amplitude == pytest.approx(made.amplitude[order] * np.exp(1j * phase))


@pytest.mark.numbers
def test_a_component_that_was_not_measured_is_zero():
    ring = on_rings(shape(2), NODES, ANGLES)
    ring.displacement[:, 1] = np.nan
    amplitude = harmonic_of(ring, 2).amplitude
    assert not amplitude[:, 1].any() and amplitude[:, [0, 2]].all()


@pytest.mark.numbers
@pytest.mark.parametrize("turns", [(None, None), (0.3, 1.9)])
def test_a_shape_is_followed_whatever_its_label_and_place(turns):
    """Labels and order change places in one of two harmonics: the shapes tell."""
    a, b, c = shape(2), shape(2), shape(3)
    one, two, three = Label(2, 0), Label(2, 1), Label(3, 0)
    before = [mode(x, y, turns[0]) for x, y in ((one, a), (two, b), (three, c))]
    after = [mode(x, y, turns[1]) for x, y in ((three, c), (one, b), (two, a))]
    steps = {step.before: step for step in follow(before, after)}
    assert {k: s.after for k, s in steps.items()} == {one: two, two: one, three: three}
    assert [s.mac for s in steps.values()] == pytest.approx([1.0, 1.0, 1.0])


@pytest.mark.numbers
def test_a_mode_without_a_partner_ends():
    a, b = shape(2), shape(2)
    before = [mode(Label(2, 0), a), mode(Label(2, 1), b), mode(Label(4, 0), shape(4))]
    (step,) = follow(before, [mode(Label(2, 3), b)])
    assert (step.before, step.after) == (Label(2, 1), Label(2, 3))


@pytest.mark.numbers
def test_rings_are_told_apart_to_ten_micrometres():
    """Points that were measured a micrometre off their ring are of it."""
    ring = on_rings(shape(2), NODES, ANGLES)
    near = ring.points + 1e-6 * RNG.choice([-1, 1], ring.points.shape) * [1, 0, 1]
    assert len(harmonic_of(type(ring)(near, ring.displacement), 2).points) == 4
    apart = ring.points.copy()
    apart[: len(ANGLES) // 2, 0] += 3e-5
    assert len(harmonic_of(type(ring)(apart, ring.displacement), 2).points) == 5


RAW = RawMode(1.0, HarmonicShape(0, np.empty(0), np.empty((0, 2)), np.empty((0, 3))), 1)


AXIAL, TORSIONAL = Label(0, 0, "axial"), Label(0, 0, "torsional")


MODES = [
    Mode(TORSIONAL, 38.1, 1, 0.7, 0, RAW),
    Mode(AXIAL, 36.7, 1, 0.6, 1, RAW),
    Mode(Label(2, 1), 73.0, 2, 0.9, 2, RAW),
    Mode(Label(2, 0), 88.1, 2, 0.3, 3, RAW),
]


def test_each_target_gets_its_mode_and_the_margin_is_the_least_clarity():
    matched = match(MODES, [AXIAL, TORSIONAL, Label(2, 1)])
    assert [mode.frequency_Hz for mode in matched.values()] == [36.7, 38.1, 73.0]
    assert list(matched) == [AXIAL, TORSIONAL, Label(2, 1)]
    assert margin(matched) == 0.6


def test_a_lost_label_is_named_with_what_was_found_instead():
    with pytest.raises(EvaluationFailed) as caught:
        match(MODES, [AXIAL, Label(2, 2), Label(2, 0)])
    assert caught.value.cause == "lost_label"
    assert str(caught.value) == (
        "no mode is [2,2]; with 2 waves round the circumference there are"
        " [2,1] at 73.00 Hz, [2,0] at 88.10 Hz"
    )


def test_all_lost_labels_are_named_at_once():
    with pytest.raises(EvaluationFailed, match=r"\[5,0\], \[6,0\]; with 5 or 6 waves .* is none"):
        match(MODES, [Label(5, 0), Label(6, 0)])
