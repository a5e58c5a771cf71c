"""The schema of a case applied to plain data: mistakes in the words of a user, types and defaults.

Checks go on after a mistake: `without` puts WRONG in place of a wrong value, and later checks skip
it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from .mistakes import CaseData, Keys, suggestion
from .parts import (
    NUMBER_OR_TABLE,
    WRONG,
    Cord,
    DeckSource,
    Part,
    RebarLayer,
    Rim,
    Rubber,
    SectionSource,
)
from .schema import Case, Road, TargetFootprint, TargetMode, Targets, Uncertainty, Variable

UNIONS = (Union, UnionType)
KINDS: dict[str, type[BaseModel]] = {"rubber": Rubber, "cord": Cord}
SINGLE: dict[str, type[Part]] = {  # parts with checks of their own, once in a case, by key
    "section": SectionSource,
    "deck": DeckSource,
    "rim": Rim,
    "road": Road,
    "targets": Targets,
}
MESSAGES = {  # by pydantic's type of an error
    "missing": "must be given",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "finite_number": "must be a finite number",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must be at least {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must be at most {le:g}",
    "string_type": "must be text",
    "literal_error": "must be {expected}",
    "union_tag_invalid": "must be {expected_tags}",
    "union_tag_not_found": "must be given: 'rubber' or 'cord'",
    "list_type": "must be a list, as in [1, 2]",
    "dict_type": "must be a table of keys and values",
    "model_type": "must be a table of keys and values",
    "model_attributes_type": "must be a table of keys and values",
    "too_short": "must have at least {min_length} entries, got {actual_length}",
    "too_long": "must have at most {max_length} entries, got {actual_length}",
    "string_too_long": "must have at most {max_length} characters",
    "disagree": "{message}",
}
NAME = "must be one word of letters, digits, - and _, a letter first"
ONE_LINE = "must be text without line breaks, control characters or marks of direction"


def explain(
    error: ValidationError, start: Keys = (), known: Iterable[str] | None = None
) -> Iterator[tuple[Keys, str]]:
    """Keys and message of each mistake in the part at ``start`` of the case. For another file,
    ``known``: its keys, to suggest one for an unknown key."""
    for item in error.errors(include_url=False, include_input=False):
        keys, kind, context = (*start, *item["loc"]), item["type"], item.get("ctx", {})
        material: type[BaseModel] | None = None
        if keys[:1] == ("materials",) and len(keys) > 2 and keys[2] in KINDS:
            # pydantic names the kind between the material and its key
            keys, material = (*keys[:2], *keys[3:]), KINDS[str(keys[2])]
        if "loss_factor" in keys:  # pydantic names its type, too
            keys = tuple(key for key in keys if key not in NUMBER_OR_TABLE)
        if keys[-1:] == ("[key]",):
            yield keys[:-1], NAME
        elif kind == "extra_forbidden":
            names = fields_at(keys[:-1], material) if known is None else known
            yield keys, f"is not a known key{suggestion(str(keys[-1]), names)}"
        elif kind.startswith("union_tag"):
            yield (*keys, "kind"), MESSAGES[kind].format(**context)
        elif kind == "disagree":
            yield (*keys, context["key"]), context["message"]
        elif kind == "string_pattern_mismatch":
            yield keys, NAME if "A-Za-z" in context["pattern"] else ONE_LINE
        else:
            yield keys, MESSAGES[kind].format(**context) if kind in MESSAGES else item["msg"]


def type_at(keys: Keys) -> Any:
    """The type of the value at ``keys`` in the schema; None if it does not have these keys."""
    here: Any = Case
    for key in keys:
        here = _plain(here)
        if get_origin(here) in (dict, list):
            here = get_args(here)[-1]
        else:
            parts = get_args(here) if get_origin(here) in UNIONS else (here,)
            fields = (getattr(part, "model_fields", {}).get(key) for part in parts)
            here = next((field.annotation for field in fields if field), None)
    return _plain(here)


def _plain(annotation: Any) -> Any:
    """The annotation without Annotated and None; a material stays a union of its kinds."""
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) in UNIONS:
        choices = [a for a in get_args(annotation) if a is not type(None)]
        return _plain(choices[0]) if len(choices) == 1 else annotation
    return annotation


def fields_at(keys: Keys, material: type[BaseModel] | None = None) -> list[str]:
    """Names of the fields of the part at ``keys``, of a material those of its type ``material``."""
    part = material if material and len(keys) == 2 else type_at(keys)
    return list(getattr(part, "model_fields", {}))


def with_defaults(data: Any, kind: Any = Case) -> Any:
    """Plain data of the type ``kind`` with the schema's defaults for missing keys."""
    kind = _plain(kind)
    if get_origin(kind) is dict and isinstance(data, dict):
        return {key: with_defaults(value, get_args(kind)[-1]) for key, value in data.items()}
    if get_origin(kind) is list and isinstance(data, list):
        return [with_defaults(value, get_args(kind)[0]) for value in data]
    if get_origin(kind) in UNIONS and isinstance(data, dict):
        kind = next((each for name, each in KINDS.items() if data.get("kind") == name), None)
    if not (isinstance(kind, type) and issubclass(kind, BaseModel) and isinstance(data, dict)):
        return data
    full = dict(data)
    for name, field in kind.model_fields.items():
        if name in data:
            full[name] = with_defaults(data[name], field.annotation)
        elif not field.is_required():
            default = field.get_default(call_default_factory=True)
            full[name] = default.model_dump() if isinstance(default, BaseModel) else default
    return full


