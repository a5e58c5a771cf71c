"""The pressed tyre's deck: a whole tyre, finer at the patch, that no number is missing from.

CalculiX's pressed tyre: forces and area are read whole, or not at all.
"""

from __future__ import annotations

import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.calculix import calculix_context
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved

from ..conftest import CASES
from .press_deck import (
    Angles,
    Road,
    around,
    press_texts,
    read_press,
    read_pressures,
    read_radius,
    run_press,
)

WHOLE = Angles(6.0, 24.0, 20.0, 1.5, whole=True)
HALF = replace(WHOLE, whole=False)


def coarse_case(element: str) -> LoadedCase:
    """The main case with 3 elements a region, 1 in the bead, and a row between lines."""
    case = load_case(CASES / "p235_75r17.yaml")
    level = case.case.mesh.levels["default"].model_copy(
        update={
            "elements": {"crown": 3, "upper_sidewall": 3, "lower_sidewall": 3, "bead": 1},
            "rows": (1, 1, 1, 1),
            "grading": None,
        }
    )
    mesh = case.case.mesh.model_copy(update={"levels": {"default": level}, "element": "CGAX4R"})
    solver = case.case.solver.model_copy(update={"options": {"element": element}})
    return replace(case, case=case.case.model_copy(update={"mesh": mesh, "solver": solver}))


def volumes(names: dict, block: dict) -> np.ndarray:
    """Volumes of a block's bricks, m3, between their corners: Gauss, 2 x 2 x 2 points."""
    place = {n: xyz for n, *xyz in names["nodes"]}
    corners = np.array([[place[n] for n in row[1:9]] for row in block["elements"]])
    a = np.array(
        [
            (-1, -1, -1),
            (1, -1, -1),
            (1, 1, -1),
            (-1, 1, -1),
            (-1, -1, 1),
            (1, -1, 1),
            (1, 1, 1),
            (-1, 1, 1),
        ]
    )
    total = np.zeros(len(corners))
    for at in a / np.sqrt(3):
        f = 1 + a * at
        slopes = np.stack([a[:, i] * f[:, i - 1] * f[:, i - 2] / 8 for i in range(3)])
        total += np.linalg.det(slopes @ corners)
    return total


def mass(names: dict) -> float:
    density = {rubber["name"]: rubber["density"] for rubber in names["rubbers"]}
    return sum(
        block.get("density", density.get(block.get("material"))) * volumes(names, block).sum()
        for block in names["solids"] + names["plies"]
    )


@pytest.mark.parametrize("angles", [Angles(), HALF, Angles(2.0, 24.0, 12.0, 1.4), Angles(5.0)])
def test_sizes_once_around(angles: Angles) -> None:
    half = angles.sizes()
    assert sum(half) == pytest.approx(180)
    fine = [size for size, end in zip(half, np.cumsum(half), strict=True) if end < 24.1]
    assert sum(fine) == pytest.approx(24) and fine == pytest.approx([fine[0]] * len(fine))
    assert fine[0] == pytest.approx(angles.fine, rel=0.05)
    assert (np.diff(half) > -1e-9).all() and half[-1] <= angles.coarse
    assert replace(angles, whole=True).sizes() == half[::-1] + half


@pytest.mark.parametrize("element", ["C3D8", "C3D20R"])
@pytest.mark.parametrize("angles", [HALF, WHOLE])
def test_numbers_have_no_gaps(element: str, angles: Angles) -> None:
    """CalculiX reserves memory up to the largest number."""
    case = coarse_case(element)
    texts = press_texts(case, [0.01], angles, 0.3925)
    text = texts["wheel.inp"] + texts["press.inp"]
    blocks = re.findall(r"^(\*(?:NODE, NSET|ELEMENT,).*)\n((?:[^*].*\n)+)", text, re.M)
    nodes, elements, used = [], [], set()
    for keyword, lines in blocks:
        rows = [[part for part in row.split(",")] for row in re.sub(r",\n", ",", lines).split("\n")]
        numbers = [int(row[0]) for row in rows if row[0]]
        if keyword.startswith("*NODE"):
            nodes += numbers
        else:
            elements += numbers
            used |= {int(n) for row in rows for n in row[1:]}
    assert nodes == list(range(1, len(nodes) + 1))
    assert sorted(elements) == list(range(1, len(elements) + 1))
    assert used == set(nodes)


