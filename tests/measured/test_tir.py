"""Tyre property files and TYDEX files as programs write them: formulas, columns, units."""

from __future__ import annotations

from math import isnan
from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.gather import gather
from tyrecal.measured.mf_swift import MFSwift
from tyrecal.measured.tir import property_measurements, read_property_file
from tyrecal.measured.tydex import read_tydex, tydex_measurements
from tyrecal.simulate.modes.label import Label

# keys of a public 205/60R15 91V set, in the grammar of one program
PUBLIC = """[MDI_HEADER]
FILE_TYPE = 'tir'
FILE_VERSION = 3.0
(COMMENTS)
{comment_string}
'205/60R15 = 91V [not a section]'
[UNITS]
LENGTH = 'meter'
FORCE = 'newton'
ANGLE = 'radians'
MASS = 'kg'
TIME = 'second'
[MODEL]
FITTYP = 61          $ version
LONGVL = 16.7
[DIMENSION]
UNLOADED_RADIUS = 0.3135
WIDTH = 0.205
[OPERATING_CONDITIONS]
INFLPRES = 240000
NOMPRES = 220000
[INERTIA]
MASS = 9.3
BELT_MASS = 7.247
BELT_IXX = 0.3519
BELT_IYY = 0.5698
[VERTICAL]
FNOMIN = 4000
VERTICAL_STIFFNESS = 209651
Q_RE0 = 0.9974
Q_FZ2 = 15.4
PFZ1 = 0.7098
BREFF = 8.386
DREFF = 0.25826
FREFF = 0.07394
[STRUCTURAL]
LONGITUDINAL_STIFFNESS = 358066
LATERAL_STIFFNESS = 102673
YAW_STIFFNESS = 4793
FREQ_LONG = 77.17
FREQ_LAT = 42.41
FREQ_YAW = 53.49
FREQ_WINDUP = 58.95
DAMP_LONG = 0.056
DAMP_LAT = 0.037
DAMP_YAW = 0.007
DAMP_WINDUP = 0.05
PCFX1 = 0.27504
PCFY1 = 0.16365
PCFY3 = 0.24993
[CONTACT_PATCH]
Q_RA1 = 0.671
Q_RA2 = 0.733
Q_RB1 = 1.059
Q_RB2 = -1.1878
"""


def written(folder: Path, text: str, name: str = "tyre.tir") -> Path:
    path = folder / name
    path.write_bytes(text.encode("latin-1"))
    return path


def public(folder: Path) -> MFSwift:
    return read_property_file(written(folder, PUBLIC)).model


@pytest.mark.parametrize(
    ("dp", "load", "values"),
    [
        (-0.1, 4000, (21.76, 196.5, 137.8, 143.1, 0.3035, 358.1, 100.1)),
        (0, 2000, (10.48, 197.3, 87.4, 120.7, 0.3054, 308.8, 94.3)),
        (0, 4000, (20.31, 209.7, 131.8, 141.1, 0.3041, 358.1, 102.7)),
        (0, 6000, (29.59, 221.3, 169.1, 151.0, 0.3032, 407.3, 111.1)),
        (0.1, 4000, (19.04, 222.8, 126.4, 139.3, 0.3047, 358.1, 105.2)),
    ],
)
def test_curves_of_the_public_set(
    tmp_path: Path, dp: float, load: float, values: tuple[float, ...]
) -> None:
    """To the four digits that its makers print."""
    tyre = public(tmp_path)
    ours = (
        1e3 * tyre.deflection(load, dp),
        1e-3 * tyre.vertical(load, dp),
        1e3 * tyre.patch_length(load, dp),
        1e3 * tyre.patch_width(load, dp),
        tyre.rolling_radius(load, dp),
        1e-3 * tyre.longitudinal(load, dp),
        1e-3 * tyre.lateral(load, dp),
    )
    assert ours == pytest.approx(values, rel=5e-4)
    assert tyre.load(tyre.deflection(load, dp), dp) == pytest.approx(load, rel=1e-12)


def test_springs_of_the_public_set(tmp_path: Path) -> None:
    tyre = public(tmp_path)
    assert tyre.springs() == pytest.approx(
        {"x": 1.7038e6, "y": 5.1458e5, "yaw": 3.9749e4, "windup": 7.8172e4}, rel=5e-5
    )
    left = {"x": 8.99e5, "y": 1.77e5, "z": 2.39e5, "yaw": 5450}
    assert tyre.residual_springs() == pytest.approx(left, rel=1e-3)


