"""Labels of the real tyre against frequencies that another program named on a fine mesh."""

import json
from pathlib import Path

import pytest

from tyrecal.simulate.modes.label import Label, label_modes
from tyrecal.simulate.modes.match import margin, match

from ..studies.labels import evaluate

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
