"""Help for editors that complete and check the keys of a case file: a JSON schema in its folder,
and the line of the case that names it.

The meaning of each key is the comment of its field, above or behind it. The schema and the
reference of the documentation (`cases/site`) have their words from there, so a comment of a field
is written for users.
"""

from __future__ import annotations

import ast
import sys
from functools import cache
from pathlib import Path
from typing import Any

from ...files import json_text
from . import parts, schema
from .schema import Case

SCHEMA_FILE = "case.schema.json"
LIMITS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
EDITOR_LINE = f"# yaml-language-server: $schema={SCHEMA_FILE}\n"


def with_editor_line(text: str) -> str:
    """The text of a case whose editor finds the schema next to it."""
    return text if EDITOR_LINE.strip() in text else EDITOR_LINE + text


def case_schema() -> str:
    """The JSON schema of a case: keys with their meanings, types, ranges, words and defaults. What
    depends on several keys only `tyrecal validate` checks."""
    whole = Case.model_json_schema()
    for name, part in {"Case": whole, **whole["$defs"]}.items():
        words = meanings(getattr(schema, name, None) or getattr(parts, name))
        for key, entry in part.get("properties", {}).items():
            entry["description"] = words[key]
    needed = {"required": whole.pop("required")}  # a deck's case may leave all else to its deck
    whole |= {"required": ["format"], "if": {"not": {"required": ["deck"]}}, "then": needed}
    del whole["$defs"]["DeckSource"]["required"]  # units, which the deck's densities show
    return json_text(_in_words_of_schemas(whole))


def _in_words_of_schemas(value: Any) -> Any:
    """A schema of Pydantic's with JSON Schema's names of limits, and without titles, which only
    repeat the keys."""
    if isinstance(value, list):
        return [_in_words_of_schemas(each) for each in value]
    if not isinstance(value, dict):
        return value
    return {
        LIMITS.get(key, key): _in_words_of_schemas(each)
        for key, each in value.items()
        if key != "title" or not isinstance(each, str)
    }


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
