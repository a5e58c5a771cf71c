"""Sensors on a tyre, and what they measured of a mode."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Sensors:
    """Sensors of a test: one row per signal, several rows for a point with several signals."""

    points: Array  # (k, 3) R (m), Theta (rad), Z (m) about the axle, from the middle plane
    directions: Array  # (k, 3) unit vectors in r, theta, z
    names: tuple[str, ...] = ()  # (k,) of the channels, as `--leave-out` has them


@dataclass(frozen=True)
class MeasuredMode:
    """A mode as a test gives it; NaN is what it does not."""

    frequency_Hz: float
    amplitude: Array  # (k,) of each signal, complex, any scale
    damping: float = nan  # ratio to the critical one
    sigma_Hz: float = nan  # standard deviation of the frequency


def real_part(amplitude: Array) -> tuple[Array, float]:
    """A complex shape turned to be as real as it can, (k,), and its collinearity.

    u exp(-i phi) has the largest real part at phi = arg(sum u^2) / 2; the modal phase
    collinearity |sum u^2| / sum |u|^2 is 1 for a shape that is real but for a factor, and 0 where
    the imaginary part is as large as the real one and in quadrature.
    """
    square = np.sum(amplitude**2)
    whole = float(np.sum(np.abs(amplitude) ** 2))
    turned = (amplitude * np.exp(-0.5j * np.angle(square))).real
    return turned, float(abs(square)) / whole if whole else 0.0
