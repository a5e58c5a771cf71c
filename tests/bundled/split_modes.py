"""Modes of tyres that are not the same all round, and those of the plain tyre in their order."""

from __future__ import annotations

import numpy as np
from tyrecal_solvers.bundled.modes import harmonics
from tyrecal_solvers.bundled.modes.harmonics import Vibration

Array = np.ndarray
WAVES, COUNT = [0, 1, 2, 3], 2


def frequencies(modes: list[harmonics.HarmonicModes]) -> Array:
    return np.concatenate([m.eigenvalues for m in modes])


def plain(vibration: Vibration) -> Array:
    """omega^2 of the plain tyre, each doublet twice, in the order of the split ones."""
    return plain_of(vibration, WAVES)


def plain_of(vibration: Vibration, waves: list[int]) -> Array:
    each = [(n, vibration.modes(n, COUNT).eigenvalues) for n in waves]
    return np.concatenate([np.repeat(values, 2 if n else 1) for n, values in each])
