"""Covariance of y - eta, measured less computed ln f, of a tyre without effects.

    Sigma = Sigma_rep + Sigma_form + sum_k s_k^2 g_k g_k^T

Sigma_rep: repeatability, with the part that all frequencies of a run share. Sigma_form: errors of
the model by mesh and element, mode by mode, and by material laws. Both are smooth
over the pressure and correlated between runs (0.97), the first also between rims (0.9). s_k:
standard deviation of a constant, g_k: d ln f by it, the same in all runs.

Errors of the model are standard deviations of ln f by the difference between model and tyre. Those
by mesh and element, per mode (`PERCENT`), were computed once by tests/studies/form_error.py. Two
laws of compounds and cords that agree at small strain differ as the pressure strains the tyre.
Their error (`MATERIAL_LAWS`) is the sum of three independent parts, each with the standard
deviation `MATERIAL_LAWS` and smooth over the pressure: one that all modes share (cords stretch in
all of them), one that a family shares (sidewalls shear in one, bend in the other), and one of each
mode. tests/studies/material_laws.py computed the smoothness with other laws of cords and rubber.
They moved all modes by 0.22 %, and single modes by 0.07 % more; 0.3 % leaves room for other laws.

No error of the model is taken from measured data.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...simulate.modes.label import Label
from .observations import Observable, Observations

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


# correlations of one mode's error on two rims (fixed, springs, free), and in two runs; assumed
BETWEEN_RIMS, BETWEEN_RUNS = 0.9, 0.97


@lru_cache(16)
def alike(rows: tuple[Observable, ...]) -> Array:
    """Correlation (n, n) of errors of single modes: 1 on the diagonal, 0 between modes."""
    rims = [row.rim for row in rows]
    between_rims = np.array([[1.0 if a == b else BETWEEN_RIMS for b in rims] for a in rims])
    smooth = at_pressures(_pressures_kPa(rows), FORM_LENGTH)
    result = of_one_mode(rows) * between_rims * smooth * between_runs(rows)
    result.flags.writeable = False
    return np.asarray(result)


def of_one_mode(rows: tuple[Observable, ...]) -> Array:
    """Whether two rows (n, n) are of one mode."""
    modes = [(row.label, row.quantity) for row in rows]
    return np.array([[a == b for b in modes] for a in modes])


@lru_cache(16)
def between_runs(rows: tuple[Observable, ...]) -> Array:
    """Correlation (n, n) by the runs alone, of an error that all modes and states share."""
    run = np.array([row.run for row in rows])
    result = np.where(run[:, None] == run, 1.0, BETWEEN_RUNS)
    result.flags.writeable = False  # the cache returns this very array
    return np.asarray(result)


@lru_cache(16)
def by_laws(rows: tuple[Observable, ...]) -> Array:
    """Covariance (n, n) of the error of material laws if each part of it (`laws_alike`) has the
    variance 1."""
    laws = laws_alike([row.label for row in rows], _pressures_kPa(rows))
    result = between_runs(rows) * laws
    result.flags.writeable = False
    return np.asarray(result)


def _pressures_kPa(rows: tuple[Observable, ...]) -> Array:
    """Pressures (n,); 1 for the mass, which has none, so that ln p is finite."""
    return np.array([row.pressure_kPa if row.label else 1.0 for row in rows])


def repeatability(observations: Observations) -> Array:
    """Sigma_rep (n, n). Rows with scatter 0 were not measured: they share no error of a run."""
    rows, scatter = observations.rows, observations.scatter
    run = np.array([row.run if row.label else -1 for row in rows])
    run = np.where(scatter > 0, run, -1)
    shared = (run[:, None] == run) & (run >= 0)[:, None]
    return np.diag(scatter**2) + observations.common**2 * shared


def model_form(rows: tuple[Observable, ...], laws: float, form: float | None = None) -> Array:
    """Sigma_form (n, n). laws: standard deviation of each part of the error of material laws; form:
    standard deviation of ln f of every mode, in place of ``laws`` and of `form_error`."""
    modes = np.array([row.label is not None for row in rows], float)  # no such error of the mass
    sizes = modes * [form_error(row.label) if form is None else form for row in rows]
    by_mesh = alike(rows) * np.outer(sizes, sizes)
    if form is not None:
        return by_mesh
    return np.asarray(by_mesh + laws**2 * by_laws(rows))


def covariance(
    observations: Observations,
    constants: Array,
    laws: float,
    form: float | None = None,
    mixed: Array | None = None,
) -> Array:
    """Sigma (n, n). constants (n, k): s_k g_k of the rows; laws, form: see `model_form`; mixed
    (n, n): d ln f of coupled by uncoupled modes, see `Veering.weights`."""
    rows = observations.rows
    model = model_form(rows, laws, form) + constants @ constants.T
    if mixed is not None:
        model = mixed @ model @ mixed.T
    smallest = 1e-12 * np.eye(len(rows))  # keeps Sigma positive definite
    return repeatability(observations) + model + smallest
