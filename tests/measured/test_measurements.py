"""The measurements CSV: what it may hold, every mistake by its line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.measurement import measurements_csv
from tyrecal.measured.tables import read_measurements
from tyrecal.measured.targets import in_states
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import TyreState
from tyrecal.tyre.values import with_values

from ..conftest import CASES

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
        (
            "frequency_Hz,2,0,,,2.4,0,79.5,0.2",
            "2.4 kPa: usual is 20 to 2000 kPa; did you mean 2.4 bar, 240 kPa",
        ),
        (
            "contact_area_m2,,,,,240,4,0.02,0.001",
            "the load is 4 N: usual is 100 to 60000 N; did you mean 4 kN, 4000 N",
        ),
        (
            "contact_length_m,,,,,220,4000,132,2",
            "contact_length_m is 132: no tyre has that, usual is 0.005 to 1 m; did you mean"
            " 132 mm, 0.132 m?",
        ),
        ("contact_width_m,,,,,220,0,0.14,0.002", "greater than 0 for contact_width_m"),
        ("frequency_Hz,2,0,,,240,0,0.2,0.02", "frequency_Hz is 0.2: no tyre has that, usual is"),
        ("frequency_Hz,2,0,,,240,0,79.5,0", "greater than 0"),
        ("frequency_Hz,2,0,,,240,0,79.5,-1", "greater than 0"),
        ("frequency_Hz,2,0,,,240,0,79.5,", "greater than 0"),
        ("frequency_Hz,2,0,,,240,0,nan,0.2", "must be a number"),
        ("frequency_Hz,2,0,,,240,0,79.5,40", "more than 20 %"),
        ("frequency_Hz,2.5,0,,,240,0,79.5,0.2", "whole number"),
        ("frequency_Hz,0,0,,,240,0,31.7,0.2", "lateral (axial) or torsional"),
        ("frequency_Hz,2,0,axial,,240,0,79.5,0.2", "must be empty"),
        ("frequency_Hz,2,0,,3,240,0,79.5,0.2", "member is '3'"),
        ("frequency_Hz,0,0,axial,1,240,0,31.7,0.2", "member is '1'"),
        ("frequency_Hz,2,0,,1,240,4000,79.5,0.2", "symmetric or antisymmetric"),
        ("frequency,2,0,,,240,0,79.5,0.2", "quantity is 'frequency'"),
        ("contact_area_m2,,,,,240,,0.02,0.001", "the load is 0, must be greater than 0"),
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
        ("contact_area_m2,,,,,240,100,0.001,1e-5", "contact_area_m2,,,,,240,0,0.001,1e-5"),
        ("contact_area_m2,,,,,240,100,0.001,1e-5", "contact_area_m2,,,,,240,99,0.001,1e-5"),
        ("mass_kg,,,,,20,0,12.5,0.05", "mass_kg,,,,1,20,0,12.5,0.05"),
        ("mass_kg,,,,,20,0,12.5,0.05", "mass_kg,,,axial,,20,0,12.5,0.05"),
    ],
)
def test_what_is_allowed_at_a_limit_and_refused_beyond(tmp_path: Path, good: str, bad: str) -> None:
    assert len(read(tmp_path, good)) == 1
    with pytest.raises(InputError, match="line 2"):
        read(tmp_path, bad)


def test_ten_thousand_lines_are_read_and_no_more(tmp_path: Path) -> None:
    """The headings are one of them."""
    lines = [f"frequency_Hz,2,0,,,{20 + 0.1 * i:.1f},0,79.5,0.2" for i in range(10_000)]
    assert len(read(tmp_path, *lines[1:])) == 9_999
    with pytest.raises(InputError, match="more than 10000 lines"):
        read(tmp_path, *lines)


def test_pairs_and_single_values_of_another_load_or_pressure_do_not_meet(tmp_path: Path) -> None:
    line = "frequency_Hz,2,0,,{},{},{},79.5,0.2"
    apart = [line.format(1, 240, 0), line.format("", 250, 0), line.format("symmetric", 250, 100)]
    assert len(read(tmp_path, *apart)) == 3
    for member in ("2", ""):  # whichever comes first
        with pytest.raises(InputError, match="line 3: gives a pair a member"):
            read(tmp_path, line.format(member, 240, 0), line.format("" if member else 2, 240, 0))


def test_what_is_left_empty_is_none(tmp_path: Path) -> None:
    """An empty load is 0, and so is the mass' pressure; an empty label is none."""
    mode, mass = read(tmp_path, "frequency_Hz,2,0,,,240,,79.5,0.2", "mass_kg,,,,,,,12.5,0.05")
    assert (mode.pressure_kPa, mode.load_N, mode.value, mode.sigma) == (240.0, 0.0, 79.5, 0.2)
    assert (mass.pressure_kPa, mass.load_N, mass.label) == (0.0, 0.0, None)


