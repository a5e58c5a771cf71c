"""Repeats that contradict each other are reported, not averaged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.gather import gather
from tyrecal.measured.measurement import Measurement
from tyrecal.measured.slips import common_shifts, contradictions
from tyrecal.simulate.modes.label import Label

pytestmark = pytest.mark.numbers

MISTYPED = """run,label,frequency [Hz],pressure [kPa],sigma [Hz]
1,"[2,0]",79.5,240,0.2
2,"[2,0]",79.6,240,0.2
1,"[3,0]",97.6,240,0.2
2,"[3,0]",79.6,240,0.2
1,"[4,0]",115.9,240,0.2
2,"[4,0]",115.8,240,0.2
"""


def repeated(*rows: tuple[float, ...]) -> list[Measurement]:
    """A row of repeats for each label, a line of the file for each."""
    values = []
    for i, row in enumerate(rows):
        for j, hertz in enumerate(row):
            place = f"t.csv, line {10 * (i + 1) + j}"
            what = ("frequency_Hz", Label(i + 1, 0), "", 240.0, 0.0)
            values.append(Measurement(*what, hertz, run=f"t.csv {j + 1}", place=place))
    return values


def lines(values: list[Measurement]) -> list[str]:
    """The lines of the slips."""
    return [each.slip.place.removeprefix("t.csv, line ") for each in contradictions(values)]


def test_two_runs_that_differ_stop_the_import(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(MISTYPED)
    with pytest.raises(InputError) as error:
        gather([path])
    assert str(error.value) == (
        f"{path}, line 5: [3,0] is 79.6 (run 2), but 97.6 in {path}, line 4 (run 1); they differ"
        " by 18 %. Is it a slip, or another mode? Correct it, or leave it out with --keep-going"
    )
    gathered = gather([path], keep_going=True)
    rows = [(str(row.label), row.value, round(row.sigma, 3)) for row in gathered.rows]
    assert rows == [("[2,0]", 79.55, 0.141), ("[4,0]", pytest.approx(115.85), 0.141)]
    (note,) = gathered.notes
    assert note.startswith("left out (both): ") and "--keep-going" not in note
    assert note.removeprefix("left out (both): ") in str(error.value)


def test_files_that_contradict_each_other_stop_the_import(tmp_path: Path) -> None:
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    one.write_text('label,f [Hz],p [kPa]\n"[3,0]",97.6,240\n')
    two.write_text('label,f [Hz],p [kPa]\n"[3,0]",123.2,240\n')
    with pytest.raises(InputError, match=r"two.csv, line 2: .* 123.2, but 97.6 in .*one.csv, line"):
        gather([one, two], assumed=0.01)
    with pytest.raises(InputError, match="all repeats contradict each other"):
        gather([one, two], assumed=0.01, keep_going=True)


def test_one_of_three_runs_is_left_out_alone() -> None:
    values = repeated(
        (58.5, 58.6, 58.4), (93.6, 97.4, 94.3), (97.6, 97.5, 97.8), (115.9, 116.2, 115.8)
    )
    (slip,) = contradictions(values)
    assert [each.value for each in slip.left_out] == [97.4]
    assert [each.value for each in slip.others] == [93.6, 94.3]
    assert "97.4 (run 2), but 93.95, the mean of the others, in t.csv, line 20 (run 1)" in str(slip)
    assert "by 3.7 %, other repeats by 0." in str(slip)


def test_two_slips_do_not_hide_each_other() -> None:
    rows = [[f * (1 + 1e-3 * e) for e in (-1, 0.4, 0.6)] for f in (40, 55, 70, 85, 100, 115)]
    rows[1][0] *= 1.05
    rows[4][2] *= 0.95
    assert lines(repeated(*map(tuple, rows))) == ["20", "52"]


@pytest.mark.parametrize(
    "rows",
    [
        ((66.0, 66.0), (70.0, 70.0), (81.2, 81.2), (90.1, 90.0)),  # the last digit
        ((66.0, 66.0), (70.0, 70.0), (81.25, 81.25), (90.0, 90.25)),  # a spectrum's line
        ((66.0, 67.0),),  # nothing to compare it with
        ((60.0, 62.0, 61.0), (70.0, 72.0, 73.5), (80.0, 77.0, 79.0)),  # all scatter alike
        ((60.0,), (70.0,)),
    ],
)
def test_what_scatters_as_the_others_do_is_no_slip(rows: tuple[tuple[float, ...], ...]) -> None:
    assert lines(repeated(*rows)) == []


def test_a_stated_uncertainty_allows_more_than_a_few_per_cent() -> None:
    values = repeated((60.0, 66.0))
    assert lines(values) == ["11"]
    assert lines([replace(each, sigma=2.0) for each in values]) == []


def test_a_slip_is_found_among_many_repeats_and_changes_no_other_sigma() -> None:
    """The slip of 1 % is in every place of a table in turn; repeats scatter by 0.1 %."""
    scatter = np.resize([-1.2, 0.3, 0.9, 1.1, -0.4, -0.7, 0.2, 1.4, -1.6], (6, 4)) * 1e-3
    clean = np.linspace(40, 140, 6)[:, None] * (1 + scatter)
    assert lines(repeated(*map(tuple, clean))) == []
    for i, j in np.ndindex(clean.shape):
        wrong = clean.copy()
        wrong[i, j] *= 1.01 if (i + j) % 2 else 0.99
        assert lines(repeated(*map(tuple, wrong))) == [str(10 * (i + 1) + j)]


def test_runs_that_all_differ_by_the_same_share_are_reported() -> None:
    """A message appears for two runs 3.4 % apart in every label, as at two pressures, and not if
    one label alone differs."""
    pairs = [(f * 1.034 * (1 + e), f) for f, e in ((84.8, 1e-3), (101.7, -1e-3), (41.3, 5e-4))]
    (words,) = common_shifts(repeated(*pairs))
    assert "all 3 frequencies are 3.4 % above those of" in words and "pressure" in words
    assert common_shifts(repeated((84.8, 84.9), (101.7, 101.5), (41.3, 43.0))) == []
