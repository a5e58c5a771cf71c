"""Sensors on a tyre: what they measured of a mode, and where they are, from a test's coordinates to
R, Theta, Z about the axle.

Theta is counted about the axle from the next axis in the order x, y, z, x.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from ..errors import InputError
from ..simulate.modes.label import BELT
from .universal import Place, Signal, channel_name

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


RADIUS_RANGE_m = (0.15, 1.5)  # of tyres
MAX_ASPECT = 0.75  # a tyre's width over its diameter is less
# radius over the largest one, above which a sensor is on the tread or its shoulders; `BELT` is the
# same for the belt alone
OUTER_RADIUS = 0.8
MAX_OFF_CENTRE = 0.1  # of the radius
CIRCLE_FITS = 3  # circles that are fitted one after the other
AXIS_NAMES = "xyz"


def sensors_of(
    signals: Sequence[Signal],
    nodes: Mapping[int, Place],
    axle: str = "",
    centre: Place = (0.0, 0.0, 0.0),
    cylindrical: bool = False,
    axes: Mapping[int, Array] | None = None,
) -> Sensors:
    """Sensors of signals (node, direction 1 to 3, negative: against it).

    nodes: coordinates in m; axle: x, y or z (default: the axis along which all nodes
    spread least); centre: of the wheel, in m; cylindrical: directions 1, 2, 3 are radial,
    tangential and axial at each sensor, else along the node's ``axes`` (unit vectors (3, 3), a row
    each), and where it has none along x, y and z.

    Raises InputError where a node has no place, or the places are no tyre's.
    """
    lacking = sorted({node for node, _ in signals if node not in nodes})
    if lacking:
        raise InputError(
            f"node {lacking[0]} has no coordinates; give the file with data set 15 or 2411, too"
        )
    X = np.array([nodes[node] for node, _ in signals]) - centre
    z = AXIS_NAMES.index(axle or _axle(np.array(list(nodes.values()))))
    x, y = (z + 1) % 3, (z + 2) % 3
    R, angle = np.hypot(X[:, x], X[:, y]), np.arctan2(X[:, y], X[:, x])
    _check_centre(X[:, [x, y]], AXIS_NAMES[z])
    low, high = RADIUS_RANGE_m
    if not low <= R.max() <= high:
        raise InputError(
            f"the sensors' largest radius about {AXIS_NAMES[z]} is {R.max():.4g} m, no tyre's"
            f" ({low:g} to {high:g}); is the unit of length (data set 164) right?"
        )
    directions = np.zeros((len(signals), 3))
    for row, (node, direction) in enumerate(signals):
        sign, k = np.sign(direction), abs(direction) - 1
        if cylindrical:
            directions[row, k] = sign
            continue
        along = sign * (axes or {}).get(node, np.eye(3))[k]
        c, s = np.cos(angle[row]), np.sin(angle[row])
        directions[row] = (c * along[x] + s * along[y], c * along[y] - s * along[x], along[z])
    names = tuple(channel_name(signal) for signal in signals)
    return Sensors(np.column_stack([R, angle, X[:, z]]), directions, names)


def _axle(X: Array) -> str:
    """The axis along which places (k, 3) spread least, if they are a tyre's."""
    spread = np.ptp(X, axis=0)
    order = np.argsort(spread)
    if not spread[order[0]] < MAX_ASPECT * spread[order[1]]:
        raise InputError(
            "the sensors' places do not show which axis is the axle; give --axle x, y or z"
        )
    return AXIS_NAMES[order[0]]


def _check_centre(places: Array, axle: str) -> None:
    """Raise InputError if the outermost sensors are on a circle about another centre than (0, 0) of
    ``places`` (k, 2), m.

    The circle x^2 + y^2 = 2 a x + 2 b y + c by least squares, through those that stand outermost
    about the last centre.
    """
    places = np.unique(np.round(places, 6), axis=0)
    if len(places) < 4:
        return  # too few to tell
    middle = (places.min(0) + places.max(0)) / 2
    for _ in range(CIRCLE_FITS):
        distance = np.hypot(*(places - middle).T)
        outer = places[distance / distance.max() > OUTER_RADIUS]
        A = np.column_stack([2 * outer, np.ones(len(outer))])
        solution, _, rank, _ = np.linalg.lstsq(A, np.sum(outer**2, axis=1), rcond=None)
        if len(outer) < 4 or rank < 3:
            return
        middle = solution[:2]
    distance = np.hypot(*(outer - middle).T)
    radius, off = distance.mean(), np.hypot(*middle)
    if np.abs(distance / radius - 1).max() < 1 - BELT and off > MAX_OFF_CENTRE * radius:
        raise InputError(
            f"the sensors' circle about {axle} has its middle {off:.3g} m off the axle;"
            " give --centre X,Y,Z"
        )