@pytest.mark.parametrize("element", ["C3D8", pytest.param("C3D20R", marks=pytest.mark.slow)])
def test_the_section_is_carried_around(element: str) -> None:
    """Pappus, for chords: a wedge of d degrees holds area times mean radius times sin d."""
    case = coarse_case(element)
    mesh = resolved(case).mesh
    corner = np.array([[mesh.nodes[n] for n in solid[:4]] for solid in mesh.solids.values()])
    r, z = corner[..., 0], corner[..., 1]
    s, y = np.roll(r, -1, 1), np.roll(z, -1, 1)
    moment = ((r * y - s * z) * (r + s)).sum() / 6  # area times mean radius
    names = calculix_context(resolved(case))
    sector_angle = np.sin(2 * np.pi / names["sectors"])
    for angles in (HALF, WHOLE):
        tyre = around(names, angles)
        turned = np.sin(np.radians(angles.sizes())).sum()
        rubber = np.concatenate([volumes(tyre, block) for block in tyre["solids"]])
        plies = np.concatenate([volumes(tyre, block) for block in tyre["plies"]])
        assert rubber.min() > 0 and plies.min() > 0
        assert rubber.sum() == pytest.approx(moment * turned, rel=1e-9)
        assert mass(tyre) == pytest.approx(mass(names) * turned / sector_angle, rel=1e-9)


@pytest.mark.parametrize("element", ["C3D8", "C3D20R"])
def test_the_half_turned_about_x_is_the_other_half(element: str) -> None:
    names = calculix_context(resolved(coarse_case(element)))
    half, whole = around(names, HALF), around(names, WHOLE)
    place = {n: np.array(xyz) for n, *xyz in half["nodes"]}
    turned = {tuple(np.round(p * [1, s, s], 8) + 0.0) for p in place.values() for s in (1, -1)}
    assert turned == {tuple(np.round(xyz, 8) + 0.0) for _, *xyz in whole["nodes"]}
    for node, other in half["turned"]:
        np.testing.assert_allclose(place[other], place[node] * [1, -1, -1], atol=1e-9)
    held = set(dict(half["node_sets"])["RIM"])
    in_plane = {n for n, p in place.items() if abs(p[1]) < 1e-9}
    assert {n for pair in half["turned"] for n in pair} == in_plane - held
    assert not whole["turned"]


@pytest.mark.parametrize("element", ["C3D8", "C3D20R", "C3D20"])
def test_the_road_meets_the_tread(element: str) -> None:
    """The road's face is at the outer radius; its travel ends at inflated radius less
    deflection."""
    case = coarse_case(element)
    texts = press_texts(case, [0.006, 0.01], HALF, 0.3925, Road(friction=0.0))
    tyre = around(calculix_context(resolved(case)), HALF)
    place = {n: np.array(xyz) for n, *xyz in tyre["nodes"]}
    outer = [place[n] for n in dict(tyre["node_sets"])["TREAD_NODES"]]
    radius = max(np.hypot(x, y) for x, y, _ in place.values())
    assert min(np.hypot(x, y) for x, y, _ in outer) > 0.3 and len(outer) > 20
    assert max(abs(np.degrees(np.arctan2(y, x))) for x, y, _ in outer) == pytest.approx(24)
    kinds = set(re.findall(r"^\*ELEMENT, TYPE=(\w+)", texts["wheel.inp"], re.M))
    assert kinds == {element}
    press = texts["press.inp"]
    assert (
        "*FRICTION" not in press
        and "*FRICTION" in press_texts(case, [0.006], HALF, 0.3925)["press.inp"]
    )
    faces = re.findall(r"^\*NODE, NSET=ROAD\n((?:\d.*\n){8})", press, re.M)[0].split("\n")[:8]
    assert min(float(row.split(",")[1]) for row in faces) == pytest.approx(radius)
    travels = re.findall(r"^\*\* deflection (\S+) m\n\d, (\S+)$", press, re.M)
    for deflection, travel in travels:
        assert radius + float(travel) == pytest.approx(0.3925 - float(deflection))
    assert len(travels) == 2


