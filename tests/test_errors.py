"""The trees of errors are as their drawings say, few, and nothing beside them is an error."""

from __future__ import annotations

import ast
import builtins
import importlib
import re
from functools import cache

import pytest
import tyrecal_solvers.errors

from tyrecal import errors
from tyrecal.errors import TyrecalError

from .test_architecture import modules, tree

BUILTIN = {name for name, kind in vars(builtins).items() if isinstance(kind, type)}


def drawn(text: str) -> dict[str, tuple[str, str]]:
    """Name to parent and exit code, as a drawing has them; a child has its parent's code."""
    result: dict[str, tuple[str, str]] = {}
    above: list[tuple[int, str]] = []
    for indent, name, code in re.findall(
        r"^( {4,})([A-Z]\w+)(?:, (\d))?(?: {2,}|$)", text, re.MULTILINE
    ):
        above = [(depth, parent) for depth, parent in above if depth < len(indent)]
        parent = above[-1][1] if above else ""
        result[name] = parent, code or result.get(parent, ("", "2"))[1]
        above.append((len(indent), name))
    return result


@cache
def exceptions() -> dict[str, tuple[str, str]]:
    """Name to module and first base of every class that is an exception, wherever it is defined."""
    classes: dict[str, tuple[str, str]] = {}
    for module, path in modules().items():
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ClassDef) and node.bases:
                classes[node.name] = module, ast.unparse(node.bases[0])
    result: dict[str, tuple[str, str]] = {}
    while new := {
        name: (module, base)
        for name, (module, base) in classes.items()
        if name not in result
        and (
            base in result or (base in BUILTIN and issubclass(vars(builtins)[base], BaseException))
        )
    }:
        result |= new
    return result


def test_all_exceptions_are_drawn() -> None:
    """The tree of the package that defines an exception shows it below its parent."""
    for top, text in (("tyrecal", errors.__doc__), ("tyrecal_solvers", solvers_text())):
        tree = drawn(text or "")
        own = {n: base for n, (m, base) in exceptions().items() if m.split(".")[0] == top}
        assert own.keys() == tree.keys()
        for name, base in own.items():
            assert tree[name][0] == ("" if base in BUILTIN else base), name


def solvers_text() -> str | None:
    """The drawing of the solvers' errors."""
    return tyrecal_solvers.errors.__doc__


def test_they_are_few() -> None:
    assert len(exceptions()) <= 20


@pytest.mark.parametrize("name", sorted(drawn(errors.__doc__ or "")))
def test_the_exit_codes_are_the_drawn_ones(name: str) -> None:
    kind = getattr(importlib.import_module(exceptions()[name][0]), name)
    assert issubclass(kind, TyrecalError)
    assert kind.exit_code == int(drawn(errors.__doc__ or "")[name][1])
