"""How much shapes on the same sensors agree: MAC, AutoMAC, and COMAC by sensor.

A doublet is a plane of shapes: its two modes are known except for an angle round the tyre. The MAC
of a shape u with it is |Q^T u|^2 / |u|^2, Q being an orthonormal basis of the plane at the sensors.
A shape of N signals drawn at random has a MAC with a plane that is distributed as Beta(1, N/2 - 1):
it exceeds

    1 - 0.05^(2 / (N - 2))

in 5 of 100 cases. That is the chance level. The survival function is log-concave, so also of many
such planes the best leads the next by more than the chance level in at most 5 of 100 cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..simulate.modes.label import in_words
from ..simulate.modes.rings import squared_cosines
from .shapes import SensorShapes

Array = np.ndarray
BY_CHANCE = 0.05  # share of random shapes above the chance level


def chance_level(signals: int) -> float:
    """MAC with a plane that a random shape exceeds in 5 of 100 cases; 1 for two signals or less.

    >>> [round(chance_level(count), 2) for count in (8, 20, 200)]
    [0.63, 0.28, 0.03]
    """
    return 1 - BY_CHANCE ** (2 / (signals - 2)) if signals > 2 else 1.0


def mac_matrix(rows: Sequence[Array], columns: Sequence[Array]) -> Array:
    """MAC (n, m) of n shapes or planes with m others, each with a column for each of its shapes:
    of two planes the largest of any two shapes in them."""
    each = [[squared_cosines(a, b).max(initial=0.0) for b in columns] for a in rows]
    return np.array(each).reshape(len(rows), len(columns))


def auto_mac(test: SensorShapes) -> dict[str, Any]:
    """The measured modes of a test against each other, doublets as planes: an entry of the JSON
    that `measured import` prints."""
    spans = test.spans()
    matrix = mac_matrix(list(spans.values()), list(spans.values()))
    return {
        "file": test.file,
        "signals": len(test.signals),
        "chance_level": chance_level(len(test.signals)),
        "modes": list(spans),
        "auto_mac": matrix.round(6).tolist(),
    }


def auto_mac_words(entry: dict[str, Any]) -> str:
    """The two modes of a test that look most alike at its sensors, in a sentence."""
    matrix = np.array(entry["auto_mac"]) - np.eye(len(entry["modes"]))
    i, j = np.unravel_index(np.argmax(matrix), matrix.shape)
    first, second = (in_words(entry["modes"][k]) for k in (i, j))
    return (
        f"{entry['file']}: largest AutoMAC of two modes {matrix[i, j]:.2f}, {first} and {second}"
        f" (chance level of {entry['signals']} signals {entry['chance_level']:.2f})"
    )


def sensor_agreement(measured: Array, computed: Array) -> tuple[Array, Array]:
    """COMAC and ECOMAC (k,) of each signal over paired shapes in the columns of ``measured`` and
    ``computed``, which are of unit length and of the same sign.

    COMAC is 1 where a signal agrees except for its gain and sign, or is 0 in all shapes of either.
    ECOMAC, 0 to 1, is the mean distance over 2, so that it shows a wrong gain or sign too.
    """
    a, b = measured, computed
    size = np.sum(a**2, axis=1) * np.sum(b**2, axis=1)
    comac = np.sum(np.abs(a * b), axis=1) ** 2 / np.maximum(size, 1e-300)
    return np.where(size > 0, comac, 1.0), np.mean(np.abs(a - b), axis=1) / 2


def closest_shape(shape: Array, plane: Array) -> Array:
    """The shape of a plane (k, 2), or line (k, 1), that is nearest to a shape (k,), of unit length;
    its sign is the shape's."""
    closest = plane @ np.linalg.lstsq(plane, shape, rcond=None)[0]
    return np.asarray(closest / max(np.linalg.norm(closest), 1e-300))
