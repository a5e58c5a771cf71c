"""Coordinate systems of universal files (data sets 18 and 2420): where nodes are, and where their
directions 1, 2, 3 point, in the file's global system.

    18    per system: number, kind, reference system, ...; a name; 9 numbers on two lines, which are
          three points in the reference system: the origin, one on +x, one on the +xz plane
    2420  two lines of the part; per system: number, kind, colour; a name; three lines with the unit
          vectors of its x, y, z in the global system; one line with its origin

kind: 0 Cartesian, 1 cylindrical, 2 spherical.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError

Array = np.ndarray

CARTESIAN, CYLINDRICAL, SPHERICAL = 0, 1, 2
SYSTEM_KINDS = ("Cartesian", "cylindrical", "spherical")
GLOBAL = (0, 1)  # numbers that mean the global system where the file does not define them
LINES_18, LINES_2420 = 4, 6  # lines of one system
WIDTH_18 = 13  # characters of a number in data set 18


@dataclass(frozen=True)
class CoordinateSystem:
    """A Cartesian or cylindrical coordinate system."""

    kind: int  # a number of the data set, see above
    axes: Array  # (3, 3) unit vectors along its x, y, z, a row each, in the global system
    origin: Array  # (3,) in the global system, in the file's unit of length

    def place(self, coordinates: Sequence[float] | Array) -> Array:
        """Global coordinates (3,) of x, y, z, or of r, theta (degrees), z, in this system."""
        x = np.array(coordinates, float)
        if self.kind == CYLINDRICAL:
            angle = np.radians(x[1])
            x = np.array([x[0] * np.cos(angle), x[0] * np.sin(angle), x[2]])
        return np.asarray(x @ self.axes + self.origin)

    def directions(self, place: Array) -> Array:
        """Unit vectors (3, 3) of the directions 1, 2, 3 (x, y, z, or r, theta, z of this system) at
        a global place, a row each."""
        if self.kind == CARTESIAN:
            return self.axes
        x, y, _ = self.axes @ (place - self.origin)
        angle = np.arctan2(y, x)
        c, s = np.cos(angle), np.sin(angle)
        return np.asarray(np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ self.axes)


WORLD = CoordinateSystem(CARTESIAN, np.eye(3), np.zeros(3))


def read_systems(kind: int, lines: Sequence[str]) -> dict[int, CoordinateSystem]:
    """Coordinate systems, by number, of a data set of type ``kind``, 18 or 2420, given its lines
    after the type. Raises InputError, a phrase that names the fault; ValueError or IndexError where
    a line is damaged, for `universal` to name."""
    return _systems_18(lines) if kind == 18 else _systems_2420(lines)


def _systems_18(lines: Sequence[str]) -> dict[int, CoordinateSystem]:
    """Systems of data set 18, each by three points in a reference system."""
    systems: dict[int, CoordinateSystem] = {}
    for head, _, *points in _groups(lines, LINES_18):
        number, kind, reference, *_ = (int(word) for word in head.split())
        numbers = [
            float(line[k : k + WIDTH_18])
            for line in points
            for k in range(0, len(line.rstrip()), WIDTH_18)
        ]
        base = _system(reference, systems)
        if base.kind != CARTESIAN:
            raise InputError(f"system {number} is given in a {SYSTEM_KINDS[base.kind]} system")
        origin, on_x, on_xz = (base.place(each) for each in np.reshape(numbers, (3, 3)))
        x = on_x - origin
        y = np.cross(on_xz - origin, x)
        _add(systems, number, kind, np.array([x, y, np.cross(x, y)]), origin)
    return systems


def _systems_2420(lines: Sequence[str]) -> dict[int, CoordinateSystem]:
    """Systems of data set 2420, each by its axes and origin in the global system."""
    systems: dict[int, CoordinateSystem] = {}
    for head, _, *rows in _groups(lines[2:], LINES_2420):
        number, kind, *_ = (int(word) for word in head.split())
        matrix = np.array(
            [[float(w) for w in row.upper().replace("D", "E").split()] for row in rows]
        )
        _add(systems, number, kind, matrix[:3], matrix[3])
    return systems


def _groups(lines: Sequence[str], size: int) -> list[Sequence[str]]:
    """The lines of each system, ``size`` of them. Raises InputError."""
    if not lines or len(lines) % size:
        raise InputError("the last coordinate system is incomplete")
    return [lines[k : k + size] for k in range(0, len(lines), size)]


def _system(number: int, systems: dict[int, CoordinateSystem]) -> CoordinateSystem:
    """The system of a number among those read so far. Raises InputError."""
    if number not in systems and number not in GLOBAL:
        raise InputError(f"coordinate system {number} is not defined")
    return systems.get(number, WORLD)


def _add(
    systems: dict[int, CoordinateSystem], number: int, kind: int, axes: Array, origin: Array
) -> None:
    """Add a system, once its axes are right-angled. Raises InputError."""
    length = np.linalg.norm(axes, axis=1, keepdims=True)
    unit = axes / np.where(length > 0, length, 1.0)
    if axes.shape != (3, 3) or not np.allclose(unit @ unit.T, np.eye(3), atol=1e-3):
        raise InputError(f"the axes of system {number} are not at right angles")
    if kind not in (CARTESIAN, CYLINDRICAL):
        name = SYSTEM_KINDS[kind] if kind == SPHERICAL else f"of type {kind}"
        raise InputError(f"system {number} is {name}; tyrecal reads Cartesian and cylindrical ones")
    if number in systems:
        raise InputError(f"system {number} is given twice")
    systems[number] = CoordinateSystem(kind, unit, origin)
