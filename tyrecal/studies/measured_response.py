"""Measured response functions, at the points of a computed one: universal files and CSV.

A universal file (data set 58) says by nodes and directions where it was measured. Its axes have to
be those of tyrecal: the origin at the wheel's centre, x forward, y along the axle to the left, z
up. A node within 5 cm of the axle is the hub; others must be on the tread's
middle line. A CSV has the columns of frf.csv.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..measured.universal import BLOCKED_FORCE, Function, Universal, is_universal, read_universal
from ..tyre.number_table import NumberMarks, cells_under, read_text_table
from .response_points import (
    HUB_CHANNELS,
    HUB_MOTIONS,
    TREAD_MOTIONS,
    TREAD_SYSTEM,
    ResponsePoint,
    read_points,
)

Array = np.ndarray
HUB_RADIUS_m = 0.05  # about the axle, within which a node is the hub
MAX_OFF_MIDDLE_m = 0.03  # of a node on the tread, along the axle
EVEN = 0.02  # of the step between frequencies, by which steps may differ
ALONG = 0.99  # cosine to an axis above which a direction is along it
ORDERS = {"receptance": 0, "mobility": 1, "accelerance": 2}  # times i omega over the displacement
FRF_COLUMNS = ("excite", "respond", "frequency_Hz", "real", "imag")
SHOWN_RESPONSE_UNITS = "m/N, mm/N, m/s2/N, g/N, N/N"  # the usual ones, for messages
SI_PER_UNIT = {  # of a response's unit per newton, to SI; without a unit a response is in SI
    **dict.fromkeys(("", "m/n", "m/s/n", "m/s2/n", "m/s^2/n", "m/s²/n", "n/n", "nm/n"), 1.0),
    **dict.fromkeys(("mm/n", "mm/s/n", "mm/s2/n", "mm/s^2/n"), 1e-3),
    "g/n": 9.80665,
}


@dataclass(frozen=True)
class MeasuredResponse:
    """A measured function, SI; ``form``: receptance, mobility, accelerance or blocked force."""

    excite: ResponsePoint
    respond: ResponsePoint
    form: str
    frequency_Hz: Array  # (f,), rising from above 0
    values: Array  # (f,) complex

    def as_form(self, form: str) -> Array:
        """The values (f,) as receptance, mobility or accelerance; a force stays one."""
        if self.respond.angle_deg is None:  # at the hub
            return self.values
        power = ORDERS[form] - ORDERS[self.form]
        return np.asarray(self.values * (2j * np.pi * self.frequency_Hz) ** power)


def read_measured_responses(
    path: Path, form: str, from_Hz: float, to_Hz: float
) -> list[MeasuredResponse]:
    """The functions of a file between two frequencies, at the same, evenly spaced lines above 0.
    ``form``: that of motions whose form is not stated. Raises InputError, OSError."""
    read = _read_universal if is_universal(path) else _read_table
    functions: list[MeasuredResponse] = []
    for place, each in read(path, form):
        is_force = each.respond.channel in HUB_CHANNELS
        if is_force != (each.form == BLOCKED_FORCE):
            what = "a force or moment" if is_force else "a motion"
            raise InputError(f"{place}: the response at {each.respond} must be {what}")
        inside = (each.frequency_Hz > 0) & (each.frequency_Hz >= from_Hz)
        inside &= each.frequency_Hz <= to_Hz
        f, values = each.frequency_Hz[inside], each.values[inside]
        if len(f) < 2 or np.ptp(np.diff(f)) > EVEN * (f[1] - f[0]):
            raise InputError(
                f"{place}: must have two frequencies or more from {from_Hz:g} to {to_Hz:g} Hz,"
                " evenly spaced"
            )
        lines = functions[0].frequency_Hz if functions else f
        if len(f) != len(lines) or not np.allclose(f, lines, rtol=1e-4):
            raise InputError(f"{place}: must have the frequencies of the functions before it")
        if any((each.excite, each.respond) == (x.excite, x.respond) for x in functions):
            raise InputError(f"{place}: {each.respond} over {each.excite} is in the file twice")
        functions.append(MeasuredResponse(each.excite, each.respond, each.form, f, values))
    if not functions:
        raise InputError(f"{path}: there is no response function in it")
    return functions


def _read_universal(path: Path, form: str) -> list[tuple[str, MeasuredResponse]]:
    file = read_universal(path, forces=True)
    return [(each.place, _of_function(file, each, form)) for each in file.functions]


def _of_function(file: Universal, each: Function, form: str) -> MeasuredResponse:
    """A function of a universal file in SI; form: if it does not state its own."""
    if each.unit not in SI_PER_UNIT:
        raise InputError(
            f"{each.place}: the unit '{each.unit}' is not one of {SHOWN_RESPONSE_UNITS}"
        )
    respond, sign = _point(file, each.response, each.place)
    excite, other = _point(file, each.reference, each.place)
    if excite.angle_deg is None:
        raise InputError(f"{each.place}: the force must be on the tread, it is at {excite}")
    values, form = sign * other * SI_PER_UNIT[each.unit] * each.values, each.form or form
    if respond.angle_deg is None and form != BLOCKED_FORCE:
        respond = ResponsePoint([*HUB_MOTIONS][[*HUB_CHANNELS].index(respond.channel)])
    return MeasuredResponse(excite, respond, form, each.frequency_Hz, values)


def _point(file: Universal, signal: tuple[int, int], place: str) -> tuple[ResponsePoint, int]:
    """Point of a node and direction, and the sign of the direction along it."""
    node, way = signal
    if node not in file.nodes or not 1 <= abs(way) <= len(HUB_CHANNELS):
        raise InputError(f"{place}: node {node}, direction {way} has no place in the file")
    x, _, z = at = np.array(file.nodes[node])
    sign = 1 if way > 0 else -1
    is_hub = np.hypot(x, z) < HUB_RADIUS_m
    turn = 3 * (abs(way) > 3)
    axis = file.axes.get(node, np.eye(3))[abs(way) - 1 - turn]
    cosines = (np.eye(3) if is_hub else TREAD_SYSTEM.directions(at)) @ axis
    channel = int(np.abs(cosines).argmax())
    if abs(cosines[channel]) < ALONG or (turn and not is_hub):
        along = "x, y, z" if is_hub else ", ".join(TREAD_MOTIONS)
        raise InputError(f"{place}: direction {way} of node {node} is along none of {along}")
    sign *= 1 if cosines[channel] > 0 else -1
    if is_hub:
        return ResponsePoint([*HUB_CHANNELS][turn + channel]), sign
    if abs(at[1]) > MAX_OFF_MIDDLE_m:
        raise InputError(
            f"{place}: node {node} is {1e3 * abs(at[1]):.0f} mm off the tyre's middle plane,"
            f" y must be at most {1e3 * MAX_OFF_MIDDLE_m:.0f} mm: responses are computed there"
        )
    angle = round(float(np.degrees(np.arctan2(-x, -z))), 3) % 360  # 0 below the hub, 90 behind
    return ResponsePoint(TREAD_MOTIONS[channel], angle), sign


def _read_table(path: Path, form: str) -> list[tuple[str, MeasuredResponse]]:
    try:
        table = read_text_table(path)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    (_, headings), *lines = table.lines or [(0, [])]
    if missing := [name for name in FRF_COLUMNS if name not in headings]:
        raise InputError(
            f"{path}: has no column {missing[0]}; give a universal file, or a CSV with the columns"
            f" {', '.join(FRF_COLUMNS)}"
        )
    if twice := [name for name in headings if name and headings.count(name) > 1]:
        raise InputError(f"{path}: has the column {twice[0]} twice")
    by_line: dict[int, dict[str, str]] = {}
    for number, cells in lines:
        try:
            by_line[number] = dict(zip(headings, cells_under(headings, cells), strict=True))
        except InputError as error:
            raise InputError(f"{path}, line {number}: {error}") from None
    texts = (row[name] for row in by_line.values() for name in FRF_COLUMNS[2:])
    marks = NumberMarks.of(texts, table.separator)
    by_pair: dict[tuple[str, str, str], list[list[float]]] = {}
    first: dict[tuple[str, str, str], int] = {}
    for number, row in by_line.items():
        unit = row.get("unit", "")
        if (scale := SI_PER_UNIT.get(unit.replace(" ", "").lower())) is None:
            raise InputError(
                f"{path}, line {number}: the unit '{unit}' is not one of {SHOWN_RESPONSE_UNITS}"
            )
        try:
            hertz, *parts = (marks.number(row[name]) for name in FRF_COLUMNS[2:])
        except ValueError as error:
            raise InputError(f"{path}, line {number}: {error}") from None
        pair = row["excite"], row["respond"], row.get("quantity", "")
        by_pair.setdefault(pair, []).append([hertz, *(scale * part for part in parts)])
        first.setdefault(pair, number)
    result = []
    for (excite, respond, own), rows in by_pair.items():
        place = f"{path}, line {first[excite, respond, own]}"
        result.append((place, _of_rows(place, excite, respond, own or form, np.array(rows).T)))
    return result


def _of_rows(place: str, excite: str, respond: str, form: str, rows: Array) -> MeasuredResponse:
    """A function of a table; rows (3, f): Hz, real and imaginary part, SI."""
    try:
        (force,), (point,) = read_points(excite, hub=False), read_points(respond)
    except ValueError as error:
        raise InputError(f"{place}: {error}") from None
    form = BLOCKED_FORCE if point.channel in HUB_CHANNELS else form
    if form not in (*ORDERS, BLOCKED_FORCE):
        raise InputError(f"{place}: quantity is '{form}', must be one of {', '.join(ORDERS)}")
    if np.any(np.diff(rows[0]) <= 0):
        raise InputError(f"{place}: frequencies must rise")
    return MeasuredResponse(force, point, form, rows[0], rows[1] + 1j * rows[2])


def agreement(measured: Array, computed: Array) -> dict[str, float]:
    """How well two functions (f,) agree, nothing where one of them is 0:

    ``frac``, the frequency response assurance criterion |sum m c*|^2 / (sum |m|^2 sum |c|^2), 1
    where they are the same but for a factor; ``level_dB`` of the measured over the computed one, by
    mean squares.
    """
    m, c = (float(np.vdot(x, x).real) for x in (measured, computed))
    if not m * c:
        return {}
    criterion = float(abs(np.vdot(computed, measured)) ** 2 / (m * c))
    return {"frac": criterion, "level_dB": float(10 * np.log10(m / c))}


def points_of(functions: Sequence[MeasuredResponse]) -> Mapping[str, str]:
    """The points of measured functions, as ``excite`` and ``respond`` of a request."""
    return {
        name: ",".join(dict.fromkeys(str(getattr(each, name)) for each in functions))
        for name in ("excite", "respond")
    }
