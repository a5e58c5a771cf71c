"""How far the model may be off where nothing is wrong, ln f by ln f.

    Sigma = Sigma_rep + Sigma_form + sum_k s_k^2 g_k g_k^T

Sigma_rep: repeatability, with the part that all frequencies of a run share; Sigma_form: what our
own model is uncertain by: mesh and element, mode by mode and alike in all states (0.9), and
material laws (`laws_alike`), both alike in all runs of the same tyre (0.97); s_k g_k: the constants
that nobody calibrates, common to all runs.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .form_error import form_error, laws_alike
from .observations import Observable, Observations

Array = np.ndarray
BETWEEN_PRESSURES, BETWEEN_RUNS = 0.9, 0.97


@lru_cache(16)
def alike(rows: tuple[Observable, ...]) -> Array:
    """Correlation (n, n) of what belongs to a mode: 1 on the diagonal, 0 between modes."""
    result = np.zeros((len(rows), len(rows)))
    for i, a in enumerate(rows):
        for j, b in enumerate(rows):
            if a.label == b.label and a.quantity == b.quantity:
                result[i, j] = 1.0 if a.state == b.state else BETWEEN_PRESSURES
    result *= between_runs(rows)
    result.flags.writeable = False
    return result


@lru_cache(16)
def between_runs(rows: tuple[Observable, ...]) -> Array:
    """The same (n, n) of what is alike in all modes and states."""
    run = np.array([row.run for row in rows])
    result = np.where(run[:, None] == run, 1.0, BETWEEN_RUNS)
    result.flags.writeable = False  # kept for all who ask
    return np.asarray(result)


@lru_cache(16)
def by_laws(rows: tuple[Observable, ...]) -> Array:
    """What material laws do (n, n), by the variance of each part; see `laws_alike`."""
    pressures = np.array([row.pressure_kPa if row.label else 1.0 for row in rows])
    result = between_runs(rows) * laws_alike([row.label for row in rows], pressures)
    result.flags.writeable = False
    return np.asarray(result)


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
