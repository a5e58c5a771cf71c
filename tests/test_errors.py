"""The tree of errors is as its drawing says, and nothing beside it is told in one sentence."""

from __future__ import annotations

import importlib
import pkgutil
import re

import tyrecal
from tyrecal import errors


def drawn() -> dict[str, tuple[str, int]]:
    """Name to parent and exit code, as the drawing has them; a child has its parent's code."""
    found: dict[str, tuple[str, int]] = {}
    above: list[tuple[int, str]] = []
    for indent, name, code in re.findall(
        r"^( {4,})([A-Z]\w+)(?:, (\d))?(?: {2,}|$)", errors.__doc__ or "", re.M
    ):
        above = [(depth, parent) for depth, parent in above if depth < len(indent)]
        parent = above[-1][1] if above else "Exception"
        found[name] = parent, int(code or found.get(parent, ("", 2))[1])
        above.append((len(indent), name))
    return found


def test_the_drawing_is_the_tree() -> None:
    for module in pkgutil.walk_packages(tyrecal.__path__, "tyrecal."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    tree: dict[str, tuple[str, int]] = {}
    waiting: list[type[errors.TyrecalError]] = [errors.TyrecalError]
    while waiting:
        kind = waiting.pop()
        tree[kind.__name__] = kind.__bases__[0].__name__, kind.exit_code
        waiting += kind.__subclasses__()
    assert tree == drawn()
