"""Model-form error: standard deviation of ln f by what our own model is another than the tyre.

By mesh and element, per mode: computed once by tests/studies/form_error.py, which says how. By the
laws of compounds and cords: two that agree at small strain part as the pressure strains them, and
smoothly: partly alike in all modes, as cords stretch in all of them, partly alike in a family, as
sidewalls shear in one and bend in the other, partly one mode another way than the next. Over which
pressures that is alike is computed by tests/studies/material_laws.py with other laws for cords and
rubber: these move all modes by 0.22 % and single ones beside that by 0.07 %, where 0.3 % of each
leave room for laws that nobody tried. Nothing is taken from measured data.
"""

from __future__ import annotations

from collections.abc import Sequence

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
# l, of ln p, over which that is alike, computed with them
FORM_LENGTH = 0.54
# of ln f of a tyre that is none of our own computing, by judgement, each: what all modes share,
# what a family's do, and what is a mode's own
MATERIAL_LAWS = 0.003
LAWS_LENGTH = 0.8  # l, of ln p, computed


def form_error(label: Label | None) -> float:
    """Relative standard deviation of a mode's frequency; 0 for what is no mode."""
    return 0.0 if label is None else PERCENT.get(str(label), OTHERS) / 100


def at_pressures(pressures_kPa: Array, length: float) -> Array:
    """Correlation (n, n) of what changes smoothly with the pressure, at pressures (n,):
    exp(-(ln p - ln p')^2 / (2 l^2)), l = ``length``."""
    far = np.log(pressures_kPa[:, None] / pressures_kPa)
    return np.asarray(np.exp(-(far**2) / (2 * length**2)))


def laws_alike(labels: Sequence[Label | None], pressures_kPa: Array) -> Array:
    """Covariance (n, n) of what laws do to modes at pressures (n,), each part of variance 1: over
    all modes, within a family, and within a mode; 0 of what is no mode."""
    modes = np.array([label is not None for label in labels], float)
    of_families = _same([label and label.family for label in labels])
    alike = np.outer(modes, modes) + of_families + _same(labels)
    return np.asarray(alike * at_pressures(pressures_kPa, LAWS_LENGTH))


def _same(of: Sequence[object]) -> Array:
    """1 where two are the same (n, n), 0 where they are not or are None."""
    return np.array([[float(a is not None and a == b) for b in of] for a in of])
