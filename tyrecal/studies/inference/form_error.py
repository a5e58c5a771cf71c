"""Model-form error: standard deviation of ln f by the difference between model and tyre.

By mesh and element, per mode (`PERCENT`): computed once by tests/studies/form_error.py.

By the material laws of compounds and cords: two laws that agree at small strain differ as the
pressure strains the tyre. Their error is the sum of three independent parts, each with the standard
deviation `MATERIAL_LAWS` and smooth over the pressure: one that all modes share (cords stretch in
all of them), one that a family shares (sidewalls shear in one, bend in the other), and one of each
mode. tests/studies/material_laws.py computed the smoothness with other laws of cords and rubber.
They moved all modes by 0.22 %, and single modes by 0.07 % more; 0.3 % leaves room for other laws.

Nothing is taken from measured data.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...simulate.modes.label import Label

Array = np.ndarray
PERCENT = {  # standard deviation of ln f by mesh and element, per cent
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
OTHERS = 0.44  # per cent, of all other modes: the largest of `PERCENT`
# correlation length of these errors over ln p, l of `at_pressures`; computed with them
FORM_LENGTH = 0.54
# standard deviation of ln f by each of the three parts of the error of material laws, of a measured
# tyre; by judgement
MATERIAL_LAWS = 0.003
LAWS_LENGTH = 0.8  # correlation length of that error over ln p, computed


def form_error(label: Label | None) -> float:
    """Standard deviation of a mode's ln f by mesh and element; 0 for the mass (None)."""
    return 0.0 if label is None else PERCENT.get(str(label), OTHERS) / 100


def at_pressures(pressures_kPa: Array, length: float) -> Array:
    """Correlation (n, n) of what changes smoothly with the pressure, at pressures (n,):
    exp(-(ln p - ln p')^2 / (2 l^2)), l = ``length``."""
    far = np.log(pressures_kPa[:, None] / pressures_kPa)
    return np.asarray(np.exp(-(far**2) / (2 * length**2)))


def laws_alike(labels: Sequence[Label | None], pressures_kPa: Array) -> Array:
    """Covariance (n, n) of the error of material laws in ln f at pressures (n,) if each of its
    three parts has the variance 1; 0 for the mass (label None)."""
    modes = np.array([label is not None for label in labels], float)
    of_families = _same([label and label.family for label in labels])
    alike = np.outer(modes, modes) + of_families + _same(labels)
    return np.asarray(alike * at_pressures(pressures_kPa, LAWS_LENGTH))


def _same(of: Sequence[object]) -> Array:
    """1 where two are the same (n, n), 0 if they differ or are None."""
    return np.array([[float(a is not None and a == b) for b in of] for a in of])
