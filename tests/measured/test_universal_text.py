"""Universal files written by hand after the format's description, and ours: each is read as it is
meant, to the digits that it has."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.measured.universal import read_universal
from tyrecal.measured.universal_text import WrittenShape, line_set, shape_set, universal_text
from tyrecal.report.universal_shapes import loaded_shapes_text, shapes_text
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.results import Evaluation, HarmonicShape, RawMode, RingShape
from tyrecal.simulate.modes.label import Label, labelled
from tyrecal.simulate.modes.loaded import Member
from tyrecal.simulate.provenance import provenance
from tyrecal.studies import loaded as loaded_studies
from tyrecal.studies.loaded import Loaded, LoadedMode, LoadedTyre
from tyrecal.studies.modes import modes_result
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved

from ..chance import generator
from ..cli.test_cli import run
from ..conftest import CASES

MILLIMETRES = """    -1
   151
tyre 7
NONE
a program
01-Jan-20 12:00:00
NONE
NONE
NONE
    -1
    -1
   164
         5mm (milli-newton)           2
  1.0000000000000000D+03  1.0000000000000000D+03  1.0000000000000000D+00
  2.7315000000000000D+02
    -1
    -1
  2411
        11         0         0        11
   3.0000000000000000D+02   0.0000000000000000D+00   6.2500000000000000D+01
        12         0         0        11
   0.0000000000000000D+00   3.0000000000000000D+02  -6.2500000000000000D+01
    -1
    -1
    82
         1         3         0
around
        11        12         0
    -1
    -1
    55
first mode
NONE
NONE
NONE
NONE
         1         2         2         8         2         3
         2         4         1         1
  7.71700E+01  1.00000E+00  5.60000E-02  0.00000E+00
        11
  1.25000E-01 -2.50000E-01  6.25000E-02
        12
  3.75000E-01  5.00000E-01 -1.00000E+00
    -1
"""
# nodes of single precision; eigenvalue -7 + 139.8i and complex values of a modal analysis
COMPLEX = """    -1
    15
         1         0         0        11  3.00000E-01  0.00000E+00  1.00000E-02
    -1
    -1
    55
NONE
NONE
NONE
NONE
NONE
         1         3         2        12         5         3
         2         6         1         4
 -7.00000E+00  1.39800E+02  1.00000E+00  0.00000E+00  1.00000E+00  0.00000E+00
         1
  1.00000E+00  2.00000E+00 -3.00000E+00  4.00000E+00  5.00000E-01 -6.00000E+00
    -1
"""
NEWER = """    -1
  2411
         5         0         0        11
   3.1350000000000000D-01   0.0000000000000000D+00   0.0000000000000000D+00
    -1
    -1
  2414
         1
MODE 3
         1
NONE
NONE
NONE
NONE
NONE
         1         2         2         8         2         3
         0         0         0         0         0         3         0         0
         0         0
  0.00000E+00  4.24100E+01  0.00000E+00  1.00000E+00  0.00000E+00  7.40000E-02
  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00  0.00000E+00
         5
  1.00000E+00  0.00000E+00 -2.50000E+00
    -1
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "file.uff"
    path.write_bytes(text.encode())
    return path


def test_millimetres(tmp_path: Path) -> None:
    """Lengths over the factor of the file's units; viscous damping; a pen that is lifted."""
    file = read_universal(written(tmp_path, MILLIMETRES))
    assert file.nodes == {11: (0.3, 0, 0.0625), 12: (0, 0.3, -0.0625)}
    assert file.lines == [(11, 12, 0)]
    (shape,) = file.shapes
    assert (shape.frequency_Hz, shape.damping) == (77.17, 0.056) and shape.nodes == (11, 12)
    assert shape.values.tolist() == [[0.125, -0.25, 0.0625], [0.375, 0.5, -1]]


def test_complex_modes(tmp_path: Path) -> None:
    file = read_universal(written(tmp_path, COMPLEX))
    assert file.nodes[1] == pytest.approx((0.3, 0, 0.01))
    (shape,) = file.shapes
    size = abs(-7 + 139.8j)
    assert shape.frequency_Hz == pytest.approx(size / (2 * np.pi))
    assert shape.damping == pytest.approx(7 / size)
    assert shape.values.tolist() == [[1 + 2j, -3 + 4j, 0.5 - 6j]]


