"""Lint, format and types: part of the tests, so that CI has nothing of its own to run."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).parents[1]
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
VAGUE_NAMES = {"found", "told", "asked", "said"}
# Counts may only fall: whoever rewords one of these places lowers its number here.
VAGUE_DOCSTRINGS_LEFT = 0
VAGUE_LOCALS_LEFT = 0
HOOKS = YAML(typ="safe").load(ROOT / ".pre-commit-config.yaml")["repos"][0]["hooks"]


@pytest.mark.lint
@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_clean(hook: dict[str, str]) -> None:
    """The checks of a commit's hooks pass."""
    done = subprocess.run(
        [sys.executable, "-m", *hook["entry"].split()], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]


def test_the_solver_imports_nothing_of_the_tool() -> None:
    for path in (ROOT / "solvers").rglob("*.py"):
        for line in path.read_text().splitlines():
            assert not line.startswith(("import tyrecal", "from tyrecal")), path


def sources() -> Iterator[ast.Module]:
    """The syntax tree of every module of the tool, the solvers and the tests."""
    for room in ("tyrecal", "solvers", "tests"):
        for path in sorted((ROOT / room).rglob("*.py")):
            yield ast.parse(path.read_text(encoding="utf-8"))


def local_names(function: ast.AST) -> set[str]:
    """Parameters of a function and the names that it binds, without those of inner functions."""
    names: set[str] = set()
    inner = [*ast.iter_child_nodes(function)]
    while inner:
        node = inner.pop()
        if isinstance(node, FUNCTIONS):
            continue
        if isinstance(node, ast.arg):
            names.add(node.arg)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        inner += ast.iter_child_nodes(node)
    return names


def test_vague_docstrings_and_names_only_become_fewer() -> None:
    """A docstring that begins with "Of" or "What" is no phrase that stands alone; `found` and its
    like say how a value came about, and not what it is."""
    nodes = [node for tree in sources() for node in ast.walk(tree)]
    texts = [ast.get_docstring(n) or "" for n in nodes if isinstance(n, DOCUMENTED)]
    docstrings = sum(bool(re.match(r"(Of|What)\b", text)) for text in texts)
    names = sum(len(local_names(n) & VAGUE_NAMES) for n in nodes if isinstance(n, FUNCTIONS))
    assert (docstrings, names) == (VAGUE_DOCSTRINGS_LEFT, VAGUE_LOCALS_LEFT)
