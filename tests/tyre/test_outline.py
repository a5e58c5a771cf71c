"""Sections from two curves, and station tables by gauges: what they must agree with.

The spline through stations: what it reproduces, its smoothness and ends, and SciPy's.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import interpolate

from tyrecal.errors import InputError
from tyrecal.tyre.section.curve import CubicSpline
from tyrecal.tyre.section.from_size import build, usual
from tyrecal.tyre.section.mesh import build_mesh
from tyrecal.tyre.section.outline import read_outline, section_of_outline
from tyrecal.tyre.section.section import SectionError, from_gauges, read_section
from tyrecal.tyre.section.size import parse_size

from ..chance import generator

Array = np.ndarray
CASES = Path(__file__).parents[2] / "cases"
SIZE = parse_size("205/60R15")
GAUGES = usual(SIZE)
REST = {
    "belt_width": GAUGES.belt,
    "carcass_depth": GAUGES.liner,
    "belt_depth": GAUGES.ply,
    "belt_spacing": GAUGES.belts,
    "belt_step": GAUGES.step,
}


def write_outline(path: Path, curves: dict[str, Array]) -> Path:
    rows = [
        f"{name},{1e3 * r:.4f},{1e3 * z:.4f}" for name, curve in curves.items() for r, z in curve
    ]
    path.write_text("\n".join(["curve,r_mm,z_mm", *rows]) + "\n")
    return path


def curves() -> dict[str, Array]:
    points = build(SIZE, GAUGES).section().points
    return {"outer": points[-1], "inner": points[0]}


def test_the_outline_of_a_section_gives_the_section_again(tmp_path: Path) -> None:
    section = build(SIZE, GAUGES).section()
    read = read_outline(write_outline(tmp_path / "o.csv", curves()))
    rim = float(section.points[1, section.rigid][0, 0])
    again = section_of_outline(read, rim_radius=rim, **REST)
    assert again.regions[:3] == section.regions[:3]
    # the carcass' depth is the liner's all over, but at the bead; above, both are one section
    wall = int(np.argmax(section.points[1, :, 1]))
    shared = [section.names.index(n) for n in ("inner", "ply", "belt1_turn_up", "belt2", "outer")]
    one, other = again.points[:, :wall], section.points[shared, :wall]
    assert np.array_equal(np.isnan(one), np.isnan(other))
    apart = np.hypot(*np.moveaxis(one - other, 2, 0))
    assert np.nanmax(apart) < 0.4e-3  # stations stand on normals of the inner surface
    meshes = [
        build_mesh(again, [8, 1, 6, 8, 2], [1, 1, 1, 2], True),
        build_mesh(section, [8, 1, 6, 5, 4, 2], [1] * 6, True),
    ]
    areas = [_area(mesh) for mesh in meshes]
    assert areas[0] == pytest.approx(areas[1], rel=5e-3)


def _area(mesh: object) -> float:
    corners = np.array([[mesh.nodes[n] for n in s[:4]] for s in mesh.solids.values()])  # type: ignore[attr-defined]
    r, z = np.moveaxis(corners, 2, 0)
    return float(abs((r * np.roll(z, -1, 1) - z * np.roll(r, -1, 1)).sum()) / 2)


def test_curves_may_run_from_the_bead_upwards(tmp_path: Path) -> None:
    up = {name: curve[::-1] for name, curve in curves().items()}
    one = read_outline(write_outline(tmp_path / "up.csv", up))
    other = read_outline(write_outline(tmp_path / "down.csv", curves()))
    for name in one:
        assert np.array_equal(one[name], other[name])


def test_a_ring_of_constant_thickness(tmp_path: Path) -> None:
    """A half torus: gauges are radial, so every line is an arc whose radius is known."""
    t = np.linspace(0, 0.8 * np.pi, 80)
    arcs = {
        name: np.stack([0.25 + a * np.cos(t), a * np.sin(t)], -1)
        for name, a in (("outer", 0.06), ("inner", 0.05))
    }
    section = section_of_outline(
        read_outline(write_outline(tmp_path / "o.csv", arcs)),
        belt_width=0.08,
        rim_radius=0.22,
        carcass_depth=2e-3,
        belt_depth=1e-3,
        belt_spacing=1e-3,
        belt_step=0.01,
    )
    for line, radius in zip(section.points, (0.05, 0.052, 0.053, 0.054, 0.06), strict=True):
        radii = np.hypot(*(line - [0.25, 0.0]).T)
        assert radii[~np.isnan(radii)] == pytest.approx(radius, abs=3e-5)
    ends = [np.flatnonzero(~np.isnan(section.points[k, :, 0]))[-1] for k in (2, 3)]
    angles = [np.arctan2(*(section.points[1, e] - [0.25, 0.0])[::-1]) for e in ends]
    assert 0.052 * np.array(angles) == pytest.approx([0.04, 0.035], abs=1e-4)
    assert section.points[1, section.rigid][0, 0] == pytest.approx(0.22, abs=1e-5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: [r.replace("outer", "tread") for r in rows], "outer or inner"),
        (lambda rows: rows[:20], "the inner curve has 0 points"),
        (lambda rows: [rows[0], *rows[6:]], "outer curve must begin at the crown"),
        (lambda rows: [*rows[:3], rows[2], *rows[3:]], "a point twice"),
        (lambda rows: [*rows[:3], "outer,300", *rows[4:]], "2 cells, the headings are 3"),
        (lambda rows: [*rows[:3], "outer,300,wide", *rows[4:]], "must be a number"),
        (lambda rows: ["curve,r,z", *rows[1:]], "column 'r_mm' is missing"),
    ],
)
def test_wrong_outlines(change: object, words: str, tmp_path: Path) -> None:
    path = write_outline(tmp_path / "o.csv", curves())
    path.write_text("\n".join(change(path.read_text().splitlines())) + "\n")  # type: ignore[operator]
    with pytest.raises(InputError, match=words):
        read_outline(path)


@pytest.mark.parametrize("read", [read_outline, read_section])
def test_a_table_may_come_from_any_spreadsheet(read: Any, tmp_path: Path) -> None:
    """Semicolons, tabs, decimal commas, marks of Unicode, columns that are empty."""
    name = "205_60r15.csv" if read is read_section else "205_60r15_outline.csv"
    text = (CASES / name).read_text()
    wanted = read(CASES / name)
    (path := tmp_path / "t.csv").touch()
    german = text.replace(",", ";").replace(".", ",")
    for content in (
        german.encode(),
        german.replace("\n", "\r\n").encode("utf-8-sig"),
        text.replace(",", "\t").encode("utf-16"),
        ("sep=;\n" + german).encode(),
        text.replace(",", " , ").replace("\n", ",,\n").encode(),
    ):
        path.write_bytes(content)
        again = read(path)
        if read is read_section:
            assert again == wanted
        else:
            assert all(np.array_equal(again[curve], wanted[curve]) for curve in wanted)


def test_a_radius_that_can_be_a_thousand_times_as_large_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "o.csv"
    text = (CASES / "205_60r15_outline.csv").read_text().replace(",", ";")
    path.write_text(text.replace(".", ",").replace("313,500", "313.500", 1))
    with pytest.raises(InputError, match=r"which can be 313500 or 313\.5, because") as error:
        read_outline(path)
    assert error.value.line == 2


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("belt_width", 0.5, "the belt must be between"),
        ("rim_radius", 0.15, "the rim holds"),
        ("rim_radius", 0.30, "the rim holds"),
        ("belt_depth", 0.02, "thinner than their depth"),
    ],
)
def test_numbers_that_no_outline_can_have(
    key: str, value: float, words: str, tmp_path: Path
) -> None:
    read = read_outline(write_outline(tmp_path / "o.csv", curves()))
    with pytest.raises(SectionError, match=words):
        section_of_outline(read, **{"rim_radius": 0.2074, **REST, key: value})


def test_gauges_are_distances_along_the_normal() -> None:
    t = np.linspace(0, 2.0, 30)
    line = np.stack([0.25 + 0.05 * np.cos(t), 0.05 * np.sin(t)], -1)
    gauges = np.array([-1e-3, 0.0, 8e-3])[:, None] * np.ones(len(t))
    for points, radius in zip(from_gauges(line, gauges), (0.049, 0.05, 0.058), strict=True):
        radii = np.hypot(*(points - [0.25, 0.0]).T)
        assert radii[:-3] == pytest.approx(radius, abs=2e-6)  # the spline's end is straight


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ply_r_mm", "ply_gauge_mm", "column|gauges are distances"),
        ("outer_gauge_mm", "outer_r_mm", "column 'outer_z_mm' is missing"),
        ("3,crown,1.20000", "3,crown,", "'inner' must be given"),
        ("3,crown,1.20000", "3,crown,thick", "must be a number in mm"),
    ],
)
def test_wrong_gauge_tables(old: str, new: str, words: str, tmp_path: Path) -> None:
    text = build(SIZE, GAUGES).csv()
    assert old in text
    (tmp_path / "s.csv").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=words):
        read_section(tmp_path / "s.csv")


SOMEWHERE = np.linspace(-0.3, 6.3, 45)  # also beyond the ends


def stations(count: int) -> np.ndarray:
    """Unequal steps from 0 to 6."""
    return np.insert(6 * np.cumsum(x := 1 + np.arange(count - 1) % 3) / x.sum(), 0, 0.0)


@pytest.mark.parametrize("count", [2, 3, 4, 5, 9])
def test_polynomials_are_reproduced(count: int) -> None:
    """Straight through two stations, a parabola through three, a cubic through four or more."""
    curve = np.polynomial.Polynomial([0.3, -1.2, 0.7, 0.11][:count])
    x = stations(count)
    spline = CubicSpline(x, np.stack([curve(x), -2 * curve(x)], -1))
    expected = np.stack([curve(SOMEWHERE), -2 * curve(SOMEWHERE)], -1)
    assert spline(SOMEWHERE) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert spline.slope[:, 0] == pytest.approx(curve.deriv()(x), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("count", [2, 3, 6, 14])
@pytest.mark.parametrize("clamped", [False, True])
def test_as_scipy(count: int, clamped: bool) -> None:
    x, y = stations(count), generator("spline", count).normal(size=(count, 3, 2))
    start = np.arange(6.0).reshape(3, 2) if clamped else None
    ends = ((1, start), (2, np.zeros((3, 2)))) if clamped else "not-a-knot"
    theirs = interpolate.CubicSpline(x, y, bc_type=ends)
    ours = CubicSpline(x, y, start)
    assert ours(SOMEWHERE) == pytest.approx(theirs(SOMEWHERE), rel=1e-10, abs=1e-10)
    assert ours.slope == pytest.approx(theirs(x, 1), rel=1e-10, abs=1e-10)