def test_the_newer_set_of_shapes(tmp_path: Path) -> None:
    """Its hysteretic loss factor is twice the damping ratio; 0 in all modes is not measured."""
    (shape,) = read_universal(written(tmp_path, NEWER)).shapes
    assert (shape.frequency_Hz, shape.damping) == (42.41, 0.037)
    assert shape.values[0, [0, 2]].tolist() == [1, -2.5] and np.isnan(shape.values[0, 1])


def test_ours_are_read_back(tmp_path: Path) -> None:
    """Places to 16 digits, shapes and damping to 6."""
    random = generator(5)
    nodes = {n: random.normal(size=3).tolist() for n in (7, 101, 99999)}
    shapes = [
        WrittenShape(f"mode {k}", 40.123456 * (k + 1), random.normal(size=(3, 3)), 0.0123456, 1.0)
        for k in range(3)
    ]
    sets = [line_set(1, [7, 101, 99999, 7]), line_set(2, [*range(1, 12)])]
    sets += [shape_set("title", k, each, nodes) for k, each in enumerate(shapes, start=1)]
    file = read_universal(written(tmp_path, universal_text("a tyre \u00e9", nodes, sets)))
    assert file.nodes == {n: tuple(place) for n, place in nodes.items()}
    assert file.lines == [(7, 101, 99999, 7), tuple(range(1, 12))]
    for ours, back in zip(shapes, file.shapes, strict=True):
        assert back.frequency_Hz == pytest.approx(ours.frequency_Hz, rel=5e-6)
        assert back.damping == pytest.approx(0.0123456, rel=5e-6)
        assert np.allclose(back.values, ours.displacement, rtol=5e-6, atol=0)


CASE = with_level(load_case(CASES / "205_60r15.yaml"), "coarse")


def rigid() -> Evaluation:
    """A tyre that moves as a whole along the axle, and in its plane."""
    mesh = resolved(CASE).mesh
    points = np.array([*mesh.nodes.values()])
    nodes = np.array([*mesh.nodes])
    motions = {0: [0, 0, 1], 1: [1, 1j, 0]}
    modes = [
        RawMode(40.0 + n, HarmonicShape(n, nodes, points, np.tile(A, (len(nodes), 1)) + 0j), 1 + n)
        for n, A in motions.items()
    ]
    raw = tuple(replace(mode, damping_ratio=0.03) for mode in modes)
    inflated = np.tile([0.001, 0.0, 0.0], (len(nodes), 1))
    return Evaluation(220.0, 9.3, raw, nodes=nodes, displacement=inflated)


def test_shapes_of_a_tyre(tmp_path: Path) -> None:
    """x forward, y along the axle, z up: a pair moves down, then forward; points are inflated."""
    text = shapes_text(CASE, rigid(), labelled(rigid()), True)
    assert "4.00000E+01  1.00000E+00  3.00000E-02" in text
    file = read_universal(written(tmp_path, text))
    assert len(file.nodes) == 11 * 24 and len(file.lines) == 11 + 24
    assert {node for line in file.lines for node in line} == set(file.nodes)
    lowest = min(file.nodes.values(), key=lambda place: place[2])
    mesh = resolved(CASE).mesh
    top = max(r for r, _ in mesh.nodes.values())
    assert -lowest[2] == pytest.approx(top + 0.001) and lowest[0] == pytest.approx(0, abs=1e-12)
    along = [np.nan_to_num(shape.values.real) for shape in file.shapes]
    for motion, direction in zip(along, ([0, 1, 0], [0, 0, -1], [1, 0, 0]), strict=True):
        assert np.allclose(motion, direction, atol=1e-5)
    assert [shape.frequency_Hz for shape in file.shapes] == [40, 41, 41]
    assert {shape.damping for shape in file.shapes} == {0.03}


