"""Posteriors that are known: of a linear tyre in closed form, and of one with two optima."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.emulator import Evaluated, fitted, spread
from tyrecal.studies.sample.posterior import Posterior
from tyrecal.studies.variable import DesignVariable

Array = np.ndarray
LABELS = (Label(1, 0), Label(2, 0), Label(3, 0))
J = np.array([[0.5, 0.1], [0.2, -0.4], [0.1, 0.3]])
VARIABLES = (DesignVariable("A", 1.0, 1e-3, 1e3), DesignVariable("B", 0.5, -50.0, 51.0, False))
BOUNDS = np.array([[np.log(1e-3), np.log(1e3)], [0.0, 1.0]])
SIGMA = np.array([0.01, 0.02, 0.015])


def posterior(
    box: Array, eta: Callable[[Array], Array] | None = None, y: Array | None = None
) -> Posterior:
    """Posterior of a tyre with ln f = 4 + J x, or another, measured at x = (0, 0.5)."""
    t = spread(14, 2)
    centre, half = box.mean(1), np.ptp(box, axis=1) / 2
    if eta is None:
        eta = lambda x: 4 + x @ J.T
    x, samples = centre + half * t, []
    named = lambda each: dict(zip(LABELS, each, strict=True))
    for each in x:
        rise = np.array([(eta(each + e) - eta(each - e)) / 2e-4 for e in 1e-4 * np.eye(2)]).T
        samples.append(Evaluated(each, named(eta(each)), named(rise), 0.0))
    made = fitted(VARIABLES, LABELS, centre, half, samples)
    rows = np.array([[0, i] for i in range(3)])
    values = eta(np.array([0.0, 0.5])) if y is None else y
    return Posterior((made,), np.zeros((1, 1)), rows, values, np.diag(1 / SIGMA), box)


COVARIANCE = np.linalg.inv((J.T / SIGMA**2) @ J)
WIDTH = np.sqrt(np.diag(COVARIANCE))
CENTRE = np.array([0.0, 0.5])
WIDE = np.stack([CENTRE - 7 * WIDTH, CENTRE + 7 * WIDTH], 1)


def two_valleys(x: Array) -> Array:
    """The same frequencies at x and at its mirror image."""
    A = x[..., 0] - 0.0
    return np.stack([4 + A**2, 4 + x[..., 1] + 0.02 * A, 5 - x[..., 1]], -1)