def test_measurements(tmp_path: Path) -> None:
    """Frequencies with damping, stiffness and patch at three loads and the mass, at NOMPRES."""
    rows, (note,) = property_measurements(written(tmp_path, PUBLIC))
    by_label = {row.label: row for row in rows if row.label}
    assert by_label[Label(1, 0)].value == 77.17 and by_label[Label(1, 0)].damping_ratio == 0.056
    assert by_label[Label(0, 0, "torsional")].value == 58.95
    assert {row.pressure_kPa for row in rows if row.quantity != "mass_kg"} == {220}
    on_road = {(row.quantity, row.load_N): row.value for row in rows if row.load_N}
    assert len(on_road) == 9
    stiffness, length = "vertical_stiffness_N_per_m", "contact_length_m"
    assert on_road[stiffness, 6000] == pytest.approx(221.3e3, rel=3e-4)
    assert on_road[length, 2000] == pytest.approx(0.0874, rel=3e-4)
    assert "LATERAL_STIFFNESS 102673" in note
    assert [row.value for row in rows if row.quantity == "mass_kg"] == [9.3]
    gathered = gather([tmp_path / "tyre.tir"], assumed=0.01)
    assert len(gathered.rows) == 14 and all(row.sigma > 0 for row in gathered.rows)


def in_other_words(text: str) -> str:
    """The same tyre by a program with mm, kN and bar, CRLF, !, capitals turned, and another
    order."""
    sections = [f"[{part}" for part in text.split("\n[")[1:]]
    head = "! exported\n\n[units]\nlength='MM'\nFORCE = 'kN' ! of wheels\nMASS = 'gram'\n"
    head += "ANGLE='Radian'\nPRESSURE = 'bar'\ntime=\n"
    scale = {
        **dict.fromkeys(("UNLOADED_RADIUS", "WIDTH", "MASS", "BELT_MASS", "LONGVL"), 1e3),
        **dict.fromkeys(("NOMPRES", "INFLPRES"), 1e-5),
        **dict.fromkeys(("BELT_IXX", "BELT_IYY"), 1e9),
        **dict.fromkeys(("VERTICAL_STIFFNESS", "LONGITUDINAL_STIFFNESS"), 1e-6),
        **{"LATERAL_STIFFNESS": 1e-6, "FNOMIN": 1e-3},
    }
    lines = [head.rstrip()]
    for section in reversed(sections):
        if section.startswith("[UNITS"):
            continue
        for line in section.splitlines():
            key, equals, value = line.partition("=")
            if equals and key.strip() in scale:
                number = float(value.split("$")[0]) * scale[key.strip()]
                line = f"  {key.strip().lower()}={number:.9e} $ {value}"
            lines.append(line)
    lines += ["[SHAPE]", "{radial width}", " 1.0 0.0", "[VENDOR]", "NOMPRES = 2.2", "EMPTY ="]
    return "\r\n".join(lines)


def test_another_programs_file_is_the_same_tyre(tmp_path: Path) -> None:
    text = in_other_words(PUBLIC).replace("YAW_STIFFNESS = 4793", "YAW_STIFFNESS = 4.793e+003")
    other = read_property_file(written(tmp_path, text, "other.tir")).model.keys
    # kN mm per rad is N m per rad
    assert other == pytest.approx({**public(tmp_path).keys, "YAW_STIFFNESS": 4793}, rel=1e-8)


def test_version_5_2(tmp_path: Path) -> None:
    """Without [STRUCTURAL]: a linear stiffness and a patch over the root of the load."""
    text = (
        "[MODEL]\nPROPERTY_FILE_FORMAT = 'MF_05'\n[DIMENSION]\nUNLOADED_RADIUS = 0.3\n[VERTICAL]\n"
        "FNOMIN = 4000\nVERTICAL_STIFFNESS = 2.1e5\n[CONTACT_PATCH]\nQ_A1 = 0.15\nQ_A2 = 0.07\n"
    )
    path = written(tmp_path, text)
    with pytest.raises(InputError, match="no NOMPRES or INFLPRES; give --pressure-kPa"):
        property_measurements(path)
    rows, _ = property_measurements(path, 200.0)
    assert [row.value for row in rows[:3]] == pytest.approx([2.1e5] * 3)
    assert rows[4].value == pytest.approx(2 * 0.3 * 0.22) and rows[4].load_N == 4000


