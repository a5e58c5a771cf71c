"""Footprints and static stiffnesses: their own arithmetic, on tyres pressed by a formula."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.report.footprint import stiffness_figures as figures
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import evaluator as door_module
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.pressed import Pressed
from tyrecal.studies.footprint import (
    FootprintRow,
    Patch,
    findings,
    footprint_result,
    footprint_row,
    patch_of,
    press,
)
from tyrecal.studies.result import StudyInput
from tyrecal.studies.stiffness import StiffnessResult, at_constant_load, run
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

from ..cli.test_cli import CASE as CASE_FILE
from ..cli.test_cli import run as tyrecal
from ..evaluate.stand_in import CASE, StandIn
from .hertz import BELT, Hertz, coarse_case

LOADS = [500.0, 4000.0]


MESH = resolved(CASE).mesh


START = {"A_belt": BELT}


def evaluator(reach: float = 20e3) -> Evaluator:
    solver = Hertz()
    solver.reach = reach
    return Evaluator(TyreDesign(CASE), _solver=solver)


def test_numbers_of_a_hertzian_patch() -> None:
    """Ellipse of half axes 80 and 50 mm under 4 kN: 125.7 cm2, its peak 1.5 times the mean."""
    pressed = evaluator().press(START, LOADS)
    row = footprint_row(pressed, pressed.footprints[1], MESH)
    assert row["load_N"] == 4000 and row["deflection_m"] == pytest.approx(0.02)
    assert row["area_m2"] == pytest.approx(np.pi * 0.08 * 0.05)
    assert row["mean_pressure_Pa"] == pytest.approx(4000 / row["area_m2"])
    assert row["peak_pressure_Pa"] == pytest.approx(1.5 * row["mean_pressure_Pa"], rel=0.03)
    assert row["vertical_stiffness_N_per_m"] == pytest.approx(1.5 * 4000 / 0.02)
    # rings stand 10.2 mm apart, nodes across 5.6 mm: an extent is uncertain by as much
    assert row["length_m"] == pytest.approx(0.16, abs=0.0102)
    assert row["width_m"] == pytest.approx(0.10, abs=0.0056)


def test_the_patch_is_where_the_solver_says_and_in_order() -> None:
    pressed = evaluator().press(START, LOADS)
    footprint = pressed.footprints[1]
    patch = patch_of(pressed, footprint, MESH)
    assert patch.touches.sum() == len(footprint.node)
    for ours, theirs in (
        (patch.along, footprint.along_m),
        (patch.across, footprint.across_m),
        (patch.pressure, footprint.pressure_Pa),
    ):
        assert sorted(ours[patch.touches]) == pytest.approx(sorted(theirs), abs=1e-12)
    middle = patch.touches.any(axis=1)
    assert (np.diff(patch.along[middle], axis=0)[:, patch.touches.any(axis=0)] > 0).all()
    assert patch.along[middle].mean() == pytest.approx(0, abs=1e-9)


def test_extents_end_half_way_to_the_next_node() -> None:
    along, across = np.meshgrid([-3.0, -1.0, 0.0, 2.0, 5.0], [-4.0, 0.0, 2.0, 3.0], indexing="ij")
    touches = np.zeros(along.shape, bool)
    touches[1:4, 1:3] = True
    patch = Patch(along, across, 0.0 * along, touches)
    assert patch.length_m == 3.5 - -2.0 and patch.width_m == 2.5 - -2.0
    everywhere = Patch(along, across, 0.0 * along, touches | True)  # no next node to the mesh's end
    assert everywhere.length_m == 8.0 and everywhere.width_m == 7.0


def test_the_edge_is_where_the_depth_of_elements_is_zero() -> None:
    """Parabolas on elements of three nodes: exact for a paraboloid, whatever the mesh is."""
    steps = np.array([-0.2, -0.15, -0.1, -0.02, 0.06, 0.13, 0.2])
    along, across = np.meshgrid(steps, 0.6 * steps, indexing="ij")
    depth = 1e-3 * (1 - (along / 0.12) ** 2 - (across / 0.07) ** 2)
    (edge,) = Patch(along, across, 0.0 * along, depth > 0, depth, True).edges()
    assert np.hypot(edge[:, 0] / 0.07, edge[:, 1] / 0.12) == pytest.approx(1.0, abs=0.01)
    (edge,) = Patch(along, across, 0.0 * along, depth > 0).edges()  # half-way between nodes
    patch = Patch(along, across, 0.0 * along, depth > 0)
    assert np.ptp(edge, axis=0) == pytest.approx([patch.width_m, patch.length_m])


def test_both_designs_and_what_they_say() -> None:
    designs = {"initial": START, "fitted": {"A_belt": 0.5 * BELT}}
    names: list[str] = []
    outcomes = press(evaluator(), designs, LOADS, notify=lambda words, _: names.append(words))
    assert [words.partition(":")[0] for words in names] == ["initial", "fitted"]
    result = footprint_result(designs, LOADS, outcomes, {name: MESH for name in designs}).content()
    assert [(row["design"], row["load_N"]) for row in result["rows"]] == [
        ("initial", 500),
        ("initial", 4000),
        ("fitted", 500),
        ("fitted", 4000),
    ]
    assert result["failed"] == [] and result["pressure_kPa"] == {"initial": 240, "fitted": 240}
    content = result["findings"]
    ratio = 2 ** (2 * 0.05)
    assert [x["ratio"] for x in content["fitted_over_initial"]] == pytest.approx([ratio, ratio])
    assert content["words"][0] == (
        "the fitted tyre's area is larger than the initial one's at every load:"
        " +7.2 % at 500 N, +7.2 % at 4000 N"
    )
    mean = 4000 / (np.pi * 0.08 * 0.05) / 240e3
    assert content["mean_over_inflation"]["initial"][1]["ratio"] == pytest.approx(mean)


@pytest.mark.parametrize(
    ("areas", "words"),
    [
        ((1.1, 0.9, 1.2), "at all loads but 2000 N: +10.0 % at 1000 N, -10.0 % at 2000 N"),
        ((1.0, 0.9, 0.8), "at no load: +0.0 % at 1000 N"),
    ],
)
def test_areas_that_do_not_grow_are_said(areas: tuple[float, ...], words: str) -> None:
    alike = dict.fromkeys(("deflection_m", "length_m", "width_m", "peak_pressure_Pa"), 1.0)
    alike |= {"mean_pressure_Pa": 240e3, "vertical_stiffness_N_per_m": 1.0}
    rows = [
        FootprintRow(design=design, load_N=load, area_m2=area, **alike)
        for design, own in (("initial", (1.0, 1.0, 1.0)), ("fitted", areas))
        for load, area in zip((1e3, 2e3, 3e3), own, strict=True)
    ]
    content = findings(rows, {"initial": 240.0, "fitted": 120.0}).model_dump()
    assert words in content["words"][0]
    assert content["words"][1].endswith(
        "1.00 of the inflation pressure, within the usual 0.8 to 1.6"
    )
    assert "outside the usual 0.8 to 1.6 at 1000 N (2.00), 2000 N" in content["words"][2]
    assert findings(rows[:3], {"initial": 0.0}).model_dump() == {
        "fitted_over_initial": [],
        "mean_over_inflation": {},
        "words": [],
    }


def test_a_load_out_of_reach_keeps_those_below() -> None:
    outcomes = press(evaluator(3000.0), {"initial": START}, LOADS)
    pressed = outcomes["initial"]
    assert isinstance(pressed, Pressed) and pressed.failed is not None
    assert len(pressed.footprints) == 1 and pressed.failed.cause == "no_equilibrium"
    result = footprint_result({"initial": START}, LOADS, outcomes, {"initial": MESH}).content()
    assert result["failed"] == [
        {
            "design": "initial",
            "load_N": 4000,
            "cause": "no_equilibrium",
            "words": "the rim is on the road at 3000 N",
        }
    ]
    (failed,) = press(evaluator(100.0), {"initial": START}, LOADS).values()
    assert isinstance(failed, EvaluationFailed) and "rim" in failed.words


def test_a_solver_without_a_road_says_so() -> None:
    with pytest.raises(DeckRefused, match="'stand-in' cannot press a tyre on a road"):
        Evaluator(TyreDesign(CASE), _solver=StandIn()).press(START, LOADS)  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_bundled_solvers_own_footprints(tmp_path: Path) -> None:
    """Loads agree with the forces of rim and road, the patch is listed, half a turn changes
    nothing, and forces over deflections are the tangents' mean."""
    case = load_case(coarse_case(tmp_path))
    mesh = resolved(case).mesh
    loads = [2000.0, 2500.0]
    pressed = Evaluator(TyreDesign(case)).press({}, loads)
    assert pressed.failed is None and 12 < pressed.mass_kg < 14
    assert 0.39 < pressed.free_radius_m < 0.40
    for footprint, load in zip(pressed.footprints, loads, strict=True):
        assert footprint.road_N == pytest.approx(load, rel=1e-6)
        assert footprint.rim_N == pytest.approx([load, 0, 0], abs=1e-5 * load)
        pressure, area = footprint.pressure_Pa, footprint.area_m2
        assert (pressure > 0).all() and pressure @ area == pytest.approx(load, rel=0.02)
        patch = patch_of(pressed, footprint, mesh)
        assert sorted(patch.along[patch.touches]) == pytest.approx(sorted(footprint.along_m))
        assert sorted(patch.across[patch.touches]) == pytest.approx(sorted(footprint.across_m))
        turned = sorted(zip(-footprint.along_m, -footprint.across_m, pressure, strict=True))
        same = sorted(zip(footprint.along_m, footprint.across_m, pressure, strict=True))
        np.testing.assert_allclose(turned, same, rtol=1e-5, atol=1e-9)
        (edge,) = patch.edges()
        row = footprint_row(pressed, footprint, mesh)
        assert np.ptp(edge, axis=0) == pytest.approx([row["width_m"], row["length_m"]], rel=0.02)
        slip = np.linalg.norm(footprint.traction_Pa, axis=1)
        assert (slip <= 0.5 * pressure * (1 + 1e-6)).all()
    first, second = (footprint_row(pressed, each, mesh) for each in pressed.footprints)
    assert second["area_m2"] > first["area_m2"]
    chord = 500 / (second["deflection_m"] - first["deflection_m"])
    tangents = [row["vertical_stiffness_N_per_m"] for row in (first, second)]
    assert chord == pytest.approx(np.mean(tangents), rel=0.1)


