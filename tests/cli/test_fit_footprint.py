"""tyrecal fit with contact area and vertical stiffness among the targets."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.report import pictures
from tyrecal.report.convergence import draw_convergence
from tyrecal.report.figure import save
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import evaluator as door_module
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.fit.problem import Problem
from tyrecal.tyre.load import load_case

from ..fit.pressed import AREA_0, STIFFNESS_0, Elastic
from ..studies.hertz import coarse_case
from .test_cli import run

FOOTPRINT = f"""  footprint:
    - {{load_N: 4000, contact_area_m2: {1.05 * AREA_0!r}, sigma_m2: {0.02 * AREA_0!r}}}
    - {{load_N: 3500, vertical_stiffness_N_per_m: {0.9 * STIFFNESS_0!r}, sigma_N_per_m: 5.0e+3}}
uncertainties:"""


@pytest.fixture
def elastic(monkeypatch: pytest.MonkeyPatch) -> type[Elastic]:
    """Footprints by a formula, modes by the bundled solver."""
    monkeypatch.setattr(door_module, "find_solver", lambda name, *command: Elastic())
    return Elastic


@pytest.fixture
def case(case_folder: Path) -> str:
    """The main case with two footprint targets, and a sigma for one mode."""
    path = case_folder / "p235_75r17.yaml"
    text = path.read_text().replace("\nuncertainties:", f"\n{FOOTPRINT}", 1)
    path.write_text(text.replace("31.7}", "31.7, sigma_Hz: 0.5}", 1))
    return str(path)


def found(out: Path, name: str = "fit") -> dict[str, Any]:
    return json.loads((out / f"{name}.json").read_text())


def test_what_it_writes(
    elastic: type[Elastic],
    case: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out, drawn = tmp_path / "out", []
    monkeypatch.setattr(pictures, "draw_fit", lambda *arguments: drawn.append(arguments))
    assert run("fit", case, "--output", str(out)) == 0
    *_, history, fit, _ = drawn[0]
    save(draw_convergence(history, fit.objective_unit), out / "convergence.png")
    assert fit.objective_unit == "sigma" and (out / "convergence.png").stat().st_size > 10_000
    printed, result = capsys.readouterr().out, found(out)
    assert [(row["load_N"], row["quantity"]) for row in result["footprint"]] == [
        (4000, "contact_area_m2"),
        (3500, "vertical_stiffness_N_per_m"),
    ]
    assert set(result["footprint"][0]) == {
        "load_N",
        "quantity",
        "initial",
        "fitted",
        "target",
        "sigma",
        "deviation_percent",
    }
    assert "4000 N" in printed and "contact area, cm²" in printed and "131.9" in printed
    assert "3500 N" in printed and "vertical stiffness, N/mm" in printed and "270.0" in printed
    assert "deviations in sigmas" in printed and "equation (1)" not in printed
    rows = list(csv.DictReader((out / "fit.csv").open()))
    assert len(rows) == 11 and rows[0]["c"] == "0" and rows[0]["load_N"] == ""
    assert float(rows[9]["fitted"]) == result["footprint"][0]["fitted"] and rows[9]["c"] == ""

    # the footprint study presses what the fit pressed
    arguments = ["footprint", case, "--output", str(out), "--no-pictures", "--quiet"]
    assert run(*arguments, "--fitted", str(out / "fit.json")) == 0
    rows = {(row["design"], row["load_N"]): row for row in found(out, "footprint")["rows"]}
    assert (4000 in {load for _, load in rows}) and (3500 in {load for _, load in rows})
    area, stiffness = result["footprint"]
    for design in ("initial", "fitted"):
        assert rows[design, 4000]["area_m2"] == area[design]
        assert rows[design, 3500]["vertical_stiffness_N_per_m"] == stiffness[design]


@pytest.mark.slow
def test_run_again_from_the_record(elastic: type[Elastic], case: str, tmp_path: Path) -> None:
    arguments = ["fit", case, "--output", str(tmp_path), "--no-pictures", "--quiet"]
    assert run(*arguments) == 0
    first, runs = (tmp_path / "fit.json").read_bytes(), found(tmp_path, "run")["fit"]["solver_runs"]
    assert run(*arguments) == 0
    again = found(tmp_path, "run")["fit"]
    assert (tmp_path / "fit.json").read_bytes() == first
    assert (again["solver_runs"], again["answered_from_record"] >= runs) == (0, True)


@pytest.mark.parametrize("solver", ["abaqus", "calculix"])
def test_a_solver_without_a_road(
    solver: str, case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("fit", case, "--output", str(out), "--solver", solver) == 2
    message = capsys.readouterr().err
    assert (
        message.count("\n") == 1 and f"solver '{solver}' cannot press a tyre on a road" in message
    )
    assert not out.exists()


def test_too_few_targets(
    elastic: type[Elastic], case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = Path(case)
    text = path.read_text()
    begin, end = text.index("  modes:\n    - {c"), text.index("  footprint:")
    path.write_text(f"{text[:begin]}{text[end:]}")
    arguments = ["fit", case, "--output", str(tmp_path / "out"), "--no-pictures"]
    assert run(*arguments) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1 and "2 targets cannot determine 3 free variables" in message
    assert run(*arguments, "--fix", "A_belt", "--quiet") == 0


@pytest.mark.slow
def test_jobs_change_no_bit(tmp_path: Path) -> None:
    """The bundled solver, one after the other and two at a time; its slopes are those of
    neighbours."""
    path = coarse_case(tmp_path)
    text = path.read_text().replace("[6, 6, 6, 12, 30, 120]", "[10, 14, 36, 120]")
    text = text.replace("120]}", "120], loads_N: [1000]}", 1).replace("4000", "1000")
    text = text.replace(
        "crown: 4, upper_sidewall: 3, lower_sidewall: 3",
        "crown: 3, upper_sidewall: 2, lower_sidewall: 2",
    )
    path.write_text(text.replace("\nuncertainties:", f"\n{FOOTPRINT.replace('3500', '1000')}", 1))
    path.write_text(path.read_text().replace("load_N: 4000", "load_N: 1000"))
    case = load_case(path)
    held = {"A_belt": 2.118683e-7, "A_carcass": 4.208352e-7}
    points = []
    for jobs, solver in ((1, None), (2, None), (2, Differences())):
        problem = Problem(case, Evaluator(TyreDesign(case), _solver=solver), held, jobs=jobs)
        points.append(problem.evaluate(problem.start()))
    assert (points[0].others == points[1].others).all()
    assert (points[0].jacobian == points[1].jacobian).all()
    assert (points[0].others == points[2].others).all()
    assert points[0].jacobian == pytest.approx(points[2].jacobian, rel=1e-2)
    assert 0.001 < points[0].others[0] < 0.02 and points[0].jacobian[-1, 0] > 0


class Differences(Bundled):
    """The bundled solver, did it not tell how a footprint changes."""

    capabilities = Bundled.capabilities - {"footprint_gradients"}
