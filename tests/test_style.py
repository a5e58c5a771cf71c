"""Lint, format and types: part of the tests, so that CI has nothing of its own to run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]


HOOKS = YAML(typ="safe").load(ROOT / ".pre-commit-config.yaml")["repos"][0]["hooks"]


@pytest.mark.lint
@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_clean(hook: dict[str, str]) -> None:
    """What a commit's hooks check."""
    done = subprocess.run(
        [sys.executable, "-m", *hook["entry"].split()], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]


def test_the_solver_imports_nothing_of_the_tool() -> None:
    for path in (ROOT / "solvers").rglob("*.py"):
        for line in path.read_text().splitlines():
            assert not line.startswith(("import tyrecal", "from tyrecal")), path
