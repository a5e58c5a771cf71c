"""The deck that presses the tyre: an ABAQUS job on the inflated one, a step a load."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.templates import TemplateFailed
from tyrecal.tyre.values import with_values

from ..conftest import CASES
from .test_deck import case_with_template

CASE = load_case(CASES / "p235_75r17.yaml")
LOADS = (500.0, 1234.5)


def blocks(text: str) -> list[tuple[str, list[str]]]:
    """Keyword lines with their data lines."""
    result: list[tuple[str, list[str]]] = []
    for line in text.splitlines():
        if line.startswith("**"):
            continue
        if line.startswith("*"):
            result.append((line, []))
        else:
            result[-1][1].append(line)
    return result


def data(text: str, keyword: str) -> list[str]:
    """Data lines of the only block that starts with ``keyword``."""
    (lines,) = (lines for name, lines in blocks(text) if name.startswith(keyword))
    return lines


def test_loads_take_the_place_of_modes_and_leave_the_inflation_alone() -> None:
    pressed, plain = (
        Decks(TyreDesign(CASE), loads_N=LOADS).texts("abaqus"),
        Decks(TyreDesign(CASE)).texts("abaqus"),
    )
    assert list(pressed) == ["inflate.inp", "press.inp"]
    assert list(plain) == ["inflate.inp", "modes.inp"]
    assert pressed["inflate.inp"] == plain["inflate.inp"]


def test_a_step_a_load_on_the_free_road() -> None:
    press = Decks(TyreDesign(CASE), loads_N=LOADS).texts("abaqus")["press.inp"]
    first, *steps = press.split("*STEP, NAME=")[1:]
    assert first.startswith("EQUILIBRIUM") and "CAVITY, P, 240000\n" in first
    assert "900001, 1, 6\n900002, 1, 6\n" in first
    for number, (step, load) in enumerate(zip(steps, ("-500", "-1234.5"), strict=True), start=1):
        assert step.startswith(f"LOAD_{number}, NLGEOM=YES\n*STATIC, LONG TERM\n")
        assert "*BOUNDARY, OP=NEW\n900001, 1, 6\n900002, 2, 6\n" in step
        assert f"*CLOAD\n900002, 1, {load}\n" in step
        assert ("STABILIZE" in step) == (number == 1)
    assert max(map(len, press.splitlines())) <= 256  # ABAQUS reads no more


def test_elements_once_round_the_tyre_fine_at_the_patch() -> None:
    press = Decks(TyreDesign(CASE), loads_N=LOADS).texts("abaqus")["press.inp"]
    rows = [row.split(", ") for row in data(press, "*SYMMETRIC MODEL GENERATION")[2:]]
    angles = [float(row[0]) for row in rows]
    assert sum(angles) == 360 and angles == angles[::-1] and angles[0] == min(angles) == 4
    assert {tuple(row[1:]) for row in rows} == {("1", "1.0", "C")}
    assert max(angles) <= 180  # the longest cylindrical element that ABAQUS takes


def test_the_road_lies_below_the_tyre_and_faces_it() -> None:
    """ABAQUS: local x from a to b, local z against the generator a to c, y of the two; the normal
    is on the left of the line from START, that is y for a line along x."""
    press = Decks(TyreDesign(CASE), loads_N=LOADS).texts("abaqus")["press.inp"]
    corner, generator, start, line = data(press, "*SURFACE, NAME=ROAD")
    a, b = np.array(corner.split(", "), float).reshape(2, 3)
    x, z = b - a, a - np.array(generator.split(", "), float)
    assert (start, line) == ("START, -1.0, 0.0", "LINE, 1.0, 0.0")
    np.testing.assert_allclose(np.cross(z, x), [-1, 0, 0], atol=1e-12)
    largest = max(r for r, _ in resolved(CASE).mesh.nodes.values())
    assert a == pytest.approx([largest + 0.05, 0, 0])
    (node,) = data(press, "*NODE, NSET=ROAD_REFERENCE")
    assert [float(x) for x in node.split(", ")] == pytest.approx([900002, *a])


def test_the_tread_is_the_whole_outer_surface() -> None:
    inflate = Decks(TyreDesign(CASE)).texts("abaqus")["inflate.inp"]
    assert data(inflate, "*SURFACE, NAME=TREAD") == ["OUTER_ROW, S2"]
    numbers = [int(n) for row in data(inflate, "*ELSET, ELSET=OUTER_ROW") for n in row.split(", ")]
    mesh = resolved(CASE).mesh
    assert len(numbers) == mesh.shape[0] == len(mesh.inner)
    assert {mesh.cells[n][1] for n in numbers} == {mesh.shape[1] - 1}
    line = np.array([mesh.nodes[n] for n in mesh.outer_nodes])
    assert len(line) == 2 * mesh.shape[0] + 1 and set(mesh.crown_outer) <= set(mesh.outer_nodes)
    assert line[0, 1] == -line[-1, 1] < 0 and line[:, 0].max() == max(
        r for r, _ in mesh.nodes.values()
    )


def test_numbers_of_the_road() -> None:
    values = {"road.friction": 0.0, "road.stiffness_Pa_per_m": 2e9, "road.elastic_slip_m": 1e-3}
    press = Decks(TyreDesign(with_values(CASE, values)), loads_N=LOADS).texts("abaqus")["press.inp"]
    assert data(press, "*SURFACE BEHAVIOR") == ["2000000000"]
    assert "*FRICTION, ELASTIC SLIP=0.001\n0\n" in press
    with pytest.raises(ValueError, match="sum 180, got 178"):
        with_values(CASE, {"road.element_angles_deg.0": 2.0})
    with pytest.raises(ValueError, match="must rise"):
        with_values(CASE, {"road.loads_N.0": 5000.0})
    moved = with_values(CASE, {"road.loads_N.0": 700.0})
    assert moved.case.road.loads_N[:2] == [700, 1000]


def test_the_users_own_template(case_folder: Path) -> None:
    case = case_with_template(case_folder, "press.inp.j2", "0.1, 1.0", "{{ road.speed }}, 1.0")
    assert "modes.inp" in Decks(TyreDesign(case)).texts("abaqus")
    with pytest.raises(TemplateFailed, match=re.escape("press.inp.j2")):
        Decks(TyreDesign(case), loads_N=LOADS).texts("abaqus")