def test_defaults_of_a_template_are_left_out(tmp_path: Path) -> None:
    text = PUBLIC
    for old, new in {"77.17": "80", "42.41": "40", "53.49": "50", "58.95": "70"}.items():
        text = text.replace(old, new)
    rows, notes = property_measurements(written(tmp_path, text))
    assert not [row for row in rows if row.quantity == "frequency_Hz"]
    assert "left out FREQ_LONG, FREQ_LAT, FREQ_YAW, FREQ_WINDUP: they are the defaults" in notes[0]
    text = PUBLIC.replace("= 0.056", "= 0.04").replace("= 0.037", "= 0.04")
    text = text.replace("= 0.007", "= 0.04").replace("= 0.05\n", "= 0.04\n")
    rows, notes = property_measurements(written(tmp_path, text))
    assert all(isnan(row.damping_ratio) for row in rows) and "DAMP_LONG" in notes[0]


def test_what_lacks_a_key_or_is_replaced_is_left_out(tmp_path: Path) -> None:
    """The other quantities stay; a unit's word in another section is no number."""
    text = PUBLIC.replace("WIDTH = 0.205", "MASS = 'kg'")
    rows, notes = property_measurements(written(tmp_path, text))
    assert {row.quantity for row in rows if row.load_N} == {
        "vertical_stiffness_N_per_m",
        "contact_length_m",
    }
    assert [row.value for row in rows if row.quantity == "mass_kg"] == [9.3]
    assert "Q_RB1: left out, as it needs WIDTH too" in notes[0]
    rows, notes = property_measurements(written(tmp_path, PUBLIC + "[DEFLECTION_LOAD_CURVE]\n"))
    assert not [row for row in rows if row.load_N]
    assert "[DEFLECTION_LOAD_CURVE] replaces it" in notes[0]


def test_stiffness_of_a_curve_of_load_over_deflection(tmp_path: Path) -> None:
    """The slope at the loads that the curve reaches, in the file's units, in place of
    VERTICAL_STIFFNESS; d = F / k (1 - F / F0) is a cubic spline's own."""
    k, F0 = 2e5, 4e4
    loads = [0.0, 1000.0, 2500.0, 4000.0, 5000.0]
    rows = "".join(f"{1e3 * F / k * (1 - F / F0):.9f}  {F} $ row\n" for F in loads)
    text = PUBLIC.replace("'meter'", "'mm'").replace("= 0.3135", "= 313.5")
    text += "[DEFLECTION_LOAD_CURVE]\n{pen   fz}\n" + rows + "[BOTTOMING_CURVE]\n{pen fz}\n0 0\n"
    measured, _ = property_measurements(written(tmp_path, text.replace("= 220000", "= 0.22")))
    slopes = {row.load_N: row.value for row in measured if row.quantity.startswith("vertical")}
    assert slopes == pytest.approx({F: k / (1 - 2 * F / F0) for F in (2000.0, 4000.0)}, rel=1e-6)


def test_a_word_in_place_of_a_number_is_as_if_the_key_were_absent(tmp_path: Path) -> None:
    """A program wrote the unit of mass as its number; Q_RE0 is 0 where the radius was not fitted,
    and no measurement needs it."""
    text = PUBLIC.replace("MASS = 9.3", "MASS = kg").replace("Q_RE0 = 0.9974", "Q_RE0 = 0")
    rows, _ = property_measurements(written(tmp_path, text))
    assert len(rows) == 13 and "mass_kg" not in {row.quantity for row in rows}
    rows, notes = property_measurements(
        written(tmp_path, PUBLIC.replace("FNOMIN = 4000", "FNOMIN = none"))
    )
    assert len(rows) == 5 and "VERTICAL_STIFFNESS: left out, as it needs FNOMIN too" in notes[0]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "[CONTACT_PATCH]",
            "[DEFLECTION_LOAD_CURVE]\n0 0\n0.01 2000\n0.02 1900\n0.03 4000\n[CONTACT_PATCH]",
            r"\[DEFLECTION_LOAD_CURVE\] must have 4 rows or more, rising in both columns",
        ),
        ("[CONTACT_PATCH]", "[DEFLECTION_LOAD_CURVE]\n0 0 1\n1 2\n", r"rows of two numbers"),
        ("Q_FZ2 = 15.4", "Q_FZ2 = 1.5.4", r"tyre.tir, line 31: Q_FZ2 is '1.5.4', must be a number"),
        ("Q_FZ2 = 15.4", "Q_FZ2 = 154", r"Q_FZ2 is 154, must be at most 67.49"),
        ("FNOMIN = 4000", "FNOMIN = 0", r"tyre.tir, line 28: FNOMIN is 0, must be greater than 0"),
        (
            "DAMP_LONG = 0.056",
            "DAMP_LONG = 5.6",
            r"line \d+: DAMP_LONG is 5.6: usual is 0.0001 to 0.5",
        ),
        ("DAMP_LONG = 0.056", "DAMP_LONG = -0.056", r"line \d+: DAMP_LONG is -0.056: usual is"),
        ("'newton'", "'stone'", r"FORCE in \[UNITS\] is 'stone', must be one of n, kn"),
        ("MASS = 9.3", "MASS = 9.3\nMASS = 9.4", r"line 24: MASS is 9.4, and 9.3 in line 23"),
        ("NOMPRES = 220000", "NOMPRES = 2.2", r"NOMPRES is 0.0022 kPa: usual is 20 to 2000 kPa"),
        ("FREQ_LAT = 42.41", "FREQ_LAT = 42410", r"FREQ_LAT: frequency_Hz is 42410: no tyre has"),
        (PUBLIC, "[UNITS]\nMASS = 'kg'\n[OPERATING_CONDITIONS]\nNOMPRES = 2e5\n", r"no key states"),
    ],
)
def test_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        gather([written(tmp_path, PUBLIC.replace(old, new))], assumed=0.01)


