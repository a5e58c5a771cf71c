"""The meaning of each key of a file: the comment of its field, above or behind it.

The schema for editors (`editor`) and the reference of the documentation (`cases/site`) have their
words from here, so a comment of a field is written for users.
"""

from __future__ import annotations

import ast
import sys
from functools import cache
from pathlib import Path


@cache
def meanings(model: type) -> dict[str, str]:
    """The meaning of each field of a class of ours, those of its bases too, by name."""
    by_name: dict[str, str] = {}
    for base in (each for each in model.__bases__[::-1] if each.__module__.startswith("tyrecal")):
        by_name |= meanings(base)
    lines, classes = _source(model.__module__)
    for node in classes[model.__name__].body:
        if isinstance(node, ast.AnnAssign):
            first = node.lineno - 1
            while lines[first - 1].lstrip().startswith("#"):
                first -= 1
            behind = lines[(node.end_lineno or 1) - 1].encode()[node.end_col_offset :].decode()
            text = [line.strip(" #") for line in (*lines[first : node.lineno - 1], behind)]
            if any(text):
                by_name[ast.unparse(node.target)] = " ".join(filter(None, text))
    return by_name


@cache
def _source(module: str) -> tuple[list[str], dict[str, ast.ClassDef]]:
    """The lines of a module, and its classes by name."""
    text = Path(sys.modules[module].__file__ or "").read_text(encoding="utf-8")
    classes = (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ClassDef))
    return text.splitlines(), {node.name: node for node in classes}