def test_a_patch_of_another_design_of_the_same_mesh() -> None:
    """Nodes that the solver adds, like the rim's reference, are no matter."""
    pressed = evaluator().press(START, LOADS)
    footprint = pressed.footprints[0]
    more = replace(
        pressed,
        nodes=np.append(pressed.nodes, 900001),
        points=np.vstack([pressed.points, (0.0, 0.0)]),
    )
    u = np.concatenate([footprint.displacement, np.zeros((len(pressed.angles), 1, 3))], axis=1)
    row = footprint_row(more, replace(footprint, displacement=u), MESH)
    assert row == footprint_row(pressed, footprint, MESH)


COARSE = with_level(CASE, "coarse")


STIFF_START = start_values(COARSE)


VERTICAL, LATERAL, LONGITUDINAL, TORSION = 2e5, 1e5, 3e5, 5e3


class Stiff(Hertz):
    """A rim with couplings, all stiffer with the load, and less so where it is asked to be none."""

    answers = True

    def footprint(self, load: float) -> dict[str, Any]:
        """Footprint of one load."""
        C = np.diag([VERTICAL, LATERAL, LONGITUDINAL, TORSION, 2e4, 1e4]) * (load / 4e3) ** 0.1
        C[0, 3] = C[3, 0] = 1e4
        C[2, 4] = C[4, 2] = -0.3 * C[2, 2]
        return super().footprint(load) | ({"rim_reactions": C} if self.answers else {})