R0, LINEAR, SQUARE = 0.3135, 1.9e5, 5e5  # m, N/m, N/m²: load a d + b d² of a deflection d


def load_of(deflection: float) -> float:
    return LINEAR * deflection + SQUARE * deflection**2


def stiffness(load: float) -> float:
    """Slope at a load: the root of a² + 4 b F."""
    return float((LINEAR**2 + 4 * SQUARE * load) ** 0.5)


def constant(name: str, unit: str, value: str) -> str:
    return f"{name:<10}{'of the tyre':<30}{unit:<10}{value}"


def channel(name: str, unit: str, factor: float, *offsets: float) -> str:
    numbers = "".join(f"{x:10g}" for x in (factor, *offsets))
    return f"{name:<10}{'measured, with words':<30}{unit:<10}{numbers}"


DEFLECTIONS = [0.002 * k for k in range(1, 16)]


SI = [  # SI units, one line a record
    "**HEADER",
    "RELEASE   1.3",
    "MEASID    vertical",
    "**COMMENTS",
    "FNOMIN is not a constant here",
    "**CONSTANTS",
    constant("NOMPRES", "Pa", "250000"),
    constant("INFLPRES", "Pa", "220000"),
    constant("FNOMIN", "N", "4000"),
    constant("RFREE", "m", f"{R0}"),
    "**MEASURCHANNELS",
    "! name, words, unit, factor",
    channel("MEASNUMB", "-", 1, 0, 0),
    channel("TYREDEFW", "m", 1, 0, 0),
    channel("FZW", "N", 1, 0, 0),
    "**MEASURDATA",
    *(f"{k:10d}{d:10.6f}{load_of(d):10.3f}" for k, d in enumerate(DEFLECTIONS)),
    "**END",
]


WORKSHOP = [  # a height in mm that falls, a negative load in kN, bar, a factor, a gap
    "**HEADER",
    "RELEASE   1.3",
    "**CONSTANTS",
    constant("NOMPRES", "bar", "2.2"),
    "**MEASURCHANNELS",
    channel("DSTGRWHC", "mm", 0.1),
    channel("FZW", "kN", 1),
    channel("INCLANGL", "deg", 1),
    "**MEASURDATA  16",
    "  NOTAVAIL   1.0   0.0",
    *(f"{1e4 * (R0 - d):.3f} {-1e-3 * load_of(d):.7f} 0.0" for d in DEFLECTIONS),
    "**END",
]


NAMES = ["RUNTIME", "LONGVEL", "FX", "FYW", "MXW", "MYW", "MZW", "TRDTEMP", "INFLPRES"]


WRAPPED = [  # eleven channels in columns of 10, glued, eight to a line of 80 characters
    "**MEASURCHANNELS",
    channel("RUNTIME", "s", 1),
    *(channel(name, "km/h" if name == "LONGVEL" else "N", 1) for name in NAMES[1:8]),
    channel("INFLPRES", "kPa", 1),
    channel("FZH", "N", 1),
    channel("TYREDEFW", "mm", 1),
    "**MEASURDATA",
    *(
        line
        for k, d in enumerate(DEFLECTIONS)
        for line in (
            f"{k:10d}{20:10.2f}" + "-12345.678" * 6,
            f"{220 + 0.1 * (k % 3):10.2f}{load_of(d):10.3f}{1e3 * d:10.3f}",
        )
    ),
    "**END",
]


