"""A case file read, judged and varied, and its tyre resolved."""

from .load import load_case, validate
from .tyre import Tyre, resolved
from .values import overridden, set_values, unusual_value, with_values

__all__ = [
    "Tyre",
    "load_case",
    "overridden",
    "resolved",
    "set_values",
    "unusual_value",
    "validate",
    "with_values",
]
