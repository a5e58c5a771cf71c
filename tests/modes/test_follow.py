"""Shapes followed from one state to the next, harmonic or sampled on rings."""

import numpy as np
import pytest

from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode
from tyrecal.simulate.modes.follow import follow
from tyrecal.simulate.modes.label import Label, Mode
from tyrecal.simulate.modes.match import margin, match
from tyrecal.simulate.modes.rings import harmonic_of, on_rings

from ..chance import generator

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