def written_tydex(folder: Path, lines: list[str]) -> Path:
    path = folder / "vertical.tdx"
    path.write_bytes("\r\n".join(lines).encode("latin-1"))
    return path


def test_si(tmp_path: Path) -> None:
    """Tangents at half, once and one and a half times FNOMIN, at the measured pressure."""
    assert all(len(line) <= 80 for line in SI)
    rows, (note,) = tydex_measurements(written_tydex(tmp_path, SI))
    assert [row.load_N for row in rows] == [2000, 4000, 6000]
    assert [row.value for row in rows] == pytest.approx(
        [stiffness(row.load_N) for row in rows], rel=1e-5
    )
    assert {row.pressure_kPa for row in rows} == {220}
    assert "free radius 313.5 mm" in note


def test_workshop_units(tmp_path: Path) -> None:
    """Without FNOMIN at parts of the largest load; the nominal pressure is noted."""
    path = written_tydex(tmp_path, WORKSHOP)
    gathered = gather([path], assumed=0.01)
    whole = load_of(DEFLECTIONS[-1])
    values = {row.load_N: row.value for row in gathered.rows}
    assert [*values] == pytest.approx([0.25 * whole, 0.5 * whole, 0.75 * whole])
    assert [*values.values()] == pytest.approx([stiffness(load) for load in values], rel=1e-5)
    assert any("taken as measured at NOMPRES, 220 kPa" in note for note in gathered.notes)
    assert gathered.rows[0].sigma == pytest.approx(0.01 * gathered.rows[0].value)


def test_records_of_several_lines(tmp_path: Path) -> None:
    path = written_tydex(tmp_path, WRAPPED)
    assert read_tydex(path).records.shape == (15, 11)
    rows, (note,) = tydex_measurements(path)
    assert [row.value for row in rows] == pytest.approx(
        [stiffness(row.load_N) for row in rows], rel=1e-5
    )
    assert rows[0].pressure_kPa == pytest.approx(220.1) and "rolled (LONGVEL)" in note


@pytest.mark.parametrize(
    ("lines", "old", "new", "words"),
    [
        (SI, channel("FZW", "N", 1, 0, 0), channel("FZW", "N", 1, 5, 0), "FZW has an offset"),
        (SI, channel("FZW", "N", 1, 0, 0), channel("FZW", "t", 1, 0, 0), "unit of FZW is 't'"),
        (SI, channel("FZW", "N", 1, 0, 0), channel("FZX", "N", 1, 0, 0), "no channel FZW or FZH"),
        (SI, channel("FZW", "N", 1, 0, 0), channel("FZW", "N", 0, 0, 0), "from 0 to 0 N; a curve"),
        (
            SI,
            channel("TYREDEFW", "m", 1, 0, 0),
            channel("TYREDEFW", "m", 0, 0, 0),
            "all values of TYREDEFW are 0 m",
        ),
        (SI, constant("RFREE", "m", f"{R0}"), constant("RFREE", "m", "x"), "RFREE is 'x'"),
        (SI, SI[-2], SI[-2][:20], "14 complete lines of data; it is cut off"),
        (SI, SI[-2], f"{SI[-2]} 3.0", r"line 31: 4 numbers, the channels are 3"),
        (SI, SI[-2], SI[-2][:-9] + " 4O00.000", "line 31: '4O00.000' is not a number"),
        (WORKSHOP, WORKSHOP[8], "**MEASURDATA 99", "16 complete lines of data, the file states 99"),
        (WORKSHOP, WORKSHOP[-2], f"{WORKSHOP[-2][:-3]}2.0", "INCLANGL goes to 2 degrees"),
        (WORKSHOP, WORKSHOP[3], "", "no INFLPRES or NOMPRES; give --pressure-kPa"),
        (WRAPPED, WRAPPED[-2], f"{250:10d}{WRAPPED[-2][10:]}", "INFLPRES goes from 220 to 250"),
    ],
)
def test_refused_tydex(tmp_path: Path, lines: list[str], old: str, new: str, words: str) -> None:
    path = written_tydex(tmp_path, [new if line == old else line for line in lines])
    with pytest.raises(InputError, match=words):
        gather([path], assumed=0.01)
