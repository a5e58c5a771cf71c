"""Derivatives of the pressed tyre by the design variables, against differences of whole presses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.store import Store
from tyrecal.tyre.load import load_case

from ..studies.hertz import coarse_case

NAMES = ("deflection_m", "stiffness_N_per_m", "contact_area_m2", "contact_length_m")
NAMES += ("contact_width_m",)
# cords, rubber, geometry, pressure, and the road's own
MORE = """
  wear: {sets: [effects.tread_wear], start: 1.0e-2, lower: 1.0e-3, upper: 1.0e-1}
  p: {sets: [pressure_kPa], start: 240.0, lower: 100.0, upper: 400.0}
  k: {sets: [road.stiffness_Pa_per_m], start: 1.0e+9, lower: 1.0e+8, upper: 1.0e+10}
  mu: {sets: [road.friction], start: 0.5, lower: 0.1, upper: 1.0}
"""
# by which the logarithm of each moves: rubber, geometry, pressure, and the road's own
ALONG = {"C10": 0.8, "wear": 5.0, "p": -0.4, "k": 1.0, "mu": -1.5}
STEP = 1e-4


def small_case(folder: Path) -> Path:
    """The main case, pressed in half a second, with more variables."""
    path = coarse_case(folder)
    text = path.read_text().replace("[6, 6, 6, 12, 30, 120]", "[10, 14, 36, 120]")
    few = "crown: 4, upper_sidewall: 3, lower_sidewall: 3"
    text = text.replace(few, "crown: 3, upper_sidewall: 2, lower_sidewall: 2")
    before, rest = text.split("\ntargets:", 1)
    path.write_text(f"{before.rstrip()}{MORE}\ntargets:{rest}")
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    "loads", [[1000.0], pytest.param([1000.0, 1500.0], marks=pytest.mark.slow)]
)
def test_along_all_variables_at_once_they_are_differences(
    loads: list[float], tmp_path: Path
) -> None:
    """Sensitivities agree with differences to 1e-3 of the largest, also at the second load,
    whose slip counts from the first one's patch."""
    case = load_case(small_case(tmp_path))
    start = {name: case.case.variables[name].start for name in ALONG}
    evaluator = Evaluator(TyreDesign(case), store=Store(tmp_path / "record"))
    pressed, again = (evaluator.press(start, loads, gradients=tuple(start)) for _ in range(2))
    assert (evaluator.counts.runs, evaluator.counts.recorded) == (1, 1)
    assert [each.slopes for each in again.footprints] == [
        each.slopes for each in pressed.footprints
    ]
    above, below = (
        evaluator.press({v: x * np.exp(step * ALONG[v]) for v, x in start.items()}, loads)
        for step in (STEP, -STEP)
    )
    states = zip(pressed.footprints, above.footprints, below.footprints, strict=True)
    for at, up, down in states:
        for name in NAMES:
            each = [at.slopes[v][name] * start[v] * ALONG[v] for v in start]
            difference = (getattr(up, name) - getattr(down, name)) / (2 * STEP)
            assert abs(sum(each) - difference) < 1e-3 * max(map(abs, each)), (at.load_N, name)
