"""The guide's example of an own solver, installed and run as it stands there."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tyrecal.case import load_case, start_values
from tyrecal.evaluate.door import Door, Question

from ..conftest import CASES, ROOT

GUIDE = (ROOT / "solvers/OWN_SOLVER.md").read_text()


def tyrecal(site: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "tyrecal", *arguments],
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
    )


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder of packages with the example installed in it."""
    code, registration = (
        re.search(rf"```{language}\n(.*?)```", GUIDE, re.S) for language in ("python", "toml")
    )
    assert code and registration
    (tmp_path / "my_solver.py").write_text(code[1])
    entry = registration[1].splitlines()[1].replace('"', "")
    info = tmp_path / "my_solver-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-solver\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[tyrecal.solvers]\n{entry}\n")
    return tmp_path


def test_the_example_gives_the_bundled_solvers_frequencies(site: Path, tmp_path: Path) -> None:
    path = CASES / "p235_75r17.yaml"
    done = tyrecal(site, "modes", str(path), "--solver", "my-solver", "--json",
                   "--output", str(tmp_path / "out"))  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = [mode["frequency_Hz"] for mode in json.loads(done.stdout)["modes"]]
    case = load_case(path)
    expected = Door(case).evaluate(Question(start_values(case))).modes
    assert found == pytest.approx(sorted(m.frequency_Hz for m in expected), rel=1e-12)


def test_its_failure_is_typed_and_kept(site: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = tyrecal(site, "modes", str(CASES / "p235_75r17.yaml"), "--solver", "my-solver",
                   "--output", str(out), "--pressure-kPa", "1900", "--set", "A_carcass=1e-8",
                   "--set", "C10=1e5")  # fmt: skip
    assert done.returncode == 3
    assert "inflation stopped at" in done.stderr and "Traceback" not in done.stderr
    (kept,) = (out / "runs").iterdir()
    assert (kept / "modes.inp").exists()


def test_its_fit_needs_no_gradients(site: Path, tmp_path: Path) -> None:
    """Two free variables by finite differences, one of them already at its optimum."""
    out = tmp_path / "out"
    done = tyrecal(site, "fit", str(CASES / "p235_75r17.yaml"), "--solver", "my-solver",
                   "--fix", "A_belt", "--fix", "A_carcass", "--no-pictures",
                   "--output", str(out))  # fmt: skip
    assert done.returncode == 0, done.stderr
    fit = json.loads((out / "fit.json").read_text())
    assert fit["converged"] and fit["objective_Hz"] < 0.5 * fit["initial_objective_Hz"]