def test_every_mistake_is_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, "frequency_Hz,2,0,,,240,0,-1,0.2", GOOD, "area,,,,,240,0,1,1")
    assert [line.split(":")[0][-6:] for line in str(caught.value).splitlines()] == [
        "line 2",
        "line 4",
    ]


@pytest.mark.parametrize("header", ["c,m,kind\n", HEADER.replace("sigma", "std"), ""])
def test_wrong_columns(tmp_path: Path, header: str) -> None:
    with pytest.raises(InputError, match=r"columns must be .* measured import"):
        read(tmp_path, GOOD, header=header)


def test_the_order_of_columns_is_free(tmp_path: Path) -> None:
    swapped = "value,sigma,quantity,c,m,kind,member,pressure_kPa,load_N\n"
    (one,) = read(tmp_path, "79.5,0.2,frequency_Hz,2,0,,,240,0", header=swapped)
    (other,) = read(tmp_path, GOOD)
    assert one == other


RIMS = HEADER.replace("sigma\n", "sigma,rim\n")
LABORATORY = "label,frequency_Hz,sigma_Hz,pressure_kPa,load_N,rim\n"


def test_a_value_carries_its_state(tmp_path: Path) -> None:
    """Pressure, load, and rim: as the case has it without a column, fixed where its cell is empty;
    as another laboratory writes it, too."""
    (plain,) = read(tmp_path, GOOD)
    assert plain.state == TyreState(240.0, 0.0, None)
    states = {"": "fixed", "fixed": "fixed", "Free": "free", "springs": "springs", "case": None}
    lines = [f"frequency_Hz,2,0,,,{200 + k},0,79.5,0.2,{x}" for k, x in enumerate(states)]
    rows = read(tmp_path, *lines, header=RIMS)
    assert [each.rim for each in rows] == list(states.values())
    lines = [
        '"[2,0]",79.5,0.2,240,,free',
        '"[2,0]",79.1,0.2,240,0,',
        '"[0,0] lateral",31.7,0.2,160,0,case',
    ]
    one, other, third = read(tmp_path, *lines, header=LABORATORY)
    assert (one.label, one.state, one.sigma) == (plain.label, TyreState(240.0, 0.0, "free"), 0.2)
    assert other.state == TyreState(240.0, 0.0, "fixed") and third.state == TyreState(160.0)
    (mass,) = read(tmp_path, "mass_kg,,,,,,,12.5,0.05,free", header=RIMS)
    assert mass.state == TyreState()
    written = measurements_csv([*rows, one, mass])
    again = read(tmp_path, *written.splitlines()[1:], header=RIMS)
    assert [(r.key, r.value) for r in again] == [(r.key, r.value) for r in [*rows, one, mass]]
    assert "rim" not in measurements_csv([plain])


@pytest.mark.parametrize(
    ("header", "line", "words"),
    [
        (RIMS, "frequency_Hz,2,0,,,240,0,79.5,0.2,loose", "rim is 'loose', must be one of fixed,"),
        (
            RIMS,
            "contact_area_m2,,,,,240,4000,0.02,1e-3,free",
            "rim is free, must be fixed or empty",
        ),
        (RIMS, "frequency_Hz,2,0,,,240,0,80.5,0.2,fixed", "measures the same as line 2"),
        (LABORATORY, '"[2,0]",79.5,,240,0,free', "sigma is ''"),
    ],
)
def test_a_wrong_state_is_named(tmp_path: Path, header: str, line: str, words: str) -> None:
    good = GOOD + "," if header == RIMS else '"[2,0]",79.1,0.2,240,0,'
    with pytest.raises(InputError) as caught:
        read(tmp_path, good, line, header=header)
    assert "line 3" in str(caught.value) and words in str(caught.value)


def test_columns_of_another_table_are_all_known(tmp_path: Path) -> None:
    for header in (
        LABORATORY.replace("load_N", "laod_N"),
        LABORATORY.replace("sigma_Hz", "remark"),
        RIMS.replace("rim", "frequency_Hz"),
    ):
        with pytest.raises(InputError, match=r"line 1: the columns must be .* measured import"):
            read(tmp_path, GOOD, header=header)


def test_a_rim_is_told_where_it_is_not_the_cases(tmp_path: Path) -> None:
    """A rim that the case cannot have is refused, line by line."""
    case = load_case(CASES / "p235_75r17.yaml")
    lines = [f"frequency_Hz,{c},0,,,240,0,79.5,0.2,{rim}" for c, rim in ((2, "fixed"), (3, "free"))]
    rows = [*read(tmp_path, *lines, header=RIMS), *read(tmp_path, GOOD)]
    free = with_values(case, {"rim.free": True})
    assert [each.rim for each in in_states(case, rows)] == [None, "free", None]
    assert [each.rim for each in in_states(free, rows)] == ["fixed", None, None]
    with pytest.raises(InputError, match="line 3: the rim has no springs in this case"):
        in_states(case, [rows[0], replace(rows[1], rim="springs")])