DECK = "** deflection 0.006 m\n1, -0.005\n** deflection 0.01 m\n2, -0.009\n"
DAT = """
 total force (fx,fy,fz) for set RIM and time  0.{k}000000E+01

        6.187689E+02  2.036030E+04  6.392139E-02

 total force (fx,fy,fz) for set ROAD and time  0.{k}000000E+01

       -6.236171E+02 -7.005251E+01 -1.209515E+00


 statistics for slave set TREAD, master set ROAD_FACE and time  0.{k}000000E+01

   total surface force (fx,fy,fz) and moment about the origin (mx,my,mz)

   -6.236171E+02 -7.005251E+01 -1.209515E+00  1.214473E-01  3.015647E-01 -3.639383E+01

   center of gravity and mean normal

    3.865992E-01 -1.323059E-02  2.055130E-04  1.000000E+00  0.000000E+00  2.088515E-18

   moment about the center of gravity(mx,my,mz)

    9.104800E-02 -3.787152E-02 -1.060765E+00

   area,  normal force (+ = tension) and shear force (size)

    1.413829E-03 -6.236171E+02  7.006295E+01
"""
BOTH = DAT.replace("{k}", "1") + DAT.replace("{k}", "2").replace("6.23", "6.24")


def folder_with(folder: Path, dat: str, wheel: str = "*EQUATION\n") -> Path:
    for name, text in (("press.inp", DECK), ("wheel.inp", wheel), ("press.dat", dat)):
        (folder / name).write_text(text)
    return folder


def test_a_half_counts_twice(tmp_path: Path) -> None:
    first, second = read_press(folder_with(tmp_path, BOTH))
    assert (first.deflection_m, second.deflection_m) == (0.006, 0.01)
    assert first.force_N == pytest.approx(2 * 623.6171)
    assert first.rim_N == pytest.approx(2 * 618.7689)
    assert first.area_m2 == pytest.approx(2 * 1.413829e-3)
    assert first.shear_N == pytest.approx(70.06295)
    assert second.force_N == pytest.approx(2 * 624.6171)


