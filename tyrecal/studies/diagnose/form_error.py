"""Model-form error: standard deviation of ln f by what our own model is another than the tyre.

By mesh and element, per mode: computed once by tests/studies/form_error.py, which says how. By the
laws of compounds and cords: two that agree at small strain part as the pressure strains them, one
mode another way than the next, and smoothly (tests/benchmarks/FENICS.md: by 0.1 to 0.5 % at 160 to
320 kPa). Neither is taken from measured data.
"""

from __future__ import annotations

import numpy as np

from ...simulate.modes.label import Label

Array = np.ndarray
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
MATERIAL_LAWS = 0.003  # of every mode of a tyre that is none of our own computing, by judgement
LAWS_LENGTH = 0.5  # l, of ln p


def form_error(label: Label | None) -> float:
    """Relative standard deviation of a mode's frequency; 0 for what is no mode."""
    return 0.0 if label is None else PERCENT.get(str(label), OTHERS) / 100


def laws_alike(pressures_kPa: Array) -> Array:
    """Correlation (n, n) of what laws do to a mode at pressures (n,):
    exp(-(ln p - ln p')^2 / (2 l^2))."""
    far = np.log(pressures_kPa[:, None] / pressures_kPa)
    return np.asarray(np.exp(-(far**2) / (2 * LAWS_LENGTH**2)))
