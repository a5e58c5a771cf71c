"""TYDEX files, written after the format's description: columns, units, factors, gaps."""

from __future__ import annotations

from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.measured.gather import gather
from tyrecal.measured.tydex import read_tydex, tydex_measurements

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


def written(folder: Path, lines: list[str]) -> Path:
    path = folder / "vertical.tdx"
    path.write_bytes("\r\n".join(lines).encode("latin-1"))
    return path


def test_si(tmp_path: Path) -> None:
    """Tangents at half, once and one and a half times FNOMIN, at the measured pressure."""
    assert all(len(line) <= 80 for line in SI)
    rows, (note,) = tydex_measurements(written(tmp_path, SI))
    assert [row.load_N for row in rows] == [2000, 4000, 6000]
    assert [row.value for row in rows] == pytest.approx(
        [stiffness(row.load_N) for row in rows], rel=1e-5
    )
    assert {row.pressure_kPa for row in rows} == {220}
    assert "free radius 313.5 mm" in note


def test_workshop_units(tmp_path: Path) -> None:
    """Without FNOMIN at parts of the largest load; the nominal pressure is noted."""
    path = written(tmp_path, WORKSHOP)
    gathered = gather([path], assumed=0.01)
    whole = load_of(DEFLECTIONS[-1])
    values = {row.load_N: row.value for row in gathered.rows}
    assert [*values] == pytest.approx([0.25 * whole, 0.5 * whole, 0.75 * whole])
    assert [*values.values()] == pytest.approx([stiffness(load) for load in values], rel=1e-5)
    assert any("taken as measured at NOMPRES, 220 kPa" in note for note in gathered.notes)
    assert gathered.rows[0].sigma == pytest.approx(0.01 * gathered.rows[0].value)


def test_records_of_several_lines(tmp_path: Path) -> None:
    path = written(tmp_path, WRAPPED)
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
def test_refused(tmp_path: Path, lines: list[str], old: str, new: str, words: str) -> None:
    path = written(tmp_path, [new if line == old else line for line in lines])
    with pytest.raises(InputError, match=words):
        gather([path], assumed=0.01)
