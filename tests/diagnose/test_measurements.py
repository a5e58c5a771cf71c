"""Measurements: what a file may hold, every mistake by its line, pairs, repeats."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.diagnose.measurements import Reading, read_measurements
from tyrecal.diagnose.observations import observe
from tyrecal.errors import InputError
from tyrecal.modes.mode import Label

from ..chance import Chance

pytestmark = pytest.mark.numbers

HEADER = "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma\n"
GOOD = "frequency_Hz,2,0,,,240,0,79.5,0.2"


def read(tmp_path: Path, *lines: str, header: str = HEADER) -> list:
    path = tmp_path / "measured.csv"
    path.write_text(header + "\n".join(lines) + "\n")
    return read_measurements(path)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("frequency_Hz,2,0,,,240,0,79500,20", "did you mean 79500 mHz, 79.5 Hz?"),
        ("frequency_Hz,2,0,,,2.4,0,79.5,0.2", "pressure_kPa is '2.4'"),
        ("frequency_Hz,2,0,,,240,0,0.2,0.02", "no tyre has that frequency_Hz, usual is"),
        ("frequency_Hz,2,0,,,240,0,79.5,0", "greater than 0"),
        ("frequency_Hz,2,0,,,240,0,79.5,-1", "greater than 0"),
        ("frequency_Hz,2,0,,,240,0,79.5,", "greater than 0"),
        ("frequency_Hz,2,0,,,240,0,nan,0.2", "must be a number"),
        ("frequency_Hz,2,0,,,240,0,79.5,40", "more than 20%"),
        ("frequency_Hz,2.5,0,,,240,0,79.5,0.2", "whole number"),
        ("frequency_Hz,0,0,,,240,0,31.7,0.2", "axial or torsional"),
        ("frequency_Hz,2,0,axial,,240,0,79.5,0.2", "must be empty"),
        ("frequency_Hz,2,0,,3,240,0,79.5,0.2", "member is '3'"),
        ("frequency_Hz,0,0,axial,1,240,0,31.7,0.2", "member is '1'"),
        ("frequency_Hz,2,0,,1,240,4000,79.5,0.2", "symmetric or antisymmetric"),
        ("frequency,2,0,,,240,0,79.5,0.2", "quantity is 'frequency'"),
        ("contact_area_m2,,,,,240,,0.02,0.001", "load_N is '', must be greater than 0"),
        ("mass_kg,2,0,,,,,12.5,0.05", "must be empty for mass_kg"),
        ("frequency_Hz,2,0,,,240,0,79.5", "8 cells"),
        (GOOD, "same as line 2"),
        ("frequency_Hz,2,0,,1,240,0,79.5,0.2", "one value for both"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, line: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, GOOD, line)
    (sentence,) = str(caught.value).splitlines()
    assert "line 3" in sentence and words in sentence


@pytest.mark.parametrize(
    ("good", "bad"),
    [
        ("frequency_Hz,2,0,,,20,0,79.5,0.2", "frequency_Hz,2,0,,,19.9,0,79.5,0.2"),
        ("frequency_Hz,2,0,,,2000,0,79.5,0.2", "frequency_Hz,2,0,,,2001,0,79.5,0.2"),
        ("frequency_Hz,20,3,,,240,0,79.5,0.2", "frequency_Hz,21,3,,,240,0,79.5,0.2"),
        ("frequency_Hz,20,3,,,240,0,79.5,0.2", "frequency_Hz,20,4,,,240,0,79.5,0.2"),
        ("frequency_Hz,2,0,,,240,0,75,15", "frequency_Hz,2,0,,,240,0,75,15.1"),
        ("frequency_Hz,2,0,,1,240,0,79.5,0.2", "frequency_Hz,2,0,,0,240,0,79.5,0.2"),
        ("frequency_Hz,0,1,,,240,0,79.5,0.2", "frequency_Hz,0,1,axial,,240,0,79.5,0.2"),
        ("frequency_Hz,1,0,,,240,0,79.5,0.2", "frequency_Hz,1,0,torsional,,240,0,79.5,0.2"),
        ("frequency_Hz,0,1,,symmetric,240,4e3,79.5,1", "frequency_Hz,0,1,,,240,4e3,79.5,1"),
        ("frequency_Hz,2,0,,,240,0,79.5,0.2", "frequency_Hz,2,0,,,240,-1,79.5,0.2"),
        ("frequency_Hz,2,0,,,240,0,79.5,0.2", "frequency_Hz,2,0,,,240,some,79.5,0.2"),
        ("contact_area_m2,,,,,240,0.5,0.02,0.001", "contact_area_m2,,,,,240,0,0.02,0.001"),
        ("mass_kg,,,,,20,0,12.5,0.05", "mass_kg,,,,,19,0,12.5,0.05"),
        ("mass_kg,,,,,20,0,12.5,0.05", "mass_kg,,,,1,20,0,12.5,0.05"),
        ("mass_kg,,,,,20,0,12.5,0.05", "mass_kg,,,axial,,20,0,12.5,0.05"),
    ],
)
def test_what_is_allowed_at_a_limit_and_refused_beyond(tmp_path: Path, good: str, bad: str) -> None:
    assert len(read(tmp_path, good)) == 1
    with pytest.raises(InputError, match="line 2"):
        read(tmp_path, bad)


def test_ten_thousand_lines_are_read_and_no_more(tmp_path: Path) -> None:
    lines = [f"frequency_Hz,2,0,,,{20 + 0.1 * i:.1f},0,79.5,0.2" for i in range(10_001)]
    assert len(read(tmp_path, *lines[1:])) == 10_000
    with pytest.raises(InputError, match="more than 10000 lines"):
        read(tmp_path, *lines)


def test_pairs_and_single_values_of_another_load_or_pressure_do_not_meet(tmp_path: Path) -> None:
    line = "frequency_Hz,2,0,,{},{},{},79.5,0.2"
    apart = [line.format(1, 240, 0), line.format("", 250, 0), line.format("symmetric", 250, 1)]
    assert len(read(tmp_path, *apart)) == 3
    for member in ("2", ""):  # whichever comes first
        with pytest.raises(InputError, match="line 3: gives a pair a member"):
            read(tmp_path, line.format(member, 240, 0), line.format("" if member else 2, 240, 0))


def test_what_is_left_empty_is_none(tmp_path: Path) -> None:
    """No load and, of the mass, no pressure: 0; and no label."""
    mode, mass = read(tmp_path, "frequency_Hz,2,0,,,240,,79.5,0.2", "mass_kg,,,,,,,12.5,0.05")
    assert (mode.pressure_kPa, mode.load_N, mode.value, mode.sigma) == (240.0, 0.0, 79.5, 0.2)
    assert (mass.pressure_kPa, mass.load_N, mass.label) == (0.0, 0.0, None)


def test_every_mistake_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, "frequency_Hz,2,0,,,240,0,-1,0.2", GOOD, "area,,,,,240,0,1,1")
    assert [line.split(":")[0][-6:] for line in str(caught.value).splitlines()] == [
        "line 2", "line 4",
    ]  # fmt: skip


@pytest.mark.parametrize("header", ["c,m,kind\n", HEADER.replace("sigma", "std"), ""])
def test_wrong_columns(tmp_path: Path, header: str) -> None:
    with pytest.raises(InputError, match=r"columns must be .* measured import"):
        read(tmp_path, GOOD, header=header)


def test_the_order_of_columns_is_free(tmp_path: Path) -> None:
    swapped = "value,sigma,quantity,c,m,kind,member,pressure_kPa,load_N\n"
    (one,) = read(tmp_path, "79.5,0.2,frequency_Hz,2,0,,,240,0", header=swapped)
    (other,) = read(tmp_path, GOOD)
    assert one == other


def test_a_pair_is_a_mean_and_a_split_whichever_comes_first(tmp_path: Path) -> None:
    low, high = "frequency_Hz,2,0,,{},240,0,79.0,0.2", "frequency_Hz,2,0,,{},240,0,80.0,0.3"
    one = observe(read(tmp_path, low.format(1), high.format(2)))
    other = observe(read(tmp_path, high.format(1), low.format(2)))
    for found in (one, other):
        assert found.y == pytest.approx([np.log(79.0 * 80.0) / 2])
        assert found.split == pytest.approx([np.log(80 / 79)])
    sa, sb = 0.2 / 79, 0.3 / 80
    assert one.scatter == pytest.approx([np.hypot(sa, sb) / 2])
    assert one.split_scatter == pytest.approx([np.hypot(sa, sb)])


def test_a_lone_member_carries_half_the_usual_split(tmp_path: Path) -> None:
    line = "frequency_Hz,2,0,,1,240,0,80.0,0.2"
    lone = observe(read(tmp_path, line), split=0.004)
    assert lone.scatter == pytest.approx([np.hypot(0.2 / 80, 0.002)])
    assert np.isnan(lone.split[0])


def test_repeats_tell_the_scatter_and_what_a_run_shares(chance: Chance) -> None:
    """Two ways of scatter, drawn and found again: mean variances over 300 tyres within 4 %.

    False failures: 2e-7.
    """
    random = chance.random
    labels = [Label(c, m) for c in range(1, 7) for m in (0, 1)]
    own, shared = [], []
    for _ in range(300):
        runs = []
        for _ in range(3):
            common = random.normal(0, 0.004)
            runs.append([
                Reading("frequency_Hz", x, "", 240.0, 0.0,
                        50 * np.exp(common + random.normal(0, 0.002)), 5.0, 2)
                for x in labels
            ])  # fmt: skip
        found = observe(runs[0], runs[1:])
        own.append(np.mean(found.scatter**2) * 3 / 0.002**2)
        shared.append(found.common**2 * 3 / 0.004**2)
    chance.mean(own, 0.96, 1.04)
    chance.mean(shared, 0.96, 1.04)


def test_what_is_not_used_is_said(tmp_path: Path) -> None:
    lines = [GOOD, "contact_area_m2,,,,,240,4000,0.02,0.001",
             "frequency_Hz,1,0,,symmetric,240,4000,70,0.5"]  # fmt: skip
    run = read(tmp_path, *lines)
    found = observe(run, [], [run])  # of the first run it is compared, not left out
    assert len(found.rows) == 2 and len(found.left_out) == 2
    assert "contact_area_m2" in found.left_out[0] and "under load" in found.left_out[1]
    assert all(words.startswith("measured.csv, line ") for words in found.left_out)


def test_repeats_that_cannot_be_used_are_said(tmp_path: Path) -> None:
    both = [GOOD, "frequency_Hz,3,0,,,240,0,98,0.2", "frequency_Hz,4,0,,,240,0,116,0.2"]
    again = ["frequency_Hz,3,0,,,240,0,98.4,0.2", "frequency_Hz,4,0,,,240,0,116.3,0.2",
             "frequency_Hz,1,0,,,240,0,58,0.2"]  # fmt: skip
    found = observe(read(tmp_path, *both), [read(tmp_path, *again)])
    assert len(found.rows) == 3 and found.y[0] == pytest.approx(np.log(79.5))
    assert found.left_out == (
        "repeats of [2,0] at 240 kPa: not in every file, the first one's value and sigma hold",
        "[1,0] at 240 kPa: in repeats only",
    )
    alone = observe(read(tmp_path, *both), [read(tmp_path, again[0])])
    assert any(words.startswith("all repeats: fewer than two") for words in alone.left_out)
    assert not observe(read(tmp_path, *both), [read(tmp_path, *both)]).left_out


def test_a_toggled_run_is_no_repeat(tmp_path: Path) -> None:
    """It may have other modes, and its values do not enter the scatter."""
    lines = [GOOD, "frequency_Hz,3,0,,,240,0,98,0.2", "frequency_Hz,4,0,,,240,0,116,0.2"]
    again = ["frequency_Hz,2,0,,,240,0,79.7,0.2", "frequency_Hz,3,0,,,240,0,98.1,0.2",
             "frequency_Hz,4,0,,,240,0,115.8,0.2"]  # fmt: skip
    run, repeat = read(tmp_path, *lines), read(tmp_path, *again)
    toggled = read(tmp_path, lines[0], "frequency_Hz,1,0,,,240,0,40,0.3")
    for repeats in ([], [repeat]):
        alone, found = observe(run, repeats), observe(run, repeats, [toggled])
        assert not found.left_out and found.common == alone.common
        assert found.y[:3] == pytest.approx(alone.y)
        assert found.scatter[:3] == pytest.approx(alone.scatter)
        assert found.y[3:] == pytest.approx(np.log([40, 79.5]))
        assert found.scatter[3:] == pytest.approx([0.3 / 40, 0.2 / 79.5])
        assert [row.run for row in found.rows] == [0, 0, 0, 1, 1]


def test_the_scatter_of_repeats_by_the_analysis_of_variance() -> None:
    """Two ways without interaction (values, runs), 4 values in 3 runs: mean squares over their
    degrees of freedom; each value's own variance counts 2 of 6 parts beside the pooled one."""
    table = np.random.default_rng(4).normal(0, 0.003, (4, 3)) + np.array([0.01, 0.0, -0.02])
    runs = [
        [Reading("frequency_Hz", Label(c + 1, 0), "", 240.0, 0.0, 50 * np.exp(y), 1.0, 2)
         for c, y in enumerate(column)]
        for column in table.T
    ]  # fmt: skip
    found = observe(runs[0], runs[1:])
    rest = [[y - table[i].mean() - table[:, k].mean() + table.mean() for k, y in enumerate(row)]
            for i, row in enumerate(table)]  # fmt: skip
    squares = np.sum(np.square(rest), axis=1)
    pooled = squares.sum() / ((4 - 1) * (3 - 1))
    between_runs = 4 * np.sum((table.mean(0) - table.mean()) ** 2) / (3 - 1)
    assert found.y == pytest.approx(np.log(50) + table.mean(1))
    assert found.common**2 == pytest.approx((between_runs - pooled) / 4 / 3)
    assert found.scatter**2 == pytest.approx((4 * pooled + squares) / (4 + 2) / 3)