def answering(solver: Hertz | None = None) -> Evaluator:
    return Evaluator(TyreDesign(COARSE), _solver=solver or Stiff())


def test_all_but_the_vertical_stiffness_are_at_constant_load() -> None:
    result = run(COARSE, answering(), {"initial": STIFF_START}, [4000.0], [240.0])
    (row,) = result.rows
    assert row.vertical_N_per_m == VERTICAL and row.lateral_N_per_m == LATERAL
    assert row.longitudinal_N_per_m == LONGITUDINAL
    assert row.torsional_Nm_per_rad == pytest.approx(TORSION - 1e8 / VERTICAL)
    assert row.rolling_radius_m == pytest.approx(0.3)
    assert row.loaded_radius_m == pytest.approx(0.3925 - 0.02) and row.deflection_m == 0.02
    assert row.length_m > row.width_m > 0.09
    assert row.vertical_sliding_N_per_m == pytest.approx(3e5)
    held = at_constant_load(np.array(row.rim_stiffness))
    assert not held[0].any() and not held[:, 0].any()
    sentence = "lateral is 0.50 and longitudinal 1.50 times the vertical stiffness"
    assert result.sentences() == [f"initial: {sentence}"]


def test_designs_pressures_and_loads_and_what_is_not_reached() -> None:
    solver = Stiff()
    solver.reach = 3000.0
    designs = {"initial": STIFF_START, "fitted": {**STIFF_START, "C10": 1.1e6}}
    result = run(COARSE, answering(solver), designs, [2000.0, 4000.0], [200.0, 240.0])
    states = [(row.design, row.pressure_kPa, row.load_N) for row in result.rows]
    assert states == [(name, kPa, 2000.0) for name in designs for kPa in (200.0, 240.0)]
    assert [each.place for each in result.failed] == [
        f"{name}, 4000 N, {kPa} kPa" for name in designs for kPa in (200, 240)
    ]
    kinds = {"vertical_N_per_m", "lateral_N_per_m", "longitudinal_N_per_m", "torsional_Nm_per_rad"}
    assert {name.split(" ")[0] for name in result.quantities()} == kinds
    assert "lateral_N_per_m fitted 200 kPa 2000 N" in result.quantities()
    assert result.csv().splitlines()[0].startswith("design,pressure_kPa,load_N,vertical_N_per_m")
    assert [len(table.rows) for table in result.tables()] == [4, 4]
    assert all(len(table.columns) <= 8 for table in result.tables())


