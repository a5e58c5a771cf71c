"""How far the model may be off where nothing is wrong, ln f by ln f.

    Sigma = Sigma_rep + Sigma_form + sum_k s_k^2 g_k g_k^T

Sigma_rep: repeatability, with the part that all frequencies of a run share; Sigma_form: what our
own model is uncertain by (mesh, element), mode by mode, alike in all states (0.9) and in all
runs of the same tyre (0.97); s_k g_k: the constants that nobody calibrates, common to all runs.
"""

from __future__ import annotations

import numpy as np

from .form_error import form_error
from .observations import Observable, Observations

Array = np.ndarray
BETWEEN_PRESSURES, BETWEEN_RUNS = 0.9, 0.97


def alike(rows: tuple[Observable, ...]) -> Array:
    """Correlation (n, n) of what belongs to a mode: 1 on the diagonal, 0 between modes."""
    result = np.zeros((len(rows), len(rows)))
    for i, a in enumerate(rows):
        for j, b in enumerate(rows):
            if a.label == b.label and a.quantity == b.quantity:
                result[i, j] = BETWEEN_PRESSURES if a.state != b.state else 1.0
                result[i, j] *= BETWEEN_RUNS if a.run != b.run else 1.0
    return result


def repeatability(observations: Observations) -> Array:
    """Sigma_rep (n, n)."""
    rows = observations.rows
    run = np.array([row.run if row.label else -1 for row in rows])
    shared = (run[:, None] == run) & (run >= 0)[:, None]
    return np.diag(observations.scatter**2) + observations.common**2 * shared


def covariance(
    observations: Observations,
    constants: Array,
    form: float | None = None,
    mixed: Array | None = None,
) -> Array:
    """Sigma (n, n). constants (n, k): s_k g_k of the rows; form: one relative standard deviation
    of the model for all modes, None = those on record; mixed (n, n): of coupled modes, see
    `Veering.weights`."""
    rows = observations.rows
    sizes = np.array([form_error(row.label) if form is None else form for row in rows])
    sizes[[row.label is None for row in rows]] = 0.0  # the mass is a sum: no error of form
    model = alike(rows) * np.outer(sizes, sizes) + constants @ constants.T
    if mixed is not None:
        model = mixed @ model @ mixed.T
    return repeatability(observations) + model + 1e-12 * np.eye(len(rows))
