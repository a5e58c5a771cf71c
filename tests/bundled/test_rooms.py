"""The solver's rooms: imports between them run only downwards, and nobody imports in a circle."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import tyrecal_solvers.bundled

TOP = Path(tyrecal_solvers.bundled.__file__).parent
FLOORS = [["deck"], ["section"], ["modes", "solid3d"], ["nonuniform", "road"], [""]]
FLOOR = {room: i for i, rooms in enumerate(FLOORS) for room in rooms}


def imports(path: Path) -> set[Path]:
    """The solver's files that a file imports."""
    paths = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            modules = [folder / name.name for name in node.names] if folder.is_dir() else [folder]
            paths |= {m.with_suffix(".py") for m in modules if m.with_suffix(".py").exists()}
    return {path for path in paths if path.is_relative_to(TOP)}  # not what all solvers share


def room(path: Path) -> str:
    return path.relative_to(TOP).parts[0] if path.parent != TOP else ""


def test_imports_run_downwards() -> None:
    graph = {path: imports(path) for path in TOP.rglob("*.py")}
    for path, needed in graph.items():
        for other in needed:
            here, there = room(path), room(other)
            assert here == there or FLOOR[there] < FLOOR[here], (path, other)
    assert sum(map(len, graph.values())) > 100  # the reading of imports works
    TopologicalSorter(graph).prepare()


def test_at_most_seven_rooms_at_first_sight() -> None:
    folders = {path.name for path in TOP.iterdir() if (path / "__init__.py").exists()}
    assert folders == set(FLOOR) - {""} and len(folders) <= 7
