"""Universal files: units (data set 164), nodes (15, 2411) and coordinate systems (18, 2420), trace
lines (82), mode shapes (55, 2414) and frequency-response functions (58), read by pyuff.

pyuff passes over what it cannot use; here a file that is cut off, a set that holds less than
it says, or one that could change places, directions or values and is not read, is refused with the
set's number and line.
"""

from __future__ import annotations

import contextlib
import io
import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, pi
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import open_file, read_bytes
from .coordinates import GLOBAL, CoordinateSystem, read_systems

Array = np.ndarray
Signal = tuple[int, int]  # number of a node; direction 1, 2 or 3, negative where it is reversed
Place = tuple[float, float, float]  # m

MAX_BYTES = 1_000_000_000  # response functions of many points are long
SAME_PLACE_m = 1e-5  # m
MAX_RESPONSE_HZ, MAX_RESPONSE = 1e6, 1e30  # of response functions
DELIMITER = re.compile(rb" {4}-1(?: {74})?(?=[\r\n]|\Z)")  # binary values may stand before it
NODES, SYSTEMS, SHAPES = (15, 2411), (18, 2420), (55, 2414)
READ_TYPES = (*NODES, *SYSTEMS, *SHAPES, 58, 82, 164)
# titles, elements, groups, materials, properties, restraints, loads, qualifiers of functions, and
# results on elements: no place, direction, unit or motion of a node depends on them
UNHEEDED = (
    *(56, 57, 71, 151, 161, 752, 755, 757, 772, 773, 776, 780, 788, 789, 790, 791, 792, 1710, 1716),
    *(1858, 2400, 2402, 2412, 2415, 2416, 2417, 2428, 2429, 2430, 2432, 2435, 2437, 2438, 2448),
    *(2452, 2467, 2470, 2477),
)
FUNCTIONS = {
    0: "function of no stated type",
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
NOT_STATED, FORCE = (0, 1), 13
MOTION_FORMS = {8: "receptance", 11: "mobility", 12: "accelerance"}
BLOCKED_FORCE = "blocked force"  # or moment, at the hub
FORCE_FORMS = {9: BLOCKED_FORCE, FORCE: BLOCKED_FORCE}
QUANTITY_NAMES = {
    2: "stress",
    3: "strain",
    5: "temperature",
    6: "heat flux",
    8: "displacement",
    9: "reaction force",
    11: "velocity",
    12: "acceleration",
    13: "force",
    15: "pressure",
}


@dataclass(frozen=True)
class MeasuredShape:
    """A mode shape: data set 55 or 2414."""

    frequency_Hz: float
    damping: float  # ratio; NaN where not stated
    nodes: tuple[int, ...]  # (k,) numbers
    values: Array  # (k, 3) complex, in each node's own directions; NaN: 0 in every mode of the file
    place: str


@dataclass(frozen=True)
class Function:
    """A frequency-response function: data set 58."""

    frequency_Hz: Array  # (n,)
    values: Array  # (n,) complex, in ``unit``
    form: str | None  # receptance, mobility, accelerance, blocked force; None where not stated
    response: Signal  # node and direction where the motion was measured
    reference: Signal  # node and direction of the force
    place: str  # file and line, for messages
    response_part: str = ""  # component that the response is on, "" where it has no name
    reference_part: str = ""
    unit: str = ""  # of the values, in small letters without blanks and brackets; "": not stated


@dataclass(frozen=True)
class Universal:
    """Contents of a universal file."""

    path: Path
    nodes: dict[int, Place]  # x, y, z in the global system, m, by number
    shapes: list[MeasuredShape]
    functions: list[Function]
    # node numbers along each trace line that the file draws
    lines: list[tuple[int, ...]] = field(default_factory=list)
    skipped: Counter[str] = field(default_factory=Counter)  # what was not used, how often
    # (3, 3) unit vectors of the directions 1, 2, 3 in the global system, a row each, of nodes with
    # a coordinate system of their own; all others measure along the global x, y, z
    axes: dict[int, Array] = field(default_factory=dict)
    forms: Mapping[int, str] = field(default_factory=lambda: MOTION_FORMS)  # that are read, by code


def is_universal(path: Path) -> bool:
    """Whether a file begins like a universal file. Raises OSError."""
    with open_file(path) as file:
        return file.read(200).lstrip(b"\r\n").startswith(b"    -1")


def read_universal(path: Path, forces: bool = False) -> Universal:
    """Contents of a file; ``forces``: with functions of a force over a force. Raises InputError
    naming the set and its line; OSError."""
    if not is_universal(path):
        raise InputError(f"{path}: no universal file; one begins with a line '    -1'")
    text = read_bytes(path, MAX_BYTES)
    forms = MOTION_FORMS | (FORCE_FORMS if forces else {})
    result = Universal(path, {}, [], [], forms=forms)
    sets = [each for each in _sets(path, text) if each.kind not in UNHEEDED]
    for each in sets:
        if each.kind not in READ_TYPES:
            raise InputError(
                f"{each.place}: tyrecal does not read this type, which may change places,"
                " directions or values; take the set out if it does not"
            )
    length = _length([each for each in sets if each.kind == 164])
    systems = _systems([each for each in sets if each.kind in SYSTEMS])
    for each in sets:
        try:
            _add(result, each, systems, length)
        except InputError:
            raise
        except (KeyError, IndexError, ValueError, OverflowError):  # pyuff leaves out what it lacks
            raise InputError(f"{each.place}: cannot be read; it is damaged or cut off") from None
    _unmeasured(result.shapes)
    return result


def _add(
    result: Universal, each: _Set, systems: dict[int, CoordinateSystem], length: float
) -> None:
    """Add one data set to what the file holds; ``length``: see `_length`."""
    if each.kind in NODES:
        _add_nodes(result, each, systems, length)
    elif each.kind == 82:
        result.lines.append(tuple(int(node) for node in each.content["nodes"]))
    elif each.kind in SHAPES:
        _add_shape(result, each)
    elif each.kind == 58:
        _add_function(result, each)


@dataclass(frozen=True)
class _Set:
    """A data set: its type, place, lines after the type, and content as pyuff has it."""

    kind: int  # number of the data set, such as 58
    place: str
    lines: list[str]
    content: dict[str, Any]


def _sets(path: Path, text: bytes) -> list[_Set]:
    """Raises InputError."""
    import pyuff

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
    result = []
    file = pyuff.UFF(str(path))
    kinds = file.get_set_types()
    if 2 * len(kinds) != len(marks):
        raise InputError(f"{path}: the marks -1 of its data sets do not come in pairs")
    for number, kind in enumerate(map(int, kinds)):
        begin, end = marks[2 * number : 2 * number + 2]
        place = f"{path}, data set {number + 1} (type {kind}, line {line_of(begin)})"
        lines: list[str] = []
        content: dict[str, Any] = {}
        if kind in SYSTEMS:
            lines = text[begin:end].decode("utf-8", "replace").splitlines()[2:]
        elif kind in READ_TYPES:
            try:
                with contextlib.redirect_stdout(io.StringIO()):  # pyuff prints what it cannot read
                    content = file.read_sets(number)
            except Exception:  # pyuff raises nothing else
                raise InputError(f"{place}: cannot be read; it is damaged or cut off") from None
        result.append(_Set(kind, place, lines, content))
    return result


def _length(units: Sequence[_Set]) -> float:
    """The file's units of length in a metre."""
    for each in units:
        length, first = each.content["length"], units[0].content["length"]
        if not (isfinite(length) and length > 0):
            raise InputError(f"{each.place}: the factor of the length is {length}")
        if length != first:
            raise InputError(f"{each.place}: the factor of the length is {length}, before {first}")
    return float(units[0].content["length"]) if units else 1.0


def _systems(sets: Sequence[_Set]) -> dict[int, CoordinateSystem]:
    """All coordinate systems of a file, by number. Raises InputError."""
    systems: dict[int, CoordinateSystem] = {}
    for each in sets:
        try:
            more = read_systems(each.kind, each.lines)
        except InputError as error:
            raise InputError(f"{each.place}: {error}") from None
        except (ValueError, IndexError):
            words = "cannot be read; it is damaged or cut off"
            raise InputError(f"{each.place}: {words}") from None
        if twice := sorted(systems.keys() & more.keys()):
            raise InputError(f"{each.place}: system {twice[0]} is given in two data sets")
        systems |= more
    return systems


def _add_nodes(
    result: Universal, each: _Set, systems: dict[int, CoordinateSystem], length: float
) -> None:
    """Add the nodes of a data set, in m and in the global system; ``length``: the file's units in a
    metre. Raises InputError."""
    content = each.content
    numbers = [content[name] for name in ("node_nums", "def_cs", "disp_cs", "x", "y", "z")]
    if len(set(map(len, numbers))) > 1:
        raise InputError(f"{each.place}: a node lacks coordinates")
    for number, defined_in, moves_in, *coordinates in zip(*numbers, strict=True):
        node, own = int(number), {"place": int(defined_in), "directions": int(moves_in)}
        for what, system in own.items():
            if system not in systems and system not in GLOBAL:
                raise InputError(
                    f"{each.place}: the {what} of node {node} {'is' if what == 'place' else 'are'}"
                    f" in coordinate system {system}, which the file does not define (data set 18"
                    " or 2420)"
                )
        place = np.array(coordinates, float)
        if own["place"] in systems:
            place = systems[own["place"]].place(coordinates)
        x, y, z = (float(value) for value in place / length)
        if not is_same_place(result.nodes.setdefault(node, (x, y, z)), (x, y, z)):
            raise InputError(f"{each.place}: node {node} is given twice, at different places")
        if own["directions"] in systems:
            axes = systems[own["directions"]].directions(place)
            if not np.allclose(axes, np.eye(3), atol=1e-6):
                result.axes[node] = axes


def is_same_place(one: Place, other: Place) -> bool:
    """Whether two places of a node are one; data set 15 has six digits only."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True)) <= SAME_PLACE_m


def _add_shape(result: Universal, each: _Set) -> None:
    """Add the mode shape of a data set 55 or 2414; count what is no mode shape as skipped."""
    content = _like_55(each.content) if each.kind == 2414 else each.content
    motion = content.get("spec_data_type") in (*NOT_STATED, *MOTION_FORMS)
    vectors = content.get("n_data_per_node") in (3, 6)
    if content.get("analysis_type") not in (2, 3, 7) or not (motion and vectors):
        result.skipped["data at nodes that are no mode shape"] += 1
        return
    if content["analysis_type"] == 2:
        # a loss factor, as hysteretic damping is stated, is twice the ratio to the critical one
        viscous, hysteretic = content["modal_damp_vis"], content["modal_damp_his"]
        hertz, damping = content["freq"], viscous or hysteretic / 2 or float("nan")
    else:  # eigenvalue -zeta w + j w sqrt(1 - zeta^2)
        pole = content["eig"]
        hertz, damping = abs(pole) / (2 * pi), -pole.real / (abs(pole) or 1.0)
    if not (isfinite(hertz) and hertz > 0):
        mode = content.get("mode_n", "")
        raise InputError(f"{each.place}: mode {mode} has {hertz:g} Hz, must be above 0")
    values = np.column_stack([np.asarray(content[r], complex) for r in ("r1", "r2", "r3")])
    nodes = tuple(int(node) for node in content["node_nums"])
    if len(nodes) != len(values) or not len(nodes) or not np.isfinite(values).all():
        raise InputError(f"{each.place}: a node lacks its values")
    if len(set(nodes)) < len(nodes):
        raise InputError(f"{each.place}: a node is given twice")
    result.shapes.append(MeasuredShape(float(hertz), float(damping), nodes, values, each.place))


def _like_55(content: dict[str, Any]) -> dict[str, Any]:
    """A data set 2414 by the names of data set 55; empty where it holds no vectors at nodes."""
    if "data_at_node" not in content or not content["data_at_node"]:
        return {}
    rows, count = content["data_at_node"], content["number_of_data_values_for_the_data_component"]
    complex_values = content["data_type"] in (5, 6)
    if count not in (3, 6) or {len(row) for row in rows} != {count * (1 + complex_values)}:
        return {}
    values = np.array(rows)
    if complex_values:
        values = values[:, 0::2] + 1j * values[:, 1::2]
    real = lambda record, number: content[f"record{record}_field{number}"]
    return {
        "analysis_type": content["analysis_type"],
        "spec_data_type": content["result_type"],
        "n_data_per_node": count,
        "mode_n": real(10, 6),
        "freq": real(12, 2),
        "modal_damp_vis": real(12, 5),
        "modal_damp_his": real(12, 6),
        "eig": complex(real(13, 1), real(13, 2)),
        "node_nums": content["node_nums"],
        **{f"r{k}": values[:, k - 1] for k in (1, 2, 3)},
    }


def _unmeasured(shapes: list[MeasuredShape]) -> None:
    """Set what is 0 in every mode to NaN: the format has no other word for not measured."""
    sums: defaultdict[int, Array] = defaultdict(lambda: np.zeros(3))
    for shape in shapes:
        for node, value in zip(shape.nodes, np.abs(shape.values), strict=True):
            sums[node] = sums[node] + value
    for shape in shapes:
        for row, node in enumerate(shape.nodes):
            shape.values[row, sums[node] == 0] = np.nan


def _add_function(result: Universal, each: _Set) -> None:
    """Add the frequency-response function of a data set 58; count other functions as skipped.
    Raises InputError."""
    content = each.content
    if content["func_type"] != RESPONSE_FUNCTION:
        code = content["func_type"]
        result.skipped[FUNCTIONS.get(code, f"function of type {code}")] += 1
        return
    if content["abscissa_spec_data_type"] == TIME:
        raise InputError(f"{each.place}: the function is over time, must be over frequency")
    above, below = (content[f"{name}_spec_data_type"] for name in ("ordinate", "orddenom"))
    response = int(content["rsp_node"]), int(content["rsp_dir"])
    if above not in (*NOT_STATED, *result.forms) or below not in (*NOT_STATED, FORCE):
        words = [QUANTITY_NAMES.get(code, f"quantity {code}") for code in (above, below)]
        over = "" if below in NOT_STATED else f" over {words[1]}"
        result.skipped[f"{words[0]}{over}, channel {channel_name(response)}"] += 1
        return
    axis = _stated(content.get("abscissa_axis_units_lab", ""))
    if re.search(r"rad|rpm|khz|min", axis, re.IGNORECASE):
        raise InputError(f"{each.place}: its frequencies are in {axis}, must be in Hz")
    f, values = np.asarray(content["x"], float), np.asarray(content["data"], complex)
    if len(f) != content["num_pts"] or len(values) != len(f) or not len(f):
        count = content["num_pts"]
        raise InputError(f"{each.place}: {len(values)} values, the set says {count}; it is cut off")
    if not (np.isfinite(f).all() and np.isfinite(values[f > 0]).all()):
        raise InputError(f"{each.place}: a value is not a number")
    if f[-1] > MAX_RESPONSE_HZ or np.abs(values[f > 0]).max(initial=0) > MAX_RESPONSE:
        raise InputError(
            f"{each.place}: goes to {f[-1]:g} Hz, or a value to {np.abs(values).max():g}; no"
            " response of a tyre does"
        )
    if f[0] < 0 or np.any(np.diff(f) <= 0):
        raise InputError(f"{each.place}: frequencies must rise from 0 or more, got {f[0]:g} Hz")
    stated = [
        _stated(content.get(f"{name}_axis_units_lab", "")) for name in ("ordinate", "orddenom")
    ]
    unit = "/".join(re.sub(r"[\s()\[\]]", "", word).lower() for word in stated if word)
    result.functions.append(
        Function(
            f,
            values,
            result.forms.get(above),
            response,
            (int(content["ref_node"]), int(content["ref_dir"])),
            each.place,
            _stated(content["rsp_ent_name"]),
            _stated(content["ref_ent_name"]),
            unit,
        )
    )


def _stated(name: str) -> str:
    """The name of a component or unit; "" where none is given."""
    return "" if name.strip().upper() in ("NONE", "NULL") else name.strip()


def channel_name(signal: Signal, part: str = "") -> str:
    """A channel as messages and ``--leave-out`` name it: COMPONENT:NODE:DIRECTION."""
    return ":".join([part] * bool(part) + [str(signal[0]), str(abs(signal[1]))])
