"""Texts of universal files: header, units and nodes (data sets 151, 164, 2411, 2420), then trace
lines (82), mode shapes (55) or frequency-response functions (58).

ASCII, in SI units. `universal` reads such files.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .coordinates import CYLINDRICAL, CoordinateSystem

Array = np.ndarray
QUANTITIES_58 = {  # code of the data type, exponents of length, force, temperature, label, unit
    "displacement": (8, 1, 0, 0, "Displacement", "m"),
    "acceleration": (12, 1, 0, 0, "Acceleration", "m/s2"),
    "force": (9, 0, 1, 0, "Reaction force", "N"),
    "moment": (9, 1, 1, 0, "Reaction moment", "N m"),
    "excitation": (13, 0, 1, 0, "Excitation force", "N"),
    "frequency": (18, 0, 0, 0, "Frequency", "Hz"),
    "none": (0, 0, 0, 0, "NONE", "NONE"),
}
SYSTEM_NUMBER = 2  # of the cylindrical system; 1 is often taken for the global one
SYSTEM_COLOUR, NODE_COLOUR = 8, 11  # numbers of colours, without a meaning here


@dataclass(frozen=True)
class WrittenFunction:
    """A function over evenly spaced frequencies; node and direction (1 to 6) of each end."""

    name: str
    response: tuple[int, int]
    reference: tuple[int, int]
    quantity: str  # of the response, a key of `QUANTITIES_58`
    values: Array  # (f,) complex


@dataclass(frozen=True)
class WrittenShape:
    """A real mode shape: displacements (k, 3) of the file's nodes along x, y, z."""

    name: str
    frequency_Hz: float
    displacement: Array
    damping_ratio: float = 0.0  # of critical; 0: not known
    modal_mass_kg: float = 0.0  # 0: not known


def universal_text(
    title: str,
    nodes: Mapping[int, Sequence[float]],
    sets: Iterable[str],
    system: CoordinateSystem | None = None,
    in_system: Iterable[int] = (),
) -> str:
    """The file's text; nodes: x, y, z in m; sets: texts of what follows the nodes; in_system: nodes
    that move along r, theta, z of a cylindrical ``system``."""
    cylindrical = {*in_system}
    header = [_text(title), "NONE", "tyrecal", *["NONE"] * 4]
    # code of SI, relative temperatures; factors of length, force, temperature, and its offset
    units = (
        f"{1:10d}{'SI: m, N':<20}{2:10d}\n{_double(1)}{_double(1)}{_double(1)}\n{_double(273.15)}"
    )
    head = f"{SYSTEM_NUMBER:10d}{CYLINDRICAL:10d}{SYSTEM_COLOUR:10d}"
    systems = [f"{1:10d}", _text(title), head, "TYRE"]
    if system:
        systems += ["".join(map(_double, row)) for row in [*system.axes, system.origin]]
    places = []
    for number, place in nodes.items():
        moves_in = SYSTEM_NUMBER if number in cylindrical else 0
        systems_and_colour = f"{0:10d}{moves_in:10d}{NODE_COLOUR:10d}"
        places += [f"{number:10d}{systems_and_colour}", "".join(map(_double, place))]
    first = [_set(151, header), _set(164, [units]), *([_set(2420, systems)] if system else [])]
    return "".join([*first, _set(2411, places), *sets])


def line_set(number: int, nodes: Sequence[int]) -> str:
    """A trace line, data set 82, through at most 250 nodes."""
    rows = ["".join(f"{n:10d}" for n in nodes[k : k + 8]) for k in range(0, len(nodes), 8)]
    return _set(82, [f"{number:10d}{len(nodes):10d}{0:10d}", "NONE", *rows])


def shape_set(title: str, number: int, each: WrittenShape, nodes: Iterable[int]) -> str:
    """A normal mode, data set 55, with a viscous damping ratio."""
    lines = [_text(each.name), _text(title), "NONE", "NONE", "NONE"]
    # structural, normal mode, 3 freedoms, displacement, real, 3 values a node
    lines += ["".join(f"{code:10d}" for code in (1, 2, 2, 8, 2, 3))]
    lines += [f"{2:10d}{4:10d}{1:10d}{number:10d}"]  # 2 integers, 4 reals; load case, mode
    lines += [_singles([each.frequency_Hz, each.modal_mass_kg, each.damping_ratio, 0.0])]
    for node, motion in zip(nodes, each.displacement, strict=True):
        lines += [f"{node:10d}", _singles(motion)]
    return _set(55, lines)


def function_set(title: str, each: WrittenFunction, frequency_Hz: Array) -> str:
    """A frequency-response function, data set 58."""
    ends = "".join(f" {'NONE':<10}{n:10d}{d:4d}" for n, d in (each.response, each.reference))
    step = (frequency_Hz[-1] - frequency_Hz[0]) / (len(frequency_Hz) - 1)
    lines = [_text(each.name), _text(title), "NONE", "NONE", "NONE"]
    # 4: frequency-response function, 6: complex of double precision, 1: even spacing
    lines += [f"{4:5d}{0:10d}{1:5d}{0:10d}{ends}"]
    lines += [f"{6:10d}{len(frequency_Hz):10d}{1:10d}{frequency_Hz[0]:13.5E}{step:13.5E}{0:13.5E}"]
    for quantity in ("frequency", each.quantity, "excitation", "none"):
        code, length, force, temperature, label, unit = QUANTITIES_58[quantity]
        lines += [f"{code:10d}{length:5d}{force:5d}{temperature:5d} {label:<20} {unit:<20}"]
    numbers = [f"{x:20.12E}" for value in each.values for x in (value.real, value.imag)]
    lines += ["".join(numbers[k : k + 4]) for k in range(0, len(numbers), 4)]
    return _set(58, lines)


def _set(kind: int, lines: Sequence[str]) -> str:
    return "\n".join([f"{-1:6d}", f"{kind:6d}", *lines, f"{-1:6d}", ""])


def _text(words: str) -> str:
    """An identification line, never blank."""
    return words.encode("ascii", "replace").decode()[:80] or "NONE"


def _singles(values: Iterable[float]) -> str:
    return "".join(f"{value:13.5E}" for value in values)


def _double(value: float) -> str:
    return f"{value:25.16E}".replace("E", "D")
