"""The case file: what a tyre is, as typed data."""

from .loaded import LoadedCase
from .mistakes import CaseError, Mistake
from .schema import Case
from .variables import as_written, number_at, overruled, parse_assignment, start_values, with_level

__all__ = [
    "Case",
    "CaseError",
    "LoadedCase",
    "Mistake",
    "as_written",
    "number_at",
    "overruled",
    "parse_assignment",
    "start_values",
    "with_level",
]
