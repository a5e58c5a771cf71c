"""Repeats that contradict each other are reported, not averaged.

Combination of repeats: the mean of their values, and how far it may be off.
Exchanged pressures, exchanged labels and single slips are reported before any fit.
"""

from __future__ import annotations

from dataclasses import replace
from math import nan
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t

from tyrecal.errors import InputError
from tyrecal.measured.gather import gather
from tyrecal.measured.measurement import Measurement, measurements_csv
from tyrecal.measured.repeats import _order, combined
from tyrecal.measured.sense import doubts, doubts_of_file
from tyrecal.measured.slips import common_shifts, contradictions
from tyrecal.simulate.modes.label import Label

from ..chance import Chance

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


def test_of_many_slips_twelve_are_told() -> None:
    rows = [[f * (1 + 1e-3 * e) for e in (-1, 0.4, 0.6)] for f in range(40, 140, 2)]
    for row in rows[:14]:
        row[1] *= 1.2
    assert len(lines(repeated(*map(tuple, rows)))) == 12


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


LABELS = [Label(c, m) for c in (1, 2, 3, 4) for m in (0, 1)]


def value(
    hertz: float, run: str, label: Label = LABELS[0], member: str = "", sigma: float = nan
) -> Measurement:
    return Measurement("frequency_Hz", label, member, 240.0, 0.0, hertz, sigma, run, "here")


def test_sigma_covers_the_truth_from_three_runs(chance: Chance) -> None:
    """Shares within one and two sigma of all eight modes, as of Student's t with the 16 degrees of
    freedom that they have together.

    False failures: 2e-7.
    """
    truth = np.linspace(40, 120, len(LABELS))
    within = []
    for _ in range(200):
        runs = [
            value(f * (1 + 0.002 * chance.random.standard_normal()), str(k), label)
            for k in range(3)
            for f, label in zip(truth, LABELS, strict=True)
        ]
        rows = {row.label: row for row in combined(runs, floor=0.0)}
        z = [(rows[x].value - f) / rows[x].sigma for x, f in zip(LABELS, truth, strict=True)]  # type: ignore[operator]
        within.append([np.mean(np.abs(z) < k) for k in (1, 2)])
    for k, shares in zip((1, 2), np.transpose(within), strict=True):
        share = 1 - 2 * t(16).sf(k)
        chance.mean(shares, share - 0.02, share + 0.02)


def test_of_one_label_alone_it_is_the_textbooks() -> None:
    x = [66.0, 66.2, 66.4, 66.1]
    (row,) = combined([value(f, str(k)) for k, f in enumerate(x)], floor=0.0)
    assert row.value == pytest.approx(np.mean(x))
    assert row.sigma == pytest.approx(np.std(x, ddof=1) / 2, rel=1e-3)


def test_what_runs_state_counts_where_they_scatter_less() -> None:
    (row,) = combined([value(66.0, "1", sigma=0.4), value(66.0, "2", sigma=0.3)])
    assert row.sigma == pytest.approx(0.25)
    (row,) = combined([value(66.0, "1"), value(66.0, "2")], assumed=0.01)
    assert row.sigma == pytest.approx(0.66 / np.sqrt(2))


def test_no_sigma_is_below_the_floor() -> None:
    (row,) = combined([value(66.0, "1"), value(66.0, "2")], floor=0.002)
    assert row.sigma == pytest.approx(0.132)


def test_a_single_value_without_sigma_is_refused() -> None:
    with pytest.raises(InputError, match=r"nothing states how far \[1,0\] may be off"):
        combined([value(66.0, "1")])


def test_a_doublet_is_one_value_where_a_run_saw_only_one() -> None:
    two = [value(66.0, "1", member="1"), value(66.4, "1", member="2")]
    rows = combined([*two, value(66.1, "2", member="1"), value(66.5, "2", member="2")])
    assert [(row.member, row.value) for row in rows] == [
        ("1", pytest.approx(66.05)),
        ("2", pytest.approx(66.45)),
    ]
    (row,) = combined([*two, value(66.3, "2")])
    assert (row.member, row.value) == ("", pytest.approx(66.25))


def test_a_lone_member_stays_one() -> None:
    """A diagnosis gives it half the usual split more, so it must not pass for the pair's value."""
    (row,) = combined([value(66.0, "1", member="1"), value(66.2, "2", member="1")])
    assert (row.member, row.value) == ("1", pytest.approx(66.1))
    (row,) = combined([value(66.0, "1", member="2", sigma=0.1)])
    assert row.member == "2"
    (row,) = combined([value(66.0, "1", member="1"), value(66.4, "2", member="2")])
    assert row.member == ""


@pytest.mark.parametrize(
    "runs", [[value(66.0, "1", sigma=40.0)], [value(30.0, "1"), value(90.0, "2")]]
)
def test_a_sigma_that_no_fit_would_read_is_refused(runs: list[Measurement]) -> None:
    with pytest.raises(InputError, match=r"sigma of \[1,0\] is .* more than 20 %"):
        combined(runs)


def test_the_csv_is_sorted_and_whole() -> None:
    rows = combined([value(70.0, "1", LABELS[2], sigma=0.1), value(66.0, "1", sigma=0.123456)])
    assert measurements_csv(rows).splitlines() == [
        "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma",
        "frequency_Hz,1,0,,,240,0,66,0.123",
        "frequency_Hz,2,0,,,240,0,70,0.1",
    ]


def test_rows_come_by_quantity_state_and_mode() -> None:
    """Frequencies first, by pressure and load; [0,0] by its kind, then c, m and the member."""
    at = lambda label, member="", pressure=240.0, load=0.0: Measurement(
        "frequency_Hz", label, member, pressure, load, 50.0
    )
    area = Measurement("contact_area_m2", None, "", 160.0, 4e3, 0.02)
    wanted = [
        at(Label(9, 3), pressure=160.0),
        at(Label(0, 0, "axial")),
        at(Label(0, 0, "torsional")),
        at(Label(0, 1)),
        at(Label(1, 0), "1"),
        at(Label(1, 0), "2"),
        at(Label(1, 0), load=10.0),
        area,
    ]
    assert sorted(wanted[::-1], key=_order) == wanted


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