def test_shapes_of_a_solver_in_three_dimensions(tmp_path: Path) -> None:
    """Its own points and modes; what it does not give is 0; lines join points of one circle."""
    angles = 2 * np.pi * np.arange(12) / 12
    points = np.array([[0.3, theta, z] for z in (-0.08, -0.03, 0.03, 0.08) for theta in angles])
    theta = points[:, 1]
    down = np.column_stack([np.cos(theta), -np.sin(theta), np.full(48, np.nan)])
    forward = np.column_stack([-np.sin(theta), -np.cos(theta), 0 * theta])
    raw = tuple(RawMode(66.0 + k, RingShape(points, u), 1) for k, u in enumerate((down, forward)))
    evaluation = Evaluation(220.0, 9.3, raw)
    text = shapes_text(CASE, evaluation, labelled(evaluation), True)
    assert "6.60000E+01  0.00000E+00" in text  # a modal mass that is not known
    file = read_universal(written(tmp_path, text))
    assert len(file.nodes) == 48 and file.lines[0] == (*range(1, 13), 1) and len(file.lines) == 16
    assert file.nodes[4] == pytest.approx((-0.3, -0.08, 0), abs=1e-12)
    first, second = (np.nan_to_num(shape.values.real) for shape in file.shapes)
    assert np.allclose(first, [0, 0, -1], atol=1e-5) and np.allclose(second, [1, 0, 0], atol=1e-5)


def on_road() -> LoadedTyre:
    """A tyre of 8 rings of three points, the lowest pressed in by 20 mm, that moves down, forward
    and along the axle."""
    angles = 2 * np.pi * np.arange(8) / 8
    surface = np.tile([[0.3, 0.0, z] for z in (-0.05, 0.0, 0.05)], (8, 1, 1))
    surface[0, :, 0] -= 0.02
    cos, sin, o = np.cos(angles)[:, None], np.sin(angles)[:, None], np.zeros((8, 3))
    motions = np.array([[cos + o, -sin + o, o], [-sin + o, -cos + o, o], [o, o, 1 + o]])
    modes = tuple(
        LoadedMode(Member(Label(1, 0), "symmetric"), 60.0 + k, 1.0, 1.0, np.moveaxis(each, 0, -1))
        for k, each in enumerate(motions)
    )
    return LoadedTyre(220.0, 9.3, (Loaded(4000.0, 0.02, modes, surface=surface),), angles=angles)


def test_shapes_on_the_road(tmp_path: Path) -> None:
    """Points where the load has put them, a modal mass of 1, motions along x, y and z."""
    text = loaded_shapes_text(CASE, on_road(), True)
    assert "6.00000E+01  1.00000E+00" in text
    file = read_universal(written(tmp_path, text))
    assert len(file.nodes) == 24 and len(file.lines) == 3 + 8
    assert file.nodes[2] == pytest.approx((0, 0, -0.28), abs=1e-12)
    assert file.nodes[8] == pytest.approx((-0.3, 0, 0), abs=1e-12)  # behind the hub
    directions = ([0, 0, -1], [1, 0, 0], [0, 1, 0])
    for shape, direction in zip(file.shapes, directions, strict=True):
        assert np.allclose(np.nan_to_num(shape.values.real), direction, atol=1e-5)


def test_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """From the modes.json of the same tyre without a load, whose frequencies come back."""
    monkeypatch.setattr(Evaluator, "evaluate", lambda self, question: rigid())
    solver: Any = type("Solver", (), {"name": "bundled", "version": "1"})
    result, _ = modes_result(CASE, start_values(CASE), rigid())
    content = result.stamped(provenance(CASE, solver)).content()

    def exported(**changed: Any) -> int:
        (tmp_path / "modes.json").write_text(json.dumps(content | changed))
        case = str(CASES / "205_60r15.yaml")
        return run("export", str(tmp_path), "--case", case, "--format", "uff", "--force")

    assert exported() == 0
    assert len(read_universal(tmp_path / "export" / "205_60r15.uff").shapes) == 3
    given = on_road()
    monkeypatch.setattr(loaded_studies, "load_tyres", lambda *of: {"initial": given})
    modes = [{**content["modes"][0], "frequency_Hz": 61.0, "multiplicity": 1}]
    assert exported(load_N=4000.0, modes=modes) == 0
    assert "[1,0]" in (tmp_path / "export" / "205_60r15.uff").read_text()
    assert exported(load_N=4000.0) == 2
    assert "has other frequencies" in capsys.readouterr().err
    content["modes"][0]["frequency_Hz"] = 41.5
    assert exported() == 2
    assert "has other frequencies: run 'tyrecal modes' again" in capsys.readouterr().err
