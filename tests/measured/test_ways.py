"""One modal test, with ten known modes, in every way that measuring systems write it: all ten are
right, or one sentence says what is missing."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.measured.gather import Gathered, gather
from tyrecal.measured.modal import Layout

from .ten_modes import MODES, WAYS, files

pytestmark = pytest.mark.numbers

LAYOUT = Layout(highest=8, band=(30.0, 170.0))
QUICK = {"a frame per node, 18", "components", "shapes, 55", "hammer", "runs", "a broken cable"}
NOTES = {
    "components": "left out, not on the tyre: 48 functions of component hub",
    "hammer": "the impacts were moved over 48 channels past 1 fixed",
    "runs": "one test in 4 files with a common reference: 1.uff, 2.uff, 3.uff, 4.uff",
    "a broken cable": "left out, mostly noise: channel 5:2",
    "no motion": "left out, no motion along a direction 1, 2 or 3: channel 500:4, 501:0",
    "directions of the sensors": "--directions cylindrical is taken",
}


def imported(folder: Path, way: str) -> Gathered:
    return gather(files(folder, way), 240.0, LAYOUT, assumed=0.002)


@pytest.mark.parametrize(
    "way",
    [pytest.param(w, marks=[pytest.mark.slow] * (w not in QUICK)) for w in WAYS] + ["shapes, 2414"],
)
def test_ten_modes_are_right_however_they_are_written(tmp_path: Path, way: str) -> None:
    result = imported(tmp_path, way)
    assert {row.label: row.value for row in result.rows} == pytest.approx(MODES, rel=1e-3)
    assert len(result.runs) == 1 and result.runs[0].explained > 0.99
    damping = [mode.mode.damping for mode in result.runs[0].modes]
    assert damping == pytest.approx([0.025] * 10, rel=0.05)
    if way in NOTES:
        assert any(NOTES[way] in note for note in result.notes), result.notes
    else:
        assert not result.notes
