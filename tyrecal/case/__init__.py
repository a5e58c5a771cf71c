"""The case file: what a tyre is, read, judged and varied."""

from .load import LoadedCase, load_case, validate
from .mistakes import CaseError, Mistake
from .schema import Case
from .variables import (
    number_at,
    overridden,
    overruled,
    parse_assignment,
    start_values,
    unusual_value,
    with_level,
    with_values,
)

__all__ = [
    "Case",
    "CaseError",
    "LoadedCase",
    "Mistake",
    "load_case",
    "number_at",
    "overridden",
    "overruled",
    "parse_assignment",
    "start_values",
    "unusual_value",
    "validate",
    "with_level",
    "with_values",
]