def disagreements(data: CaseData) -> Iterator[tuple[Keys, str]]:
    """Keys and messages of values that contradict other values of the same part; WRONG ones are
    skipped."""
    parts: list[tuple[Keys, Any, type[Any]]] = []
    for name, part in table(data, "materials").items():
        if isinstance(part, dict) and part.get("kind") == "rubber":
            parts.append((("materials", name), part, Rubber))
    parts += [(("rebar_layers", k), v, RebarLayer) for k, v in table(data, "rebar_layers").items()]
    parts += [(("variables", k), v, Variable) for k, v in table(data, "variables").items()]
    parts += [
        (("uncertainties", k), v, Uncertainty) for k, v in table(data, "uncertainties").items()
    ]
    for key, kind in (("modes", TargetMode), ("footprint", TargetFootprint)):
        for i, target in enumerate(entries(table(data, "targets"), key)):
            parts.append((("targets", key, i), target, kind))

    parts += [((key,), data.get(key), kind) for key, kind in SINGLE.items()]
    parts.append(((), data, Case))
    for keys, part, kind in parts:
        if isinstance(part, dict):
            for key, message in kind.problems(part):
                yield (*keys, key), message


def table(data: Any, key: str) -> dict[str, Any]:
    """The mapping at ``key``, empty when it is absent or wrong."""
    value = data.get(key) if isinstance(data, dict) else None
    return value if isinstance(value, dict) else {}


def entries(data: Any, key: str) -> list[Any]:
    """The list at ``key``, empty when it is absent or wrong."""
    value = data.get(key) if isinstance(data, dict) else None
    return value if isinstance(value, list) else []


def without(data: dict[str, Any], mistakes: list[Keys]) -> None:
    """Put WRONG in place of every value at the keys ``mistakes``, in ``data`` itself."""
    for keys in mistakes:
        here: Any = data
        for key in keys[:-1]:
            here = here[key] if _holds(here, key) else None
        if isinstance(here, dict) or _holds(here, keys[-1]):
            here[keys[-1]] = WRONG


def _holds(part: Any, key: str | int) -> bool:
    if isinstance(part, list):
        return isinstance(key, int) and key < len(part)
    return isinstance(part, dict) and key in part
