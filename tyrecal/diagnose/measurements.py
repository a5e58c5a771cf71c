"""Measured frequencies (and the weighed mass) from CSV files."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from ..case.usual import LARGEST_SIGMA, MEASURED
from ..errors import InputError
from ..files import read_bytes
from ..modes.mode import Label

COLUMNS = ("quantity", "c", "m", "kind", "member", "pressure_kPa", "load_N", "value", "sigma")
QUANTITIES = ("frequency_Hz", "contact_area_m2", "vertical_stiffness_N_per_m", "mass_kg")
PRESSURES_kPa = (20.0, 2000.0)
MOST_ROWS = 10_000


@dataclass(frozen=True)
class Reading:
    """A line of the file. label: None for what is no frequency; member: 1 or 2 of a pair,
    ``symmetric`` or ``antisymmetric`` under load, "" where one value stands for both; value and
    sigma (standard deviation) in the unit of ``quantity``."""

    quantity: str
    label: Label | None
    member: str
    pressure_kPa: float
    load_N: float
    value: float
    sigma: float
    line: int
    file: str = ""

    @property
    def place(self) -> str:
        """Where it stands, in words."""
        return f"{self.file}, line {self.line}" if self.file else f"line {self.line}"


def read_measurements(path: Path) -> list[Reading]:
    """Readings of a CSV file. Raises InputError with every mistake, OSError."""
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: the text must be in UTF-8") from None
    rows = csv.reader(io.StringIO(text))
    try:
        header = [name.strip() for name in next(rows, [])]
        lines = [(rows.line_num, row) for row in rows if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(f"{path}, line {rows.line_num}: not CSV: {error}") from None
    missing = [name for name in COLUMNS if name not in header]
    if missing or len(header) != len(COLUMNS):
        raise InputError(
            f"{path}, line 1: the columns must be {','.join(COLUMNS)}, with commas between;"
            " 'tyrecal measured import' makes such a file of other tables"
        )
    if not lines:
        raise InputError(f"{path}: there is no measurement in it")
    if len(lines) > MOST_ROWS:
        raise InputError(f"{path}: more than {MOST_ROWS} lines")
    readings, mistakes = [], []
    for number, row in lines:
        if len(row) != len(header):
            mistakes.append(f"{path}, line {number}: {len(row)} cells, must be {len(header)}")
            continue
        cells = {name: cell.strip() for name, cell in zip(header, row, strict=True)}
        found = list(_mistakes(cells))
        mistakes += [f"{path}, line {number}: {mistake}" for mistake in found]
        if not found:
            readings.append(_reading(cells, number, path.name))
    if not mistakes:
        mistakes = [f"{path}, line {n}: {words}" for n, words in _together(readings)]
    if mistakes:
        raise InputError("\n".join(mistakes))
    return readings


def _mistakes(cells: dict[str, str]) -> Iterator[str]:
    """What is wrong with one line, in a sentence each."""
    quantity = cells["quantity"]
    if quantity not in QUANTITIES:
        yield f"quantity is '{quantity}', must be one of {', '.join(QUANTITIES)}"
        return
    value, sigma = _number(cells["value"]), _number(cells["sigma"])
    if value is None or value <= 0:
        yield f"value is '{cells['value']}', must be a number greater than 0"
    elif refusal := MEASURED[quantity].refusal(value):
        yield f"value is {value:g}: no tyre has that {quantity}, {refusal}"
    if sigma is None or sigma <= 0:
        yield f"sigma is '{cells['sigma']}', must be the standard deviation, greater than 0"
    elif value and sigma > LARGEST_SIGMA * value > 0:
        yield f"sigma is {sigma:g}, more than {LARGEST_SIGMA:.0%} of the value {value:g}"
    pressure = _number(cells["pressure_kPa"])
    if quantity == "mass_kg" and not cells["pressure_kPa"]:
        pressure = PRESSURES_kPa[0]
    if pressure is None or not PRESSURES_kPa[0] <= pressure <= PRESSURES_kPa[1]:
        yield (
            f"pressure_kPa is '{cells['pressure_kPa']}', must be between {PRESSURES_kPa[0]:g} and"
            f" {PRESSURES_kPa[1]:g}"
        )
    load = _number(cells["load_N"] or "0")
    if load is None or load < 0:
        yield f"load_N is '{cells['load_N']}', must be a number of at least 0, or empty"
    elif not load and quantity in ("contact_area_m2", "vertical_stiffness_N_per_m"):
        yield f"load_N is '{cells['load_N']}', must be greater than 0 for {quantity}"
    if quantity == "frequency_Hz":
        yield from _mode_mistakes(cells, bool(load))
    elif any(cells[name] for name in ("c", "m", "kind", "member")):
        yield f"c, m, kind and member must be empty for {quantity}"


def _mode_mistakes(cells: dict[str, str], loaded: bool) -> Iterator[str]:
    for name, most in (("c", 20), ("m", 3)):
        if not (cells[name].isdecimal() and int(cells[name]) <= most):
            yield f"{name} is '{cells[name]}', must be a whole number from 0 to {most}"
            return
    zero = int(cells["c"]) == int(cells["m"]) == 0
    kind, member = cells["kind"], cells["member"]
    if zero and kind not in ("axial", "torsional"):
        yield f"kind is '{kind}', must be axial or torsional for [0,0]"
    if not zero and kind:
        yield f"kind is '{kind}', must be empty: only [0,0] has one"
    allowed = ["symmetric", "antisymmetric"] if loaded else ["1", "2", ""]
    if int(cells["c"]) == 0 and not loaded:
        allowed = [""]
    if member not in allowed:
        words = " or ".join(each or "empty" for each in allowed)
        yield f"member is '{member}', must be {words} here"


def _reading(cells: dict[str, str], line: int, file: str) -> Reading:
    label = None
    if cells["quantity"] == "frequency_Hz":
        label = Label(int(cells["c"]), int(cells["m"]), cells["kind"] or None)
    return Reading(
        cells["quantity"],
        label,
        cells["member"],
        float(cells["pressure_kPa"] or 0),
        float(cells["load_N"] or 0),
        float(cells["value"]),
        float(cells["sigma"]),
        line,
        file,
    )


def _together(readings: list[Reading]) -> Iterator[tuple[int, str]]:
    """What is wrong between the lines."""
    seen: dict[tuple[object, ...], Reading] = {}
    for each in readings:
        place = (each.quantity, each.label, each.pressure_kPa, each.load_N)
        first = seen.setdefault((*place, each.member), each)
        if first is not each:
            yield each.line, f"measures the same as line {first.line}"
        other = seen.get((*place, "")) if each.member else None
        other = other or next((seen[(*place, m)] for m in "12" if (*place, m) in seen), None)
        if other and bool(other.member) != bool(each.member):
            yield each.line, f"gives a pair a member, line {other.line} gives it one value for both"


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) else None
