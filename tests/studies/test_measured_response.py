"""Measured response functions at the points of a computed one, and how well they agree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured.universal_text import WrittenFunction, function_set, universal_text
from tyrecal.studies.measured_response import agreement, points_of, read_measured_responses
from tyrecal.studies.response import FrfResult, ResponseFunctionEntry
from tyrecal.studies.response_points import TREAD_SYSTEM

Array = np.ndarray
HERTZ = np.linspace(0.0, 100.0, 51)
OMEGA = 2 * np.pi * HERTZ
RECEPTANCE = 1 / (4e3 * (2 * np.pi) ** 2 * (1 + 0.1j) - OMEGA**2)
FORCE = 4e3 * (2 * np.pi) ** 2 * RECEPTANCE
PLACES = {1: (0, 0.05, 0), 7: (0, 0, -0.3), 8: (-0.3, 0.02, 0.0), 9: (0.3, 0, 0), 10: (0.3, 0.1, 0)}
HEADER = "excite,respond,quantity,frequency_Hz,real,imag\n"


def written(path: Path, *functions: WrittenFunction, in_system: tuple[int, ...] = (7, 8)) -> Path:
    """A universal file; nodes 7 and 8 move along r, theta and the axle, 9 along x, y and z."""
    nodes = {number: [*map(float, place)] for number, place in PLACES.items()}
    sets = [function_set("tyre", each, HERTZ) for each in functions]
    path.write_text(universal_text("tyre", nodes, sets, TREAD_SYSTEM, in_system))
    return path


def motion(
    node: int, way: int, values: Array = RECEPTANCE, form: str = "displacement", to: int = 7
):
    return WrittenFunction("f", (node, way), (to, 1), form, values)


def test_nodes_and_directions_become_points_of_the_tyre(tmp_path: Path) -> None:
    """Whatever system a node moves in; hub directions 4 to 6 are moments, a force backwards along
    an axis has the other sign. Lines at 0 and outside the band are left out."""
    path = written(
        tmp_path / "m.uff",
        motion(7, 1),
        motion(8, 3),
        motion(9, 1),
        motion(9, 3),
        motion(1, 3, FORCE, "force"),
        motion(1, 4, FORCE, "moment"),
    )
    functions = read_measured_responses(path, "receptance", 0.0, 80.0)
    assert {str(each.excite) for each in functions} == {"tread:0deg:radial"}
    assert [str(each.respond) for each in functions] == [
        "tread:0deg:radial",
        "tread:90deg:lateral",
        "tread:270deg:radial",
        "tread:270deg:tangential",
        "hub:fz",
        "hub:mx",
    ]
    assert functions[0].frequency_Hz == pytest.approx(HERTZ[1:41])
    # before the hub the wheel's turn forward moves the tread down
    signs = [1, 1, 1, -1]
    for each, sign in zip(functions, signs, strict=False):
        np.testing.assert_allclose(each.values, sign * RECEPTANCE[1:41], rtol=1e-9)
    np.testing.assert_allclose(functions[4].values, FORCE[1:41], rtol=1e-9)
    places = points_of(functions)
    assert places["excite"] == "tread:0deg:radial" and places["respond"].endswith("hub:mx")
    (backwards,) = read_measured_responses(
        written(tmp_path / "b.uff", motion(7, -1)), "receptance", 0.0, 80.0
    )
    np.testing.assert_allclose(backwards.values, -RECEPTANCE[1:41], rtol=1e-9)


def test_an_accelerance_is_compared_as_a_receptance_and_back(tmp_path: Path) -> None:
    path = written(tmp_path / "m.uff", motion(7, 1, -(OMEGA**2) * RECEPTANCE, "acceleration"))
    (each,) = read_measured_responses(path, "receptance", 0.0, 100.0)
    np.testing.assert_allclose(each.as_form("receptance"), RECEPTANCE[1:], rtol=1e-9)
    np.testing.assert_allclose(each.as_form("accelerance"), each.values)


def test_a_table_has_the_columns_of_frf_csv(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    rows = [
        f"tread:0deg:radial,{respond},{quantity},{f:.3f},{v.real!r},{v.imag!r}"
        for respond, quantity in (("hub:fz", "blocked force"), ("tread:0deg:radial", "mobility"))
        for f, v in zip(HERTZ.tolist(), RECEPTANCE.tolist(), strict=True)
    ]
    path.write_text(HEADER + "\n".join(rows) + "\n")
    force, mobility = read_measured_responses(path, "receptance", 0.0, 100.0)
    assert (force.form, mobility.form) == ("blocked force", "mobility")
    np.testing.assert_allclose(force.values, RECEPTANCE[1:])
    np.testing.assert_allclose(mobility.as_form("receptance") * 1j * OMEGA[1:], RECEPTANCE[1:])


def test_a_column_of_units_counts(tmp_path: Path) -> None:
    """Receptances in mm/N are 1000 times as many as in m/N; a column is given once."""
    path = tmp_path / "m.csv"
    ends = "tread:0deg:radial,tread:0deg:radial,receptance"
    rows = "".join(f"{ends},{{}},{f:g},2,-1\n" for f in (10, 20))
    for unit, factor in (("mm/N", 1e-3), ("m/N", 1.0)):
        path.write_text(HEADER.replace("quantity", "quantity,unit") + rows.replace("{}", unit))
        (each,) = read_measured_responses(path, "receptance", 0.0, 100.0)
        np.testing.assert_allclose(each.values, factor * (2 - 1j))
    path.write_text(HEADER.replace("quantity", "quantity,unit") + rows.replace("{}", "in/lbf"))
    with pytest.raises(InputError, match="line 2: the unit 'in/lbf' is not one of m/N, mm/N"):
        read_measured_responses(path, "receptance", 0.0, 100.0)
    path.write_text(HEADER.replace("quantity", "real") + rows.replace("{},", ""))
    with pytest.raises(InputError, match="has the column real twice"):
        read_measured_responses(path, "receptance", 0.0, 100.0)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("tread:0deg:up,hub:fz,,10,1,0\n", "line 2: 'tread:0deg:up' is no point"),
        ("tread:0deg:radial,hub:fz,,10,1,x\n", "line 2: must be a number"),
        ("tread:0deg:radial,tread:0deg:radial,speed,10,1,0\n", "quantity is 'speed', must be one"),
        ("tread:0deg:radial,hub:fz,,10,1\n", "line 2: 5 cells, the headings are 6"),
        ("tread:0deg:radial,hub:fz,,10,1,0\n", "two frequencies or more"),
        (
            "".join(f"tread:0deg:radial,hub:fz,,{f},1,0\n" for f in (10, 12, 17)),
            "line 2: must have two frequencies or more from 0 to 300 Hz, evenly spaced",
        ),
        ("tread:0deg:radial,hub:fz,,10,1,0\ntread:0deg:radial,hub:fz,,9,1,0\n", "must rise"),
        ("", "there is no response function"),
    ],
)
def test_tables_that_are_refused(tmp_path: Path, rows: str, words: str) -> None:
    path = tmp_path / "m.csv"
    path.write_text(HEADER + rows)
    with pytest.raises(InputError, match=words):
        read_measured_responses(path, "receptance", 0.0, 300.0)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (motion(7, 1, FORCE, "force"), "tread:0deg:radial must be a motion"),
        (motion(7, 1, to=1), "the force must be on the tread, it is at hub:fx"),
        (motion(7, 4), "direction 4 of node 7 is along none of radial, tangential, lateral"),
        (motion(10, 1), "node 10 is 100 mm off the tyre's middle plane, y must be at most 30"),
        (motion(5, 1), "node 5, direction 1 has no place in the file"),
    ],
)
def test_functions_that_are_refused(tmp_path: Path, function: WrittenFunction, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_measured_responses(written(tmp_path / "m.uff", function), "receptance", 0.0, 100.0)


def test_a_motion_of_the_hub_is_that_of_a_wheel_that_moves(tmp_path: Path) -> None:
    path = written(tmp_path / "m.uff", motion(1, 3))
    (each,) = read_measured_responses(path, "receptance", 0.0, 100.0)
    assert str(each.respond) == "hub:z"


def test_a_file_that_is_empty_is_named(tmp_path: Path) -> None:
    (tmp_path / "m.csv").touch()
    with pytest.raises(InputError, match=r"m\.csv: the file is empty"):
        read_measured_responses(tmp_path / "m.csv", "receptance", 0.0, 100.0)


def test_what_is_there_twice_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "m.uff", motion(7, 1), motion(7, 1))
    with pytest.raises(InputError, match="tread:0deg:radial over tread:0deg:radial is in the file"):
        read_measured_responses(path, "receptance", 0.0, 100.0)


def test_frac_and_level_in_closed_form() -> None:
    """FRAC does not depend on a factor, which the level states; orthogonal functions have 0."""
    own = {"frac": 1.0, "level_dB": 20 * np.log10(2)}
    assert agreement(2j * RECEPTANCE, RECEPTANCE) == pytest.approx(own)
    assert agreement(np.array([1, 1]), np.array([1, -1]))["frac"] == 0.0
    assert agreement(np.array([1, 1]), np.array([1, 0]))["frac"] == pytest.approx(0.5)
    assert agreement(RECEPTANCE, 0 * RECEPTANCE) == {}


def test_a_compared_result_has_both_in_its_files(tmp_path: Path) -> None:
    path = written(tmp_path / "m.uff", motion(7, 1, 0.5 * RECEPTANCE))
    (each,) = read_measured_responses(path, "receptance", 0.0, 100.0)
    computed = RECEPTANCE[1:]
    entry = ResponseFunctionEntry(
        excite=str(each.excite),
        respond=str(each.respond),
        quantity="receptance",
        unit="m/N",
        **{"at_lowest": 1.0, "peak_Hz": 63.0, "peak": 1.0},
        real=computed.real.tolist(),
        imag=computed.imag.tolist(),
    )
    alone = {"at_lowest": 0.0, "respond": "hub:fz"}
    result = FrfResult(
        design="initial",
        **{"pressure_kPa": 240.0, "patch_mm": 20.0, "radius_m": 0.3, "harmonics": 9},
        frequency_Hz=each.frequency_Hz.tolist(),
        functions=[entry.compared(each), entry.model_copy(update=alone).compared(None)],
    )
    (table,) = result.tables()
    assert [column.name for column in table.columns][-2:] == ["FRAC", "measured/computed dB"]
    assert table.rows[0][-2:] == ["1.000", "-6.0"] and table.rows[1][-2:] == [None, None]
    lines = result.csv().splitlines()
    assert lines[0].endswith(",real,imag,measured_real,measured_imag")
    assert float(lines[1].split(",")[-2]) == pytest.approx(0.5 * computed.real[0])
    assert lines[-1].endswith(",,") and len(lines) == 1 + 2 * 50
    assert result.quantities()["frac tread:0deg:radial tread:0deg:radial"] == pytest.approx(1.0)
