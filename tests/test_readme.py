"""Every command of the README and the guides runs, in the order in which it stands there."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
GUIDES = [
    "README.md",
    "cases/README.md",
    "cases/own_tyre.md",
    "cases/diagnosis.md",
    "cases/blind.md",
    "cases/own_effect.md",
    "cases/own_solver.md",
    "cases/own_template.md",
    "cases/python.md",
    "cases/theory.md",
    "cases/batch.md",
    "cases/cluster.md",
    "cases/measured_data.md",
    "solvers/README.md",
]
PACKAGED = ("ccx", "chromedriver", "fish")  # by Debian: CI installs them, tests do without
OWN_SETUP = "python3 -m venv"  # the two commands that set themselves up; CI runs the second


def commands(guide: str) -> list[str]:
    """Lines of the guide's ```sh blocks, continued lines joined."""
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / guide).read_text(), re.S)
    lines = "".join(blocks).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.strip() and not line.startswith("#")]


@pytest.mark.parametrize("guide", GUIDES)
def test_commands_of(guide: str, tmp_path: Path) -> None:
    for name in ("cases", "tests/benchmarks"):
        shutil.copytree(ROOT / name, tmp_path / name)
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    for command in commands(guide):
        if OWN_SETUP in command:
            continue
        done = subprocess.run(
            command, shell=True, cwd=tmp_path, capture_output=True, text=True, env=environment
        )
        assert done.returncode == 0, f"{command}\n{done.stdout[-1500:]}{done.stderr[-1500:]}"


@pytest.mark.parametrize("guide", ["README.md", "cases/python.md"])
def test_python_of(guide: str, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "cases", tmp_path / "cases")
    (program,) = re.findall(r"```python\n(.*?)```", (ROOT / guide).read_text(), re.S)
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-1500:]
    assert len(done.stdout.splitlines()) >= 6


def test_ci_runs_the_readmes_test_command_and_nothing_cleverer() -> None:
    (test_command,) = [c for c in commands("README.md") if OWN_SETUP in c and "pytest" in c]
    lines = (ROOT / ".ci/run").read_text().splitlines()
    debians = tuple(f"command -v {program} >/dev/null ||" for program in PACKAGED)
    aside = ("#", "set ", "cd ", *debians)
    body = [line for line in lines if line and not line.startswith(aside)]
    assert body == [test_command]


def test_files_named_in_the_guides_exist() -> None:
    for guide in GUIDES:
        folder = (ROOT / guide).parent
        for link in re.findall(r"\]\(([^)#]+)\)", (ROOT / guide).read_text()):
            if not link.startswith("http"):
                assert (folder / link).exists(), f"{guide}: {link}"
