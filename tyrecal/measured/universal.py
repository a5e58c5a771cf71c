"""Universal files: geometry (data sets 15, 2411), units (164), trace lines (82), mode shapes
(55) and frequency-response functions (58), read by pyuff.

pyuff passes over what it cannot use; here a file that is cut off, or a set that holds less than
it says, is refused with the set's number and line.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from math import isfinite, pi
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import open_file, read_bytes

Array = np.ndarray
Signal = tuple[int, int]  # number of a node; direction 1, 2 or 3, negative where it is reversed
Place = tuple[float, float, float]  # m

MAX_BYTES = 1_000_000_000  # response functions of many points are long
DELIMITER = re.compile(rb" {4}-1(?: {74})?(?=[\r\n]|\Z)")  # binary values may stand before it
ORDINATES = {8: "receptance", 11: "mobility", 12: "accelerance"}
UNHEEDED = (151, 2400, 2412)  # titles and elements: nothing is lost without them
FUNCTIONS = {
    1: "time response",
    2: "auto-spectrum",
    3: "cross-spectrum",
    5: "transmissibility",
    6: "coherence",
    7: "auto-correlation",
    8: "cross-correlation",
    9: "power spectral density",
    12: "spectrum",
}
RESPONSE_FUNCTION, TIME = 4, 17  # codes of a function's type, and of what it stands over


@dataclass(frozen=True)
class MeasuredShape:
    """A data set 55."""

    frequency_Hz: float
    damping: float  # ratio; NaN where not stated
    nodes: tuple[int, ...]
    values: Array  # (k, 3) complex, in each node's own directions; NaN: 0 in every mode of the file
    place: str


@dataclass(frozen=True)
class Function:
    """A data set 58 that is a frequency-response function."""

    frequency_Hz: Array
    values: Array
    form: str | None
    response: Signal
    reference: Signal
    place: str


@dataclass(frozen=True)
class Universal:
    """What a universal file holds."""

    path: Path
    nodes: dict[int, Place]
    shapes: list[MeasuredShape]
    functions: list[Function]
    lines: list[tuple[int, ...]] = field(default_factory=list)
    skipped: Counter[str] = field(default_factory=Counter)  # what was not used, how often


def is_universal(path: Path) -> bool:
    """Whether a file begins like a universal file. Raises OSError."""
    with open_file(path) as file:
        return file.read(200).lstrip(b"\r\n").startswith(b"    -1")


def read_universal(path: Path) -> Universal:
    """Raises InputError naming the set and its line; OSError."""
    import pyuff

    text = read_bytes(path, MAX_BYTES)
    marks = [match.start() for match in DELIMITER.finditer(text)]
    line_of = lambda mark: text.count(b"\n", 0, mark) + 1
    if not marks:
        raise InputError(f"{path}: no data set in it")
    if len(marks) % 2 or text[marks[-1] :].strip() != b"-1":
        opened = marks[len(marks) // 2 * 2 - (0 if len(marks) % 2 else 2)]
        raise InputError(
            f"{path}, line {line_of(opened)}: data set {(len(marks) + 1) // 2} does not end; the"
            " file is cut off"
        )
    file = pyuff.UFF(str(path))
    result = Universal(path, {}, [], [])
    sets: list[tuple[str, dict[str, Any]]] = []
    for number, kind in enumerate(file.get_set_types()):
        place = f"{path}, data set {number + 1} (type {kind}, line {line_of(marks[2 * number])})"
        if kind in UNHEEDED:
            continue
        if kind not in (15, 55, 58, 82, 164, 2411):
            result.skipped[f"type {kind}"] += 1
            continue
        try:
            sets.append((place, file.read_sets(number)))
        except Exception:  # pyuff raises nothing else
            raise InputError(f"{place}: cannot be read; it is damaged or cut off") from None
    length = 1.0
    for place, each in sets:
        if each["type"] == 164:
            length = each["length"]
            if not (isfinite(length) and length > 0):
                raise InputError(f"{place}: the factor of the length is {length}")
    for place, each in sets:
        _take(result, place, each, length)
    _unmeasured(result.shapes)
    return result


def _take(result: Universal, place: str, each: dict[str, Any], length: float) -> None:
    """Add one data set to what the file holds."""
    if each["type"] in (15, 2411):
        columns = [np.asarray(each[name], float) / length for name in "xyz"]
        if len({len(each["node_nums"]), *map(len, columns)}) > 1:
            raise InputError(f"{place}: a node lacks coordinates")
        for node, *xyz in zip(each["node_nums"], *columns, strict=True):
            result.nodes[int(node)] = (float(xyz[0]), float(xyz[1]), float(xyz[2]))
    elif each["type"] == 82:
        result.lines.append(tuple(int(node) for node in each["nodes"]))
    elif each["type"] == 55:
        if each["analysis_type"] in (2, 3, 7) and each.get("n_data_per_node") in (3, 6):
            result.shapes.append(_shape(place, each))
        else:
            result.skipped["data at nodes that are no mode shape"] += 1
    elif each["type"] == 58:
        if each["func_type"] == RESPONSE_FUNCTION:
            result.functions.append(_function(place, each))
        else:
            code = each["func_type"]
            result.skipped[FUNCTIONS.get(code, f"function of type {code}")] += 1


def _shape(place: str, each: dict[str, Any]) -> MeasuredShape:
    if each["analysis_type"] == 2:
        hertz, damping = each["freq"], each["modal_damp_vis"] or float("nan")
    else:  # eigenvalue -zeta w + j w sqrt(1 - zeta^2)
        pole = each["eig"]
        hertz, damping = abs(pole) / (2 * pi), -pole.real / (abs(pole) or 1.0)
    if not (isfinite(hertz) and hertz > 0):
        raise InputError(
            f"{place}: mode {each.get('mode_n', '')} has {hertz:g} Hz, must be above 0"
        )
    values = np.column_stack([np.asarray(each[r], complex) for r in ("r1", "r2", "r3")])
    nodes = tuple(int(node) for node in each["node_nums"])
    if len(nodes) != len(values) or not len(nodes) or not np.isfinite(values).all():
        raise InputError(f"{place}: a node lacks its values")
    return MeasuredShape(float(hertz), float(damping), nodes, values, place)


def _unmeasured(shapes: list[MeasuredShape]) -> None:
    """Set what is 0 in every mode to NaN: the format has no other word for not measured."""
    sums: defaultdict[int, Array] = defaultdict(lambda: np.zeros(3))
    for shape in shapes:
        for node, value in zip(shape.nodes, np.abs(shape.values), strict=True):
            sums[node] = sums[node] + value
    for shape in shapes:
        for row, node in enumerate(shape.nodes):
            shape.values[row, sums[node] == 0] = np.nan


def _function(place: str, each: dict[str, Any]) -> Function:
    if each["abscissa_spec_data_type"] == TIME:
        raise InputError(f"{place}: the function is over time, must be over frequency")
    f, values = np.asarray(each["x"], float), np.asarray(each["data"], complex)
    if len(f) != each["num_pts"] or len(values) != len(f):
        raise InputError(
            f"{place}: {len(values)} values, the set says {each['num_pts']}; it is cut off"
        )
    if not (np.isfinite(f).all() and np.isfinite(values).all()):
        raise InputError(f"{place}: a value is not a number")
    if f[0] < 0 or np.any(np.diff(f) <= 0):
        raise InputError(f"{place}: frequencies must rise from 0 or more, got {f[0]:g} Hz")
    response = int(each["rsp_node"]), int(each["rsp_dir"])
    if abs(response[1]) not in (1, 2, 3):
        raise InputError(f"{place}: the response's direction is {response[1]}, must be 1 to 3")
    form = ORDINATES.get(each["ordinate_spec_data_type"])
    reference = int(each["ref_node"]), int(each["ref_dir"])
    return Function(f, values, form, response, reference, place)