def test_by_name_at_the_cases_pressure() -> None:
    given = StudyInput(COARSE, answering(), {"initial": STIFF_START})
    result = StiffnessResult.run(given, loads_N=[4000.0])
    assert [row.pressure_kPa for row in result.rows] == [240.0]
    assert result.provenance and result.provenance.state.load_N == [4000.0]
    assert list(figures(result)) == ["stiffness"]


def test_refused() -> None:
    """A road that holds nothing; an answer without reactions; a solver that has none."""
    smooth = with_values(COARSE, {"road.friction": 0.0})
    with pytest.raises(InputError, match=r"road.friction is 0, so nothing holds the patch"):
        run(smooth, answering(), {"initial": STIFF_START}, [4000.0], [240.0])
    silent = Stiff()
    silent.answers = False
    with pytest.raises(EvaluationFailed, match="no reactions of the rim at 4000 N"):
        answering(silent).press(STIFF_START, [4000.0], rim_stiffness=True)


def test_the_command(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(door_module, "find_solver", lambda name, *command: Stiff())
    out = tmp_path / "out"
    arguments = ["stiffness", CASE_FILE, "--mesh", "coarse", "--output", str(out)]
    wanted = ["--loads-N", "2000,4000", "--pressure-kPa", "200,240"]
    assert tyrecal(*arguments, *wanted, "--no-pictures") == 0
    printed = capsys.readouterr()
    assert "torsional Nm/°" in printed.out and "2 states x 2 loads: 4 runs" in printed.err
    rows = json.loads((out / "stiffness.json").read_text())["rows"]
    assert [row["load_N"] for row in rows] == [2000, 4000] * 2
    assert tyrecal(*arguments, "--pressure-kPa", "240,240") == 2
    assert "each once" in capsys.readouterr().err
