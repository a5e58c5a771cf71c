"""Universal files: what is written comes back; what is cut off or wrong is refused by place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff

from tyrecal.errors import InputError
from tyrecal.measured.sensors import sensors_of
from tyrecal.measured.universal import is_universal, read_universal

from ..chance import generator

pytestmark = pytest.mark.numbers

NODES = np.arange(1, 9)
ANGLES = np.radians([7, 41, 88, 123, 169, 205, 251, 290])


def geometry(kind: int = 2411, scale: float = 1.0) -> dict[str, Any]:
    """Eight nodes on a tread, the axle along z."""
    one = np.ones(8, int)
    return {
        "type": kind,
        "node_nums": NODES,
        "def_cs": one,
        "disp_cs": one,
        "color": one,
        "x": scale * 0.39 * np.cos(ANGLES),
        "y": scale * 0.39 * np.sin(ANGLES),
        "z": scale * 0.06 * np.tile([1.0, -1.0], 4),
    }


def units(length: float = 1.0) -> dict[str, Any]:
    return {
        "type": 164,
        "units_code": 9,
        "length": length,
        "force": 1.0,
        "temp": 1.0,
        "temp_offset": 273.15,
    }


def shape(values: np.ndarray, hertz: float = 66.1, number: int = 1) -> dict[str, Any]:
    """A data set 55: complex values (8, 3)."""
    w = 2 * np.pi * hertz
    return {
        "type": 55,
        "model_type": 1,
        "analysis_type": 3,
        "data_ch": 2,
        "spec_data_type": 12,
        "load_case": 1,
        "mode_n": number,
        "data_type": 5,
        "n_data_per_node": 3,
        "eig": w * (-0.02 + 1j * np.sqrt(1 - 0.02**2)),
        "node_nums": NODES,
        "r1": values[:, 0],
        "r2": values[:, 1],
        "r3": values[:, 2],
    }


def function(data: np.ndarray, f: np.ndarray, node: int = 1, **other: Any) -> dict[str, Any]:
    return {
        "type": 58,
        "binary": 0,
        "func_type": 4,
        "rsp_node": node,
        "rsp_dir": 3,
        "ref_node": 9,
        "ref_dir": -1,
        "data": data,
        "x": f,
        "ord_data_type": 6,
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 12,
        "orddenom_spec_data_type": 13,
        **other,
    }


def write(path: Path, *sets: dict[str, Any], double: bool = True) -> Path:
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets(list(sets), mode="add", force_double=double)
    return path


def some(rows: int, seed: int = 0) -> np.ndarray:
    rng = generator(seed)
    return rng.standard_normal((rows, 3)) + 1j * rng.standard_normal((rows, 3))


@pytest.mark.parametrize(
    ("binary", "double", "spacing"),
    [(0, True, 1), (0, False, 1), (1, True, 1), (0, True, 0), (1, True, 0)],
)
def test_functions_come_back(tmp_path: Path, binary: int, double: bool, spacing: int) -> None:
    f, H = np.arange(20, 60, 0.5), some(80)[:, 0]
    given = function(
        H, f, binary=binary, abscissa_spacing=spacing, ord_data_type=6 if double else 5
    )
    (read_back,) = read_universal(write(tmp_path / "f.uff", given, double=double)).functions
    assert read_back.values == pytest.approx(H, rel=1e-9 if double else 1e-4, abs=1e-4)
    assert read_back.frequency_Hz == pytest.approx(f)
    assert (read_back.response, read_back.reference, read_back.form) == (
        (1, 3),
        (9, -1),
        "accelerance",
    )


def test_functions_state_their_unit(tmp_path: Path) -> None:
    path = write(tmp_path / "f.uff", function(some(80)[:, 0], np.arange(80.0)))
    lines = path.read_text().splitlines(keepends=True)
    for number, unit in ((10, "(m/s^2)"), (11, "N")):
        lines[number] = f"{lines[number][:46]}{unit:20}\n"
    path.write_text("".join(lines))
    assert [each.unit for each in read_universal(path).functions] == ["m/s^2/n"]


def test_shapes_come_back_and_what_is_0_in_all_was_not_measured(tmp_path: Path) -> None:
    one, two = some(8, 1), some(8, 2)
    one[3, 1] = two[3, 1] = 0
    one[5, 2] = 0  # at a node of this mode
    real = {**shape(two.real, number=2), "analysis_type": 2, "freq": 79.5, "modal_damp_vis": 0.03}
    file = read_universal(write(tmp_path / "s.uff", shape(one), real))
    first, second = file.shapes
    assert (first.frequency_Hz, first.damping) == pytest.approx((66.1, 0.02), rel=1e-4)
    assert (second.frequency_Hz, second.damping) == pytest.approx((79.5, 0.03))
    assert np.isnan(first.values[3, 1]) and np.isnan(second.values[3, 1])
    assert first.values[5, 2] == 0
    kept = np.isfinite(first.values)
    assert kept.sum() == 23 and first.values[kept] == pytest.approx(one[kept], rel=1e-4)


@pytest.mark.parametrize("kind", [15, 2411])
def test_lengths_are_in_the_unit_of_data_set_164(tmp_path: Path, kind: int) -> None:
    line = {"type": 82, "trace_num": 1, "color": 1, "id": "tread", "nodes": NODES}
    path = write(tmp_path / "g.uff", units(1e3), geometry(kind, 1e3), line)
    file = read_universal(path)
    assert is_universal(path) and file.lines == [tuple(range(1, 9))]
    X = np.array([file.nodes[node] for node in NODES])
    assert np.hypot(X[:, 0], X[:, 1]) == pytest.approx(0.39, rel=1e-4)
    sensors = sensors_of([(1, 3), (2, -1)], file.nodes, "z")
    assert sensors.points[:, 1] == pytest.approx(ANGLES[:2], rel=1e-4)
    # -x at 41 degrees: radially inward, and tangentially forward
    expected = [-np.cos(ANGLES[1]), np.sin(ANGLES[1]), 0]
    assert sensors.directions == pytest.approx(np.array([[0, 0, 1], expected]), abs=1e-4)


def test_the_axle_is_told_by_the_places_or_asked_for() -> None:
    nodes = {
        n: (0.1 * (-1) ** n, 0.39 * np.sin(a), 0.39 * np.cos(a)) for n, a in enumerate(ANGLES, 1)
    }
    signals = [(n, 1) for n in nodes]
    sensors = sensors_of(signals, nodes)
    assert sensors.directions == pytest.approx(np.tile([0.0, 0.0, 1.0], (8, 1)))
    assert sensors.points[:, 0] == pytest.approx(0.39)
    ball = {
        n: (0.3 * x, 0.3 * y, 0.3 * z)
        for n, (x, y, z) in enumerate(np.vstack([np.eye(3), -np.eye(3)]))
    }
    with pytest.raises(InputError, match="give --axle"):
        sensors_of([(n, 1) for n in ball], ball)


def test_another_centre_is_noticed() -> None:
    nodes = {n: (0.39 * np.cos(a) + 1.0, 0.39 * np.sin(a), 0.0) for n, a in enumerate(ANGLES)}
    signals = [(n, 3) for n in nodes]
    with pytest.raises(InputError, match=r"off the axle; give --centre"):
        sensors_of(signals, nodes, "z", (0.5, 0.0, 0.0))
    assert sensors_of(signals, nodes, "z", (1.0, 0.0, 0.0)).points[:, 0] == pytest.approx(0.39)


@pytest.mark.parametrize("binary", [0, 1])
def test_a_file_cut_off_anywhere_is_refused_with_its_line(tmp_path: Path, binary: int) -> None:
    f = np.arange(20, 60, 0.5)
    sets = [units(), geometry(), shape(some(8)), function(some(80)[:, 0], f, binary=binary)]
    whole = write(tmp_path / "w.uff", *sets).read_bytes()
    marks = {whole.find(b"    -1", k) + 6 for k in range(len(whole))}
    path = tmp_path / "cut.uff"
    for end in generator(0).integers(40, len(whole) - 8, 60):
        path.write_bytes(whole[: int(end)])
        if any(end - 1 <= mark <= end for mark in marks):
            continue  # between two sets: a whole file of fewer sets
        with pytest.raises(InputError, match=r"cut\.uff, (line \d+: )?data set \d"):
            read_universal(path)


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        ([shape(some(8), -37.8)], r"data set 1 \(type 55, line 1\): mode 1 has -37.8 Hz"),
        ([shape(some(8), 0.0)], "has 0 Hz, must be above 0"),
        ([units(0.0)], "the factor of the length is 0.0"),
        ([units(float("nan"))], "the factor of the length is nan"),
        ([function(some(80)[:, 0], np.arange(80.0), abscissa_spec_data_type=17)], "is over time"),
        ([function(some(80)[:, 0], np.arange(80.0) - 9)], "must rise from 0 or more, got -9 Hz"),
    ],
)
def test_wrong_sets_are_named(tmp_path: Path, sets: list[dict[str, Any]], words: str) -> None:
    for each in sets:
        if each["type"] == 55 and abs(each["eig"]) and words.endswith("-37.8 Hz"):
            each |= {"analysis_type": 2, "freq": -37.8}
    with pytest.raises(InputError, match=words) as error:
        read_universal(write(tmp_path / "bad.uff", *sets))
    assert str(error.value).startswith(f"{tmp_path / 'bad.uff'}, data set ")
    assert "\n" not in str(error.value)


def test_a_set_that_holds_less_than_it_says_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "f.uff", function(some(80)[:, 0], np.arange(80.0)))
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:20] + lines[25:]))
    with pytest.raises(InputError, match="70 values, the set says 80; it is cut off"):
        read_universal(path)


def test_other_sets_are_passed_over_and_counted(tmp_path: Path) -> None:
    coherence = function(np.ones(80), np.arange(80.0), func_type=6)
    file = read_universal(write(tmp_path / "f.uff", coherence, geometry()))
    assert file.skipped == {"coherence": 1} and not file.functions
