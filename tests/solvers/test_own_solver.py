"""The guide's example of an own solver, installed and run as it stands there."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

from ..conftest import CASES, ROOT
from ..example import install, tyrecal

GUIDE = (ROOT / "cases/own_solver.md").read_text()


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder of packages with the example installed in it."""
    return install(GUIDE, "my_solver", tmp_path)


@pytest.mark.slow
def test_the_example_gives_the_bundled_solvers_frequencies(site: Path, tmp_path: Path) -> None:
    path = CASES / "p235_75r17.yaml"
    done = tyrecal(
        site,
        "modes",
        str(path),
        "--solver",
        "my-solver",
        "--json",
        "--output",
        str(tmp_path / "out"),
    )
    assert done.returncode == 0, done.stderr
    computed = [mode["frequency_Hz"] for mode in json.loads(done.stdout)["modes"]]
    case = load_case(path)
    expected = Evaluator(TyreDesign(case)).evaluate(Question(start_values(case))).modes
    assert computed == pytest.approx(sorted(m.frequency_Hz for m in expected), rel=1e-12)


@pytest.mark.slow
def test_its_failure_is_typed_and_kept(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = tyrecal(
        site,
        "modes",
        str(CASES / "p235_75r17.yaml"),
        "--solver",
        "my-solver",
        "--output",
        str(out),
        "--pressure-kPa",
        "1900",
        "--set",
        "A_carcass=1e-8",
        "--set",
        "C10=1e5",
        "--mesh",
        "coarse",
        "--allow-unusual",
    )
    assert done.returncode == 3
    assert "inflation stopped at" in done.stderr and "Traceback" not in done.stderr
    (kept,) = (out / "runs").iterdir()
    assert (kept / "modes.inp").exists()


@pytest.mark.slow
def test_its_fit_needs_no_gradients(site: Path, tmp_path: Path) -> None:
    """The fit has two free variables by finite differences, one of them already at its optimum."""
    out = tmp_path / "out"
    done = tyrecal(
        site,
        "fit",
        str(CASES / "p235_75r17.yaml"),
        "--solver",
        "my-solver",
        "--fix",
        "A_belt",
        "--fix",
        "A_carcass",
        "--no-pictures",
        "--mesh",
        "coarse",
        "--output",
        str(out),
    )
    assert done.returncode == 0, done.stderr
    fit = json.loads((out / "fit.json").read_text())
    assert fit["converged"] and fit["objective_Hz"] < 0.5 * fit["initial_objective_Hz"]


def test_it_is_as_short_as_the_guide_says() -> None:
    code = GUIDE.split("```python\n")[1].split("```")[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 40


@pytest.mark.slow
def test_the_doctor_finds_it_sound(site: Path) -> None:
    done = tyrecal(site, "doctor", "--solver", "my-solver", "--json")
    assert done.returncode == 0, done.stderr
    check = json.loads(done.stdout)["self_check"]
    assert check["ok"] and all(abs(m["deviation_percent"]) < 0.01 for m in check["modes"])
