"""Model-form error: standard deviation of ln f by mesh and element of our own model, per mode.

Computed once by tests/studies/form_error.py, which says how; never from measured data.
"""

from __future__ import annotations

from ...simulate.modes.label import Label

PERCENT = {
    "[0,0] axial": 0.13,
    "[0,0] torsional": 0.44,
    "[1,0]": 0.18,
    "[1,1]": 0.26,
    "[2,0]": 0.15,
    "[2,1]": 0.10,
    "[3,0]": 0.10,
    "[3,1]": 0.19,
    "[4,0]": 0.11,
    "[4,1]": 0.20,
    "[5,0]": 0.14,
    "[5,1]": 0.18,
    "[6,0]": 0.16,
    "[6,1]": 0.16,
}
OTHERS = 0.44  # of modes that the study has not: as the worst of those that it has


def form_error(label: Label | None) -> float:
    """Relative standard deviation of a mode's frequency; 0 for what is no mode."""
    return 0.0 if label is None else PERCENT.get(str(label), OTHERS) / 100
