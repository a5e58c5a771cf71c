"""The case file: what a tyre is, as typed data."""

from .loaded import LoadedCase
from .mistakes import CaseError, Mistake
from .parts import as_written
from .schema import Case
from .variables import (
    number_at,
    overruled,
    parse_assignment,
    parse_setting,
    start_values,
    with_level,
)

__all__ = [
    "Case",
    "CaseError",
    "LoadedCase",
    "Mistake",
    "as_written",
    "number_at",
    "overruled",
    "parse_assignment",
    "parse_setting",
    "start_values",
    "with_level",
]
