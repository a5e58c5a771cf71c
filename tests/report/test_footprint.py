"""The pressed tyre drawn, tabulated and written for ParaView."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from PIL import Image
from rich.console import Console

from tyrecal.report.figure import save
from tyrecal.report.footprint import draw_curves, draw_footprint
from tyrecal.report.shape_data import patches_data
from tyrecal.report.table import shown
from tyrecal.report.vtu import write_pressed, write_pressed_vtu
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.pressed import Pressed
from tyrecal.studies.footprint import FootprintResult, FootprintRow, footprint_result
from tyrecal.tyre.resolve import resolved

from ..evaluate.stand_in import CASE
from ..studies.hertz import ANGLES, FREE, Hertz
from .test_vtu import volume

LOADS = [500.0, 1000.0, 2000.0, 4000.0, 8000.0]
MESH = resolved(CASE).mesh
BOTH = {"initial": MESH, "fitted": MESH}


@pytest.fixture(scope="module")
def designs() -> dict[str, Pressed]:
    evaluator = Evaluator(TyreDesign(CASE), _solver=Hertz())
    return {
        "initial": evaluator.press({}, LOADS),
        "fitted": evaluator.press({"A_belt": 1e-7}, LOADS[:4]),
    }


def result(designs: dict[str, Pressed]) -> FootprintResult:
    return footprint_result({}, LOADS, designs, BOTH)


def drawn(designs: dict[str, Pressed], folder: Path) -> list[Figure]:
    """The figures, which were saved beside the files for ParaView."""
    patches = patches_data("", designs, BOTH).patches
    figures = draw_footprint(result(designs).rows, patches)
    for name, figure in figures.items():
        save(figure, folder / f"{name}.png")
    write_pressed(folder, designs, BOTH)
    return list(figures.values())


@pytest.mark.slow
def test_every_load_of_every_design_in_one_scale(
    designs: dict[str, Pressed], tmp_path: Path
) -> None:
    _, initial, fitted = drawn(designs, tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert {"footprint.png", "footprint_initial.png", "footprint_fitted.png"} < names
    assert {f"footprint_initial_{load:g}N.vtu" for load in LOADS} < names
    assert len(names) == 3 + 5 + 4
    limits = set()
    for figure, count in ((initial, 5), (fitted, 4)):
        panels = [axes for axes in figure.axes if axes.get_title("left")]
        assert [axes.get_title("left") for axes in panels] == [f"{x:g} N" for x in LOADS[:count]]
        assert all(axes.get_aspect() == 1.0 for axes in panels)
        assert len({axes.get_xlim() + axes.get_ylim() for axes in panels}) == 1
        (bar,) = (axes for axes in figure.axes if "kPa" in axes.get_ylabel())
        limits.add(bar.get_ylim())
        assert any(isinstance(each, QuadMesh) for each in bar.collections)
    assert len(limits) == 1
    with Image.open(tmp_path / "footprint_initial.png") as image:
        assert image.format == "PNG" and max(image.size) < 2000
        assert 0.05 < (np.asarray(image.convert("L")) < 245).mean() < 0.5


def test_area_and_deflection_of_both_designs(designs: dict[str, Pressed], tmp_path: Path) -> None:
    table = result(designs).rows
    figure = draw_curves(table)
    save(figure, tmp_path / "footprint.png")
    left, right, *_ = figure.axes
    assert [text.get_text() for text in left.get_legend().get_texts()] == ["initial", "fitted"]
    assert [line.get_linestyle() for line in left.lines] == ["--", "-"]
    assert list(left.lines[1].get_xdata()) == [0.5, 1, 2, 4]
    assert left.lines[0].get_ydata()[3] == pytest.approx(1e4 * table[3].area_m2)
    assert right.lines[0].get_ydata()[3] == pytest.approx(20.0)


def test_one_design_and_one_load(tmp_path: Path) -> None:
    designs = {"initial": Evaluator(TyreDesign(CASE), _solver=Hertz()).press({}, [3000.0])}
    drawn(designs, tmp_path)
    assert len(list(tmp_path.iterdir())) == 3


def test_marks_of_one_load_are_whole() -> None:
    """Marks are whole for designs that hardly differ, too."""
    row = {"load_N": 2e3, "area_m2": 8.3e-3, "deflection_m": 0.011}
    row |= {"vertical_stiffness_N_per_m": 2e5, "mean_pressure_Pa": 3e5, "peak_pressure_Pa": 4e5}
    row |= {"length_m": 0.1, "width_m": 0.1}
    other = {**row, "design": "fitted", "area_m2": 8.45e-3, "deflection_m": 0.0112}
    for axes in draw_curves([FootprintRow(**row, design="initial"), FootprintRow(**other)]).axes:
        marks = [line.get_ydata()[0] for line in axes.lines]
        assert len(marks) == 2 and max(marks) < 0.97 * axes.get_ylim()[1]


def test_the_deformed_tyre(designs: dict[str, Pressed], tmp_path: Path) -> None:
    """Flat on the road at +x, whole, with the solver's own numbers on its rings."""
    pressed = designs["initial"]
    at = pressed.footprints[3]
    write_pressed_vtu(tmp_path / "tyre.vtu", pressed, at, MESH)
    result = meshio.read(tmp_path / "tyre.vtu")
    (block,) = result.cells
    along, lines = MESH.shape
    turns = len(result.points) // ((along + 1) * (lines + 1))
    assert len(block.data) == along * lines * turns and turns >= 72
    assert result.points[:, 0].max() == pytest.approx(FREE - at.deflection_m)
    corners = result.points[block.data]
    whole = volume(result.points[block.data] - result.point_data["displacement"][block.data])
    assert 0.9 * whole < volume(corners) < whole
    pressure = result.point_data["contact_pressure"]
    touching = pressure > 0.02 * pressure.max()
    assert pressure.max() == pytest.approx(at.pressure_Pa.max())
    assert abs(result.points[touching, 2]).max() < 0.09  # along: half the patch and a ring
    assert abs(result.points[touching, 1]).max() < 0.06
    top = np.argmin(result.points[:, 0])
    assert np.linalg.norm(result.point_data["displacement"][top]) < 1e-12


def test_between_rings_far_apart_points_are_added(
    designs: dict[str, Pressed], tmp_path: Path
) -> None:
    """15 degrees of the formula's rings become three times five."""
    pressed = designs["initial"]
    write_pressed_vtu(tmp_path / "tyre.vtu", pressed, pressed.footprints[0], MESH)
    points = meshio.read(tmp_path / "tyre.vtu").points
    angles = np.unique(np.round(np.degrees(np.arctan2(-points[:, 2], points[:, 0])), 6) % 360)
    rings = np.degrees(ANGLES)
    assert all(np.abs(angles - ring).min() < 1 for ring in rings)  # the patch moved some a little
    assert np.diff(np.sort(angles)).max() < 5.01


def test_table_and_csv(designs: dict[str, Pressed]) -> None:
    sweep = result(designs)
    lines = sweep.csv().splitlines()
    assert lines[0] == (
        "design,load_N,deflection_m,area_m2,length_m,width_m,mean_pressure_Pa,"
        "peak_pressure_Pa,vertical_stiffness_N_per_m"
    )
    assert len(lines) == 1 + 9
    assert [float(x) for x in lines[4].split(",")[1:]] == list(sweep.rows[3].model_dump().values())[
        1:
    ]
    console = Console(width=110)
    with console.capture() as text:
        console.print(shown(*sweep.tables()))
    printed = text.get()
    assert (
        "area cm²" in printed and "20.00" in printed and "125.7" in printed and "300.0" in printed
    )
