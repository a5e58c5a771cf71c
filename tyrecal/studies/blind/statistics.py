"""Exact bounds, calibration of stated probabilities, and its measure by chance alone."""

from __future__ import annotations

import numpy as np
from scipy.stats import binomtest

Array = np.ndarray
BINS, SIMULATIONS = 10, 2000  # of stated probabilities, 0 to 1; draws of the quantile


def clopper_pearson(right: int, count: int) -> tuple[float, float]:
    """Exact 95 % interval of a binomial share (Clopper and Pearson 1934); (0, 1) of none."""
    if not count:
        return 0.0, 1.0
    interval = binomtest(right, count).proportion_ci(0.95)
    return float(interval.low), float(interval.high)


def calibration_error(stated: Array, right: Array) -> float:
    """ECE: mean over trials of |share right - mean stated| in ten bins of what was stated."""
    return float(_calibration_errors(stated, right[None])[0])


def _calibration_errors(stated: Array, right: Array) -> Array:
    """ECE (k,) of each row of ``right`` (k, n), trials of one and the same ``stated`` (n,)."""
    place = np.minimum((stated * BINS).astype(int), BINS - 1)
    in_bin = (place[:, None] == np.arange(BINS)).astype(float)
    return np.asarray(abs((right - stated) @ in_bin).sum(1) / max(len(stated), 1))


def calibration_quantile(stated: Array, quantile: float = 0.95) -> float:
    """Quantile of the ECE of as many trials whose stated probabilities are exactly right."""
    random = np.random.default_rng(0)
    drawn = random.random((SIMULATIONS, len(stated))) < stated
    return float(np.quantile(_calibration_errors(stated, drawn), quantile))
