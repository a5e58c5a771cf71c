"""Exchanged pressures, exchanged labels and single slips are reported before any fit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tyrecal.measured.gather import gather
from tyrecal.measured.measurement import Measurement, measurements_csv
from tyrecal.measured.sense import doubts, doubts_of_file
from tyrecal.simulate.modes.label import Label

pytestmark = pytest.mark.numbers

CASES = Path(__file__).parents[2] / "cases"
LATERAL, TORSIONAL = Label(0, 0, "axial"), Label(0, 0, "torsional")
AT_200_kPa = {  # a measured tyre
    LATERAL: 31.7,
    TORSIONAL: 35.0,
    Label(1, 1): 37.8,
    Label(1, 0): 58.5,
    Label(2, 1): 66.1,
    Label(2, 0): 79.5,
    Label(3, 0): 97.6,
    Label(3, 1): 102.7,
    Label(4, 0): 115.9,
}
RISES = [0.38, 0.22, 0.33, 0.3, 0.28, 0.36, 0.39, 0.31, 0.4]


def measured(*pressures: float) -> list[Measurement]:
    """The tyre at pressures, kPa, a line of the file for each mode."""
    rows = [
        ("frequency_Hz", label, "", p, 0.0, hertz * (p / 200) ** rise, 0.003 * hertz)
        for p in pressures
        for rise, (label, hertz) in zip(RISES, AT_200_kPa.items(), strict=True)
    ]
    return [Measurement(*row, place=f"t.csv, line {i + 2}") for i, row in enumerate(rows)]


def relabelled(rows: list[Measurement], one: Label, other: Label, at: float) -> list[Measurement]:
    """The same with two labels exchanged at a pressure; 0: at all."""
    names = {one: other, other: one}
    return [
        replace(row, label=names.get(row.label or one, row.label))
        if at in (0, row.pressure_kPa)
        else row
        for row in rows
    ]


@pytest.mark.parametrize("pressures", [(200,), (200, 250), (180, 220, 260), (120, 240)])
def test_a_tyre_raises_no_doubt(pressures: tuple[float, ...]) -> None:
    assert doubts(measured(*pressures)) == []
    assert doubts(measured(*pressures)[:1]) == []


@pytest.mark.parametrize("name", ["p235_75r17_wheeler.csv", "205_60r15_both.csv"])
def test_published_measurements_raise_no_doubt(name: str) -> None:
    assert doubts_of_file(CASES / name) == []


def test_exchanged_pressures_are_reported_with_their_lines() -> None:
    names = {200.0: 250.0, 250.0: 200.0}
    for pressures in ((200, 250), (200, 250, 300), (160, 200, 250)):
        rows = measured(*pressures)
        wrong = [replace(r, pressure_kPa=names.get(r.pressure_kPa, r.pressure_kPa)) for r in rows]
        (doubt,) = doubts(wrong)
        assert "do not rise with pressure" in doubt and "are 200 and 250 kPa exchanged?" in doubt
        first = 2 + 9 * pressures.index(200)
        assert doubt.startswith(f"t.csv, line {first + 9}, t.csv, line {first}: ")


@pytest.mark.parametrize(
    ("one", "other", "at"),
    [
        (Label(1, 0), Label(1, 1), 0),
        (Label(2, 0), Label(2, 1), 0),
        (Label(3, 0), Label(4, 0), 0),
        (LATERAL, Label(2, 1), 0),
        (Label(3, 0), Label(3, 1), 250),
        (TORSIONAL, Label(1, 1), 200),
    ],
)
def test_exchanged_labels_are_reported(one: Label, other: Label, at: float) -> None:
    (doubt,) = doubts(relabelled(measured(200, 250), one, other, at))
    assert "are the two labels exchanged?" in doubt
    assert one.display in doubt and other.display in doubt


def test_a_row_far_from_a_smooth_curve_is_reported() -> None:
    rows = measured(200, 250)
    rows[5] = replace(rows[5], value=97.5)  # for 79.5
    (doubt,) = doubts(rows)
    assert doubt.startswith("t.csv, line 7: [2,0] is 97.5 Hz at 200 kPa, where a smooth curve")
    assert "has 79" in doubt or "has 80" in doubt


def test_an_import_reports_doubts_and_keeps_the_data(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(measurements_csv(relabelled(measured(240), Label(1, 0), Label(1, 1), 0)))
    gathered = gather([path])
    assert len(gathered.rows) == 9
    (doubt,) = gathered.doubts
    assert doubt.startswith(f"{path}, line ") and doubts_of_file(path) == [doubt]


def test_a_label_with_many_waves_below_one_with_few_is_reported() -> None:
    """[12,0] in the place of [4,0]: two points of the test were exchanged."""
    rows = measured(200)
    rows[-1] = replace(rows[-1], label=Label(12, 0))
    (doubt,) = doubts(rows)
    assert "[12,0] is 115.9 Hz" in doubt and "slip, or another mode" in doubt


def test_what_is_nearly_as_likely_is_named_too() -> None:
    """A mode that contradicts itself at two pressures is as likely as two exchanged labels: the
    doubt names one, and then the other."""
    rows = measured(200, 250)
    rows[1] = replace(rows[1], value=0.88 * rows[1].value)
    (single,) = doubts(rows)
    first, other = single.split(" Nearly as likely is ")
    assert first.startswith("t.csv, line 3: ") and other.startswith("t.csv, line 12: ")
    swapped = relabelled(measured(200, 250), Label(3, 0), Label(3, 1), 200)
    (pair,) = doubts(swapped)
    first, other = pair.split(" Nearly as likely: ")
    assert first.startswith("t.csv, line 9, t.csv, line 8: ")
    assert other.startswith("t.csv, line 17, t.csv, line 18: ")