def test_the_whole_tyre_counts_once(tmp_path: Path) -> None:
    first, _ = read_press(folder_with(tmp_path, BOTH, "*NODE\n"))
    assert first.force_N == pytest.approx(623.6171) and math.isnan(first.shear_N)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("time  0.2000000E+01\n\n   total surface", "", "1 of 2"),
        ("area,  normal", "no area, normal", "0 of 2"),
        ("0.2000000E+01", "0.1500000E+01", "2 of 2"),
        ("1.413829E-03", "0.000000E+00", "bears 1247.23 N on 0 m2"),
        ("1.413829E-03", "         NaN", "not numbers"),
        ("-6.236171E+02 -7.005251E+01", "************* -7.005251E+01", "not numbers"),
        ("6.187689E+02", "5.187689E+02", "the rim 1037.54 N"),
        ("-6.236171E+02", " 6.236171E+02", "bears -1247.23 N"),
        ("time", "tame", "0 of 2"),
    ],
)
def test_results_that_are_not_whole(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in BOTH
    with pytest.raises(RunFailed, match=re.escape(words)) as failure:
        read_press(folder_with(tmp_path, BOTH.replace(old, new)))
    assert failure.value.cause == "no_results"


def test_results_that_are_cut_off_or_absent(tmp_path: Path) -> None:
    folder_with(tmp_path, BOTH[:-300])
    with pytest.raises(RunFailed, match="1 of 2"):
        read_press(tmp_path)
    (tmp_path / "press.dat").unlink()
    with pytest.raises(RunFailed, match=r"no press\.dat"):
        read_press(tmp_path)


def lines(*rows: tuple[int, list[float]]) -> str:
    return "".join(f" -1{n:10d}" + "".join(f"{x:12.5E}" for x in v) + "\n" for n, v in rows)


def test_pressures_stand_where_their_nodes_have_moved(tmp_path: Path) -> None:
    heads = [
        f" -5  {name:8s}    1\n" for name in ("COPEN", "CSLIP1", "CSLIP2", "CPRESS", "CSHEAR1")
    ]
    text = (
        "    1C\n    2C\n"
        + lines((1, [0.3, -0.1, -0.2]), (2, [0.3, 0.0, 0.1]))
        + " -3\n"
        + " -4  DISP        4    1\n"
        + lines((1, [0, 0.01, 0.0]), (2, [0, 0, 0.02]))
        + " -3\n"
        + " -4  CONTACT     6    1\n"
        + "".join(heads)
        + lines((1, [-1e-5, -0.1, -0.2, 3e5, -1e5]), (2, [0.0, 0, 0, 0, 0]))
        + " -3\n 9999\n"
    )
    (tmp_path / "press.frd").write_text(text)
    (patch,) = read_pressures(tmp_path)
    assert patch.tolist() == [[pytest.approx(-0.09), pytest.approx(-0.2), 3e5]]
    apart = text.replace(lines((2, [0.0, 0, 0, 0, 0])), "")  # what touches nothing may be missing
    (tmp_path / "press.frd").write_text(apart)
    assert apart != text and read_pressures(tmp_path)[0].tolist() == patch.tolist()
    (tmp_path / "press.frd").write_text(text.replace("CONTACT", "STRESS "))
    with pytest.raises(RunFailed, match="0 patches"):
        read_pressures(tmp_path)


@pytest.mark.parametrize(("share", "whole"), [(0.019, True), (0.021, False)])
@pytest.mark.parametrize("side", [1, -1])
def test_how_well_road_and_rim_must_balance(
    tmp_path: Path, share: float, whole: bool, side: int
) -> None:
    """Within 2 % of the road's force."""
    text = BOTH.replace("6.187689E+02", f"{623.6171 * (1 + side * share):.6E}")
    text = text.replace("6.247689E+02", f"{623.6171 * (1 + side * share):.6E}")
    folder_with(tmp_path, text.replace("6.246171", "6.236171"))
    if whole:
        assert len(read_press(tmp_path)) == 2
    else:
        with pytest.raises(RunFailed, match="the road bears"):
            read_press(tmp_path)


def test_the_job_runs_with_its_wheel(tmp_path: Path) -> None:
    """Wherever ccx has to run, and what it left is read."""
    left = tmp_path / "left.py"
    left.write_text(
        "import sys; from pathlib import Path\n"
        "assert Path('wheel.inp').read_text() and sys.argv[1:] == ['press']\n"
        f"Path('press.dat').write_text({BOTH!r})\n"
        "print('Job finished')\n"
    )
    for place in ("plain", "with blanks"):
        (tmp_path / place).mkdir()
        folder = folder_with(tmp_path / place, "an older run's")
        run_press(folder, [sys.executable, str(left)], 30.0)
        assert len(read_press(folder)) == 2


def test_the_radius_is_the_last_states(tmp_path: Path) -> None:
    points = lines((1, [0.3, -0.1, -0.2]), (2, [0.31, 0.0, 0.1]))
    state = lambda moved: f" -4  DISP        4    1\n{moved} -3\n"
    first = state(lines((1, [0.05, 0, 0]), (2, [0.05, 0, 0])))
    last = state(lines((1, [0.02, 0, 0]), (2, [0.005, 0, 0])))
    text = f"    1C\n    2C\n{points} -3\n{first}{last} 9999\n"
    (tmp_path / "press.frd").write_text(text)
    assert read_radius(tmp_path) == pytest.approx(0.32)


@pytest.mark.ccx
def test_road_and_rim_balance(tmp_path: Path) -> None:
    """The tyre has no pressure, which CalculiX would count in part as the rim's reaction."""
    case = coarse_case("C3D8")
    angles = Angles(8.0, 16.0, 32.0, 2.0)
    texts = press_texts(case, [0.004], angles, 0.39215)
    pressureless = re.sub(r"^(CAVITY, P6, ).*$", r"\g<1>0.0", texts["press.inp"], flags=re.M)
    (tmp_path / "wheel.inp").write_text(texts["wheel.inp"])
    (tmp_path / "press.inp").write_text(pressureless)
    run_press(tmp_path, ["ccx"], 120)
    (pressed,) = read_press(tmp_path)
    assert pressed.force_N > 50
    assert pressed.rim_N == pytest.approx(pressed.force_N, rel=1e-4)
    assert 1e-4 < pressed.area_m2 < 0.01
    assert 0 < pressed.shear_N <= 0.5 * pressed.force_N / 2
    (patch,) = read_pressures(tmp_path)
    assert (patch[:, 0] < 1e-4).all() and (abs(patch[:, 1]) < 0.1).all()
    assert 0.2 < patch[:, 2].mean() * pressed.area_m2 / pressed.force_N < 5
    assert read_radius(tmp_path) == pytest.approx(0.39215 - 0.004, abs=5e-4)
