"""The pressed tyre and the pressure sweep: drawn, tabulated and written for ParaView."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from PIL import Image
from rich.console import Console

from tyrecal.report import frequencies
from tyrecal.report.figure import save
from tyrecal.report.footprint import draw_curves, draw_footprint, draw_patches
from tyrecal.report.frequencies import draw_pressure_sweep
from tyrecal.report.shape_data import patches_data
from tyrecal.report.table import shown
from tyrecal.report.vtu import write_pressed, write_pressed_vtu
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.pressed import Pressed
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.footprint import FootprintResult, FootprintRow, footprint_result
from tyrecal.studies.pressure import PressureFindings
from tyrecal.studies.pressure_result import PressureRow, PressureSweep
from tyrecal.tyre.resolve import resolved

from ..evaluate.stand_in import CASE
from ..studies.hertz import ANGLES, FREE, Hertz
from .test_shape_data import volume

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


def test_a_patch_is_drawn_as_long_and_wide_as_its_table_says(designs: dict[str, Pressed]) -> None:
    rows = result(designs).rows[:3]
    patches = patches_data("", designs, BOTH).patches[:3]
    figure = draw_patches(patches, 500.0)
    for axes, row in zip(figure.axes, rows, strict=False):
        bands, edge = axes.collections[0], axes.patches[0].get_path()
        extents = 1e3 * np.array([row.width_m, row.length_m])
        assert np.ptp(edge.vertices, axis=0) == pytest.approx(extents, abs=0.02)
        clip = bands.get_clip_path().get_fully_transformed_path()
        assert axes.transData.transform_path(edge).vertices == pytest.approx(clip.vertices)
        dots = axes.lines[0].get_xydata()
        assert len(dots) and edge.contains_points(dots).all()


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


LABELS = [(0, 0, "axial"), (0, 0, "torsional"), (1, 0, None), (1, 1, None), (2, 0, None)]


def rows(labels=LABELS, designs=("initial", "fitted"), pressures=(100.0, 200.0, 320.0), slope=0.4):
    entries = [
        {
            "design": design,
            "pressure_kPa": p,
            "modes": [
                {
                    "c": c,
                    "m": m,
                    "kind": kind,
                    "multiplicity": 2 if c else 1,
                    "frequency_Hz": (30 + 20 * c - 9 * m + k) * (p / 200) ** 0.4,
                    "d_ln_f_d_ln_p": slope,
                }
                for c, m, kind in labels
            ],
        }
        for k, design in enumerate(designs)
        for p in pressures
    ]
    return [PressureRow.model_validate(row) for row in entries]


@pytest.mark.slow
def test_each_mode_is_drawn_in_its_family_and_named_once(tmp_path):
    path = tmp_path / "sweep.png"
    figure = draw_pressure_sweep(rows(), [(Label(2, 0), 240.0, 79.5)])
    save(figure, path)
    with Image.open(path) as image:
        assert image.format == "PNG" and image.size == (1440, 1140)
        assert 0.02 < (np.asarray(image.convert("L")) < 245).mean() < 0.2
    assert path.stat().st_size < 150_000
    inner, outer = figure.axes[:2]
    assert (inner.get_title("left"), outer.get_title("left")) == ("in-plane", "out-of-plane")
    assert {t.get_text() for t in inner.texts} == {"[0,0] torsional", "[1,0]", "[2,0]"}
    assert {t.get_text() for t in outer.texts} == {"[0,0] lateral", "[1,1]"}
    assert sum(len(line.get_xdata()) == 3 for line in inner.lines) == 6
    dashed = [x for x in inner.lines if len(x.get_xdata()) == 3 and x.get_linestyle() == "--"]
    assert len(dashed) == 3
    (cross,) = (x for x in inner.lines if list(x.get_xdata()) == [240.0])
    assert list(cross.get_ydata()) == [79.5]


@pytest.mark.slow
def test_targets_of_another_pressure_do_not_stretch_the_axis(tmp_path):
    figure = draw_pressure_sweep(rows(), [(Label(2, 0), 500.0, 79.5)])
    save(figure, tmp_path / "sweep.png")
    assert figure.axes[0].get_xlim()[1] < 340
    assert "target" not in [t.get_text() for t in figure.axes[0].get_legend().get_texts()]


@pytest.mark.parametrize(
    "given",
    [
        rows(designs=("initial",), pressures=(200.0,), slope=None),
        rows(labels=[(0, 1, None), (3, 2, None), (14, 0, None)]),
        rows()[:-2],
    ],
    ids=["one pressure", "overtones", "failed pressures"],
)
def test_whatever_was_found_is_drawn(given, tmp_path):
    save(draw_pressure_sweep(given), tmp_path / "sweep.png")
    assert (tmp_path / "sweep.png").exists()


def test_names_that_would_touch_are_moved_apart():
    place = frequencies.apart([0.30, 0.31, 0.32, 0.8], 0.05)
    assert min(np.diff(place)) > 0.05 - 1e-3
    assert place[1] == pytest.approx(0.31, abs=1e-3) and place[3] == 0.8


def test_table_and_csv_of_a_sweep():
    given = rows(designs=("initial",))
    fields = {
        "design": "initial",
        "from_kPa": 100.0,
        "to_kPa": 320.0,
        "modes": [
            {
                "c": c,
                "m": m,
                "kind": kind,
                "rise_Hz": 12.345,
                "rise_percent": 59.2,
                "curvature": "concave",
            }
            for c, m, kind in LABELS
        ],
    }
    console = Console(width=110, record=True)
    sweep = PressureSweep(rows=given, findings=[PressureFindings(**fields, words=[])])
    console.print(shown(*sweep.tables()))
    text = console.export_text()
    line = next(line for line in text.splitlines() if line.startswith("[2,0]"))
    assert "ovalisation" in line and "+12.3" in line and "+59.2" in line and "0.400" in line
    csv = sweep.csv().splitlines()
    assert len(csv) == 1 + 3 * 5
    assert csv[1].startswith("initial,100.0,0,0,axial,1,22.7")
    assert PressureSweep(rows=rows(slope=None), findings=[]).csv().splitlines()[-1].endswith(",")
