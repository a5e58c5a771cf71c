"""How far the model may be off where nothing is wrong, ln f by ln f.

    Sigma = Sigma_rep + Sigma_form + sum_k s_k^2 g_k g_k^T

Sigma_rep: repeatability, with the part that all frequencies of a run share; Sigma_form: what our
own model is uncertain by: mesh and element, mode by mode, smoothly over the pressure and alike on
other rims (0.9), and material laws (`laws_alike`), both alike in all runs of the same tyre (0.97);
s_k g_k: the constants that nobody calibrates, common to all runs.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from .form_error import FORM_LENGTH, at_pressures, form_error, laws_alike
from .observations import Observable, Observations

Array = np.ndarray
BETWEEN_SUPPORTS, BETWEEN_RUNS = 0.9, 0.97  # correlations of one mode's errors in two


@lru_cache(16)
def alike(rows: tuple[Observable, ...]) -> Array:
    """Correlation (n, n) of what belongs to a mode: 1 on the diagonal, 0 between modes."""
    held = [replace(row.state, pressure_kPa=None) for row in rows]
    alike_held = np.array([[1.0 if a == b else BETWEEN_SUPPORTS for b in held] for a in held])
    smooth = at_pressures(_pressures_kPa(rows), FORM_LENGTH)
    result = of_one_mode(rows) * alike_held * smooth * between_runs(rows)
    result.flags.writeable = False
    return np.asarray(result)


def of_one_mode(rows: tuple[Observable, ...]) -> Array:
    """Whether two rows (n, n) are of one mode."""
    modes = [(row.label, row.quantity) for row in rows]
    return np.array([[a == b for b in modes] for a in modes])


@lru_cache(16)
def between_runs(rows: tuple[Observable, ...]) -> Array:
    """Correlation (n, n) of an error that is alike in all modes and states, within and between
    runs."""
    run = np.array([row.run for row in rows])
    result = np.where(run[:, None] == run, 1.0, BETWEEN_RUNS)
    result.flags.writeable = False  # kept for all who ask
    return np.asarray(result)


@lru_cache(16)
def by_laws(rows: tuple[Observable, ...]) -> Array:
    """Covariance (n, n) of the errors of material laws, by the variance of each part; see
    `laws_alike`."""
    laws = laws_alike([row.label for row in rows], _pressures_kPa(rows))
    result = between_runs(rows) * laws
    result.flags.writeable = False
    return np.asarray(result)


def _pressures_kPa(rows: tuple[Observable, ...]) -> Array:
    """(n,), 1 of a mass, which has none."""
    return np.array([row.pressure_kPa if row.label else 1.0 for row in rows])


def repeatability(observations: Observations) -> Array:
    """Sigma_rep (n, n); rows without scatter were not measured."""
    rows, scatter = observations.rows, observations.scatter
    run = np.array([row.run if row.label else -1 for row in rows])
    run = np.where(scatter > 0, run, -1)
    shared = (run[:, None] == run) & (run >= 0)[:, None]
    return np.diag(scatter**2) + observations.common**2 * shared


def model_form(rows: tuple[Observable, ...], laws: float, form: float | None = None) -> Array:
    """Sigma_form (n, n). laws: standard deviation of each part of what material laws do; form: one
    of the model for all modes in place of it and of those on record."""
    modes = np.array([row.label is not None for row in rows], float)  # the mass is a sum
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
    (n, n): of coupled modes, see `Veering.weights`."""
    rows = observations.rows
    model = model_form(rows, laws, form) + constants @ constants.T
    if mixed is not None:
        model = mixed @ model @ mixed.T
    return repeatability(observations) + model + 1e-12 * np.eye(len(rows))
