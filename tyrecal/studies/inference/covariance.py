"""Covariance of y - eta, measured less computed ln f, of a tyre without effects.

    Sigma = Sigma_rep + Sigma_form + sum_k s_k^2 g_k g_k^T

Sigma_rep: repeatability, with the part that all frequencies of a run share. Sigma_form: errors of
the model (`form_error`) by mesh and element, mode by mode, and by material laws. Both are smooth
over the pressure and correlated between runs (0.97), the first also between rims (0.9). s_k:
standard deviation of a constant, g_k: d ln f by it, the same in all runs.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .form_error import FORM_LENGTH, at_pressures, form_error, laws_alike
from .observations import Observable, Observations

Array = np.ndarray
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
