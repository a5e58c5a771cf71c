"""Static stiffnesses from the rim's, on tyres pressed by a formula."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.report.stiffness import figures
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import evaluator as door_module
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.result import StudyInput
from tyrecal.studies.stiffness import StiffnessResult, at_constant_load, run
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.values import with_values

from ..cli.test_cli import CASE as CASE_FILE
from ..cli.test_cli import run as tyrecal
from ..evaluate.stand_in import CASE
from .hertz import Hertz

COARSE = with_level(CASE, "coarse")
START = start_values(COARSE)
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


def evaluator(solver: Hertz | None = None) -> Evaluator:
    return Evaluator(TyreDesign(COARSE), _solver=solver or Stiff())


def test_all_but_the_vertical_stiffness_are_at_constant_load() -> None:
    result = run(COARSE, evaluator(), {"initial": START}, [4000.0], [240.0])
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
    designs = {"initial": START, "fitted": {**START, "C10": 1.1e6}}
    result = run(COARSE, evaluator(solver), designs, [2000.0, 4000.0], [200.0, 240.0])
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
    given = StudyInput(COARSE, evaluator(), {"initial": START})
    result = StiffnessResult.run(given, loads_N=[4000.0])
    assert [row.pressure_kPa for row in result.rows] == [240.0]
    assert result.provenance and result.provenance.state.load_N == [4000.0]
    assert list(figures(result)) == ["stiffness"]


def test_refused() -> None:
    """A road that holds nothing; an answer without reactions; a solver that has none."""
    smooth = with_values(COARSE, {"road.friction": 0.0})
    with pytest.raises(InputError, match=r"road.friction is 0, so nothing holds the patch"):
        run(smooth, evaluator(), {"initial": START}, [4000.0], [240.0])
    silent = Stiff()
    silent.answers = False
    with pytest.raises(EvaluationFailed, match="no reactions of the rim at 4000 N"):
        evaluator(silent).press(START, [4000.0], rim_stiffness=True)


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
