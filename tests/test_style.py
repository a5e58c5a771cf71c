"""Lint, format and types: part of the tests, so that CI has nothing of its own to run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.mark.lint
@pytest.mark.parametrize(
    ("folder", "command"),
    [
        (".", ["ruff", "check", "."]),
        (".", ["ruff", "format", "--check", "."]),
        (".", ["mypy", "tyrecal"]),
        (
            "solvers",
            ["mypy", "--config-file", "../pyproject.toml", "bundled", "abaqus", "calculix"],
        ),
    ],
)
def test_clean(folder: str, command: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT / folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]


def test_the_solver_imports_nothing_of_the_tool() -> None:
    for path in (ROOT / "solvers").rglob("*.py"):
        for line in path.read_text().splitlines():
            assert not line.startswith(("import tyrecal", "from tyrecal")), path
