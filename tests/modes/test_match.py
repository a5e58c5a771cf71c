import numpy as np
import pytest

from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode
from tyrecal.simulate.modes.label import Label, Mode
from tyrecal.simulate.modes.match import margin, match

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
