"""Points of response functions, on the tread and at the hub: forces on a hub that is held, motions
of one that moves.

Directions at the hub are those of ISO 8855: x forward, y to the left along the axle, z upwards. The
angle 0 of the tread is below the hub, where it would touch the road. Angles grow as the wheel
turns when it rolls forward: 90 degrees is behind the hub.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..measured.coordinates import CYLINDRICAL, CoordinateSystem

TREAD_POINT = re.compile(r"tread:([+-]?\d+(?:\.\d+)?)deg:(radial|tangential|lateral)")
TREAD_MOTIONS = "radial", "tangential", "lateral"
# place among the solver's forces and moments along and about down, backwards, left, and its sign
HUB_CHANNELS = {
    **{"fx": (1, -1), "fy": (2, 1), "fz": (0, -1)},
    **{"mx": (4, -1), "my": (5, 1), "mz": (3, -1)},
}
# the same of a hub that moves: shifts and turns
HUB_MOTIONS = dict(zip(("x", "y", "z", "rx", "ry", "rz"), HUB_CHANNELS.values(), strict=True))
HUB_PLACES = {**HUB_CHANNELS, **HUB_MOTIONS}
EXAMPLES = "such as tread:0deg:radial, tread:90deg:lateral"
# axes of the tread's r, theta, z at the angle 0: down, backwards, along the axle
TREAD_SYSTEM = CoordinateSystem(
    CYLINDRICAL, np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]), np.zeros(3)
)


@dataclass(frozen=True)
class ResponsePoint:
    """A place and direction of the tread, or a channel of the hub.

    >>> print(*read_points("tread:90deg:radial,hub:fz"))
    tread:90deg:radial hub:fz
    """

    channel: str  # direction of the tread; of the hub fx to mz, or x to rz if it moves
    angle_deg: float | None = None  # None: the hub

    def __str__(self) -> str:
        if self.angle_deg is None:
            return f"hub:{self.channel}"
        return f"tread:{self.angle_deg:g}deg:{self.channel}"


def read_points(text: str, hub: bool = True, moves: bool | None = None) -> list[ResponsePoint]:
    """Points of a list with commas; ``hub``: whether it may have the hub's; ``moves``: whether the
    hub moves, None: not known. Raises InputError."""
    points = []
    channels = {None: HUB_PLACES, False: HUB_CHANNELS, True: HUB_MOTIONS}[moves]
    for word in text.replace(" ", "").split(","):
        place, _, channel = word.partition(":")
        if match := TREAD_POINT.fullmatch(word):
            points.append(ResponsePoint(match[2], float(match[1])))
        elif hub and place == "hub" and channel in channels:
            points.append(ResponsePoint(channel))
        else:
            first = [*channels][2]
            of_hub = f", or hub:{first} with one of {', '.join(channels)}" if hub else ""
            of_hub += " (the wheel moves)" * bool(hub and moves)
            raise InputError(
                f"'{word}' is no point: give tread:ANGLEdeg:DIRECTION, {EXAMPLES}{of_hub};"
                f" directions are {', '.join(TREAD_MOTIONS)}"
            )
    if len(set(points)) < len(points):
        raise InputError(f"'{text}' has a point twice")
    return points
