"""Help for editors that complete and check the keys of a case file: a JSON schema in its folder,
and the line of the case that names it."""

from __future__ import annotations

from typing import Any

from ...files import json_text
from . import parts, schema
from .meanings import meanings
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
