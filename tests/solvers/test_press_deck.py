"""The pressed tyre's deck: a whole tyre, finer at the patch, that no number is missing from."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from tyrecal.simulate.deck.calculix import calculix_context
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved

from ..conftest import CASES
from .press_deck import Angles, Road, around, press_texts

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
