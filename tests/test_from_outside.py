"""The guides' examples of an own effect and an own solver, installed and used as they are there."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

from .conftest import CASES, ROOT

CASE = str(CASES / "p235_75r17.yaml")
SOLVER_GUIDE = (ROOT / "cases/own_solver.md").read_text()


def install(guide: str, module: str, site: Path) -> Path:
    """Put the guide's Python block into ``site`` as ``module``, registered as its TOML says."""
    code, registration = (
        re.search(rf"```{language}\n(.*?)```", guide, re.S) for language in ("python", "toml")
    )
    assert code and registration
    (site / f"{module}.py").write_text(code[1])
    table, entry = registration[1].splitlines()
    group = table.split('"')[1]
    info = site / f"{module}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{group}]\n{entry.replace(chr(34), '')}\n")
    return site


def tyrecal(site: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A command with the packages of ``site`` installed."""
    return subprocess.run(
        [sys.executable, "-m", "tyrecal", *arguments],
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
    )


@pytest.fixture
def effect(tmp_path: Path) -> Path:
    """A folder of packages with the example installed in it."""
    return install((ROOT / "cases/own_effect.md").read_text(), "my_effect", tmp_path)


def modes(site: Path, *arguments: str) -> dict[str, float]:
    """Frequencies in Hz by label on the coarse mesh."""
    done = tyrecal(
        site, "modes", CASE, "--mesh", "coarse", "--json", "--output", str(site / "out"), *arguments
    )
    assert done.returncode == 0, done.stderr
    return {
        f"{m['c']},{m['m']},{m['kind']}": m["frequency_Hz"]
        for m in json.loads(done.stdout)["modes"]
    }


@pytest.mark.slow
def test_it_is_the_change_that_it_says(effect: Path) -> None:
    modulus = "materials.belt_cord.youngs_modulus_Pa"
    plain, absent = modes(effect), modes(effect, "--set", "effects.belt_softening=0")
    softened = modes(effect, "--set", "effects.belt_softening=0.25")
    by_hand = modes(effect, "--set", f"{modulus}={0.75 * 172.2e9!r}")
    assert plain == absent
    assert softened == pytest.approx(by_hand, rel=1e-9)  # it starts elsewhere
    assert softened["4,0,None"] < 0.999 * plain["4,0,None"]


@pytest.mark.slow
def test_the_catalogue_has_it_and_refuses_what_cannot_be(effect: Path) -> None:
    done = tyrecal(effect, "effects", "belt_softening", "--json")
    (entry,) = json.loads(done.stdout)
    assert entry["title"] == "Softer belt cords" and "bundled" in entry["solvers"]
    assert entry["about"][0].startswith("The belts' cords have lost stiffness")
    done = tyrecal(
        effect,
        "modes",
        CASE,
        "--set",
        "effects.belt_softening=1.5",
        "--output",
        str(effect / "out"),
    )
    assert done.returncode == 2 and "less than 1" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.fixture
def solver(tmp_path: Path) -> Path:
    """A folder of packages with the example installed in it."""
    return install(SOLVER_GUIDE, "my_solver", tmp_path)


@pytest.mark.slow
def test_the_example_gives_the_bundled_solvers_frequencies(solver: Path, tmp_path: Path) -> None:
    path = CASES / "p235_75r17.yaml"
    done = tyrecal(
        solver,
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
def test_its_failure_is_typed_and_kept(solver: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = tyrecal(
        solver,
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
def test_its_fit_needs_no_gradients(solver: Path, tmp_path: Path) -> None:
    """The fit has two free variables by finite differences, one of them already at its optimum."""
    out = tmp_path / "out"
    done = tyrecal(
        solver,
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
    code = SOLVER_GUIDE.split("```python\n")[1].split("```")[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 40


@pytest.mark.slow
def test_the_doctor_finds_it_sound(solver: Path) -> None:
    done = tyrecal(solver, "doctor", "--solver", "my-solver", "--json")
    assert done.returncode == 0, done.stderr
    check = json.loads(done.stdout)["self_check"]
    assert check["ok"] and all(abs(m["deviation_percent"]) < 0.01 for m in check["modes"])
