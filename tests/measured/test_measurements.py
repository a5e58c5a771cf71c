"""The measurements CSV: what it may hold, every mistake by its line.

Names of modes mean one label, or are refused.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.measurement import measurements_csv
from tyrecal.measured.mode_names import label_parts
from tyrecal.measured.tables import read_measurements, read_table
from tyrecal.measured.targets import in_states
from tyrecal.simulate.modes.label import Label
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
    """An empty load is 0, and so is the mass' pressure, given or not; an empty label is none."""
    mode, mass = read(tmp_path, "frequency_Hz,2,0,,,240,,79.5,0.2", "mass_kg,,,,,240,,12.5,0.05")
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
    pressed = replace(rows[0], quantity="vertical_stiffness_N_per_m", label=None, load_N=4000.0)
    for rim in ("fixed", "free", None):  # whichever is stated, it is computed on a clamped rim
        assert in_states(free, [replace(pressed, rim=rim)])[0].rim is None
    with pytest.raises(InputError, match="line 3: the rim has no springs in this case"):
        in_states(case, [rows[0], replace(rows[1], rim="springs")])


NAMES = {
    "[0,0] axial": [
        "lateral translation",
        "axial mode",
        "Lateralschwingung",
        "axiale Mode",
        "mode axial",
        "modo laterale",
        "0,0 lateral",
        "[0,0]_lateral",
        "laterale Eigenform",
        *("lateral", "Lateral mode", "LATERAL", "axial", "L0", "[0,0] lateral", "[0;0] axial"),
        *("Lateralmode", "laterale", "Mode latéral", "modo lateral", "(0,0) lateral", "Axialmode"),
    ],
    "[0,0] torsional": [
        "Drehschwingung",
        "Torsionsschwingung",
        "mode torsionnel",
        "modo torsionale",
        "modo torsional",
        "modo di torsione",
        "torsional mode",
        "wind up",
        "Rotation",
        *("torsional", "Torsion", "Torsionsmode", "torsione", "torsión", "T0", "[0,0] torsional"),
        *("rotational", "wind-up", "mode de torsion", "torsionale", "0/0 torsion", "Torsion mode"),
    ],
    "[1,0]": [
        "vertical mode",
        "Vertikalschwingung",
        "mode vertical",
        "modo verticale",
        "modo vertical",
        "Hubschwingung",
        "fore aft",
        "longitudinal mode",
        "c1m0",
        *("vertical", "Vertikalmode", "verticale", "fore-aft", "vertical / fore-aft", "R1"),
        *("[1,0] vertical / fore-aft", "longitudinal", "[1,0]x2", "[1,0] x2", "1,0", "c=1, m=0"),
    ],
    "[1,1]": [
        "camber mode",
        "Sturzmode",
        "Giermode",
        "mode de lacet",
        "modo di imbardata",
        *("yaw-camber", "pitch / yaw-camber", "L1", "camber", "Sturz", "[1,1] x2", "carrossage"),
        *("campanatura", "guiñada", "yaw", "imbardata", "lacet"),
    ],
    "[2,0]": [
        "oval",
        "modo di ovalizzazione",
        "in-plane bending 1",
        "1. in-plane bending",
        "1st in plane bending",
        "in-plane bending mode 1",
        "first bending in plane",
        "Ovalisation",
        "(2,0)",
        *("ovalisation", "ovalization", "Ovalisierung", "ovalizzazione", "ovalización", "R2"),
        *("1st in-plane bending", "first in plane bending mode", "1. Biegung in der Ebene"),
        *("1er mode de flexion dans le plan", "prima flessione nel piano", "c2m0"),
        *("primera flexión en el plano", "1st bending (in-plane)", "erste Biegung in der Ebene"),
    ],
    "[2,1]": [
        "1. out-of-plane bending",
        "first out of plane bending mode",
        "1st bending out of plane",
        "1. Biegemode aus der Ebene",
        "[2,1] (x2)",
        "2,1 x2",
        *("[2,1]", "[2,1]x2", "[2,1] ×2", "2/1", "2 1", "first out-of-plane bending", "L2"),
        *("1. Biegung aus der Ebene", "1re flexion hors plan", "prima flessione fuori piano"),
        *("primera flexión fuera del plano", "1st out of plane bending"),
    ],
    "[3,0]": [
        "second in plane bending",
        "2. Biegung in der Ebene",
        "2e mode de flexion dans le plan",
        "seconda flessione nel piano",
        "segunda flexión en el plano",
        "second in-plane bending",
        "2nd in-plane bending",
        "R3",
        "2. Biegemode in der Ebene",
    ],
    "[3,1]": [
        "second out of plane bending",
        "2. Biegung aus der Ebene",
        "seconda flessione fuori dal piano",
        "second out-of-plane bending",
        "2ème flexion hors du plan",
        "L3",
    ],
    "[4,0]": [
        "third in-plane bending",
        "3rd in-plane bending",
        "3. Biegung in der Ebene",
        "R4",
        "terza flessione nel piano",
        "[4;0]",
    ],
    "[5,1]": ["fourth out-of-plane bending", "4th out-of-plane bending"],
}
NO_NAMES = [
    *("radial", "bending", "1st bending", "first", "overtone", "belt bends across its width"),
    *("in-plane bending", "R0", "B1", "7", "2nd lateral", "cavity", "rim mode", "lateral vertical"),
    *("first in-plane", "pitch", "0th in-plane bending", "1st in-plane bending 2", "", "[2]", "?"),
    *("1st 2nd in-plane bending", "torsional 2", "out of plane", "structure"),
]


@pytest.mark.parametrize("label", NAMES)
def test_a_name_has_one_label(label: str) -> None:
    wanted = label_parts(label, {})
    assert wanted
    for name in NAMES[label]:
        parts = label_parts(name, {})
        assert parts, name
        kind = parts[2].replace("lateral", "axial").replace("torsion", "torsional")
        assert (*parts[:2], kind.replace("torsionalal", "torsional")) == wanted, name


@pytest.mark.parametrize("name", NO_NAMES)
def test_a_name_with_no_or_several_labels_is_refused(name: str) -> None:
    assert label_parts(name, {}) is None


def test_all_names_that_tyrecal_prints() -> None:
    labels = [Label(0, 0, "axial"), Label(0, 0, "torsional")]
    labels += [Label(c, m) for c in range(1, 10) for m in (0, 1)]
    for label in labels:
        for name in (
            str(label),
            label.display,
            label.motion,
            f"{label}x2",
            f"{label} {label.motion}",
        ):
            c, m, kind = label_parts(name, {}) or ("", "", "")
            assert (int(c), int(m)) == (label.c, label.m), name
            assert kind.replace("lateral", "axial") == (label.kind or ""), name


def test_the_settings_file_adds_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "t.csv"
    path.write_text("mode,f [Hz],p [kPa]\nBiege 4a,66.1,240\n")
    with pytest.raises(InputError, match=r"line 2: label is 'Biege 4a', must .* mode_names"):
        read_table(path)
    (tmp_path / "settings.yaml").write_text('mode_names: {biege 4A: "[2,1]"}\n')
    monkeypatch.setenv("TYRECAL_SETTINGS", str(tmp_path / "settings.yaml"))
    assert read_table(path)[0].label == Label(2, 1)
