"""Model-form error: standard deviation of ln f by mesh and element of our own model, per mode.

Computed once by tests/studies/form_error.py, which says how; never from measured data.
"""

from __future__ import annotations

from ..modes.mode import Label

PERCENT = {  # placeholder values until the study has run
}
OTHERS = 0.3  # of modes that the study has not


def form_error(label: Label | None) -> float:
    """Relative standard deviation of a mode's frequency; 0 for what is no mode."""
    return 0.0 if label is None else PERCENT.get(str(label), OTHERS) / 100
