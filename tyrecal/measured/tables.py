"""Modal tables: CSV files as laboratories and spreadsheets write them.

A table has a line of headings; each says what the column holds, and its unit in brackets or
after a low line: ``Frequency [Hz]``, ``f (Hz)``, ``Fülldruck [bar]``, ``pressure_kPa``. The
measurements CSV is such a table, too. Cells are separated by commas, semicolons or tabs; with the
latter two a decimal comma is read as well.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import isfinite, nan
from pathlib import Path

from .. import units
from ..diagnose.measurements import COLUMNS, QUANTITIES
from ..errors import InputError
from ..files import read_bytes
from ..modes.mode import Label
from .values import Value, implausible

MOST_LINES = 10_000
HEADINGS = {
    "frequency_Hz": "frequency freq f fn eigenfrequency natural_frequency resonance_frequency"
    " frequenz eigenfrequenz frequence frequence_propre",
    "contact_area_m2": "contact_area area footprint_area kontaktflache aufstandsflache",
    "vertical_stiffness_N_per_m": "vertical_stiffness radial_stiffness stiffness kz"
    " vertikalsteifigkeit federrate",
    "mass_kg": "mass tyre_mass tire_mass weight masse gewicht",
    "label": "label mode mode_shape shape form eigenform modenform",
    "c": "c n circumferential circumferential_order circumferential_harmonic waves harmonic"
    " wave_number umfangsordnung",
    "m": "m meridional meridional_order lateral_order querordnung",
    "kind": "kind type art",
    "member": "member half doublet",
    "pressure": "pressure inflation inflation_pressure p druck innendruck fulldruck reifendruck"
    " luftdruck pression",
    "load": "load vertical_load wheel_load fz last radlast charge",
    "sigma": "sigma std stdev stddev sd std_dev standard_deviation uncertainty unsicherheit"
    " standardabweichung",
    "run": "run repeat repetition test messung wiederholung",
    "quantity": "quantity",
    "value": "value",
}
MEANING = {name: meaning for meaning, names in HEADINGS.items() for name in names.split()}
LABEL = re.compile(r"^[\[(]?\s*(\d+)\s*[,;/ ]\s*(\d+)\s*[\])]?\s*(.*)$")
BRACKET = re.compile(r"^[\[(]\s*\d+$")  # a label that its comma has parted
LONGEST = 300  # characters of a cell
KINDS = {
    "axial": "axial",
    "lateral": "axial",
    "torsional": "torsional",
    "torsion": "torsional",
    "rotational": "torsional",
    "": None,
}
MEMBERS = {
    "": "",
    "1": "1",
    "2": "2",
    "a": "1",
    "b": "2",
    "lower": "1",
    "upper": "2",
    "symmetric": "symmetric",
    "antisymmetric": "antisymmetric",
}


@dataclass(frozen=True)
class Column:
    """What a column holds, its number, and the factor to our unit; 0.01 of the value for %.

    of: the quantity that a sigma's unit belongs to, "" where it has none or is in %.
    """

    meaning: str
    index: int
    factor: float
    percent: bool = False
    of: str = ""


def read_table(path: Path, pressure_kPa: float | None = None) -> list[Value]:
    """Values of a modal table; ``pressure_kPa`` where the table has no column for it.

    Raises InputError with every mistake, each with file and line; OSError.
    """
    lines, comma = _lines(path)
    number, headings = lines[0]
    columns = _columns(headings, f"{path}, line {number}", pressure_kPa)
    if len(lines) == 1:
        raise InputError(f"{path}: there is no measurement in it")
    if len(lines) > MOST_LINES:
        raise InputError(f"{path}: more than {MOST_LINES} lines")
    values: list[Value] = []
    mistakes: list[str] = []
    for number, cells in lines[1:]:
        place = f"{path}, line {number}"
        try:
            if len(cells) != len(headings):
                parted = any(BRACKET.match(cell) for cell in cells)
                hint = '; write labels in quotes, "[1,1]", or in columns c and m' if parted else ""
                raise ValueError(f"{len(cells)} cells, the headings are {len(headings)}{hint}")
            found = list(_values(cells, columns, comma, pressure_kPa, f"{path}", place))
            wrong = [words for value in found if (words := implausible(value))]
            if wrong:
                raise ValueError(wrong[0])
            values += found
        except ValueError as error:
            mistakes.append(f"{place}: {error}")
    mistakes += [] if mistakes else _swapped(values)
    if mistakes:
        raise InputError("\n".join(mistakes))
    return _runs(values, any(column.meaning == "run" for column in columns))


def _lines(path: Path) -> tuple[list[tuple[int, list[str]]], bool]:
    """Lines that are not empty, with their numbers; whether a comma can be a decimal one."""
    raw = read_bytes(path)
    if raw[:2] == b"PK":
        raise InputError(f"{path}: a workbook; save the sheet as CSV")
    wide = raw[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = raw.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("cp1252", errors="replace")
    if "\0" in text:
        raise InputError(f"{path}: neither text nor a universal file")
    first = 0
    if text.startswith("sep="):  # Excel's own way to name the separator
        first, text = 1, text.partition("\n")[2]
    heading = next((line for line in text.splitlines() if line.strip()), "")
    separator = max(";\t", key=heading.count)
    if not heading.count(separator):
        separator = ","
    rows = csv.reader(io.StringIO(text), delimiter=separator, skipinitialspace=True)
    try:
        found = [(first + rows.line_num, [cell.strip() for cell in row]) for row in rows]
    except csv.Error:
        raise InputError(f"{path}, line {first + rows.line_num}: not CSV") from None
    found = [(number, row) for number, row in found if any(row)]
    for number, row in found:
        if (long := max(map(len, row))) > LONGEST:  # patterns tried on it would take for ever
            raise InputError(f"{path}, line {number}: a cell of {long} characters")
    if not found:
        raise InputError(f"{path}: the file is empty")
    return found, separator != ","


def _columns(headings: list[str], place: str, pressure_kPa: float | None) -> list[Column]:
    columns: list[Column] = []
    own = headings == list(COLUMNS)
    for index, heading in enumerate(headings):
        name, unit = _heading(heading)
        meaning = MEANING.get(name)
        if meaning is None:
            continue  # damping, remarks and the like
        if any(column.meaning == meaning for column in columns):
            raise InputError(f"{place}: two columns are the {meaning}; rename one")
        factor = 1.0
        table = {"pressure": units.PRESSURE, "load": units.LOAD, **units.QUANTITIES}.get(meaning)
        if table and not unit and meaning != "frequency_Hz":
            raise InputError(
                f"{place}: '{heading}' has no unit; write it as '{heading} [{next(iter(table))}]'"
            )
        if table and unit:
            known = units.factor(table, unit)
            if known is None:
                raise InputError(
                    f"{place}: '{heading}': the unit must be one of {', '.join(table)}"
                )
            factor = known
        columns.append(Column(meaning, index, factor, unit == "%"))
        if meaning == "sigma" and unit and unit != "%":
            found = ((q, units.factor(each, unit)) for q, each in units.QUANTITIES.items())
            of, known = next((each for each in found if each[1]), ("", None))
            if known is None:
                raise InputError(f"{place}: '{heading}': unknown unit")
            columns[-1] = Column(meaning, index, known, of=of)
    held = {column.meaning for column in columns}
    if not own and not held & set(QUANTITIES) and not {"quantity", "value"} <= held:
        raise InputError(
            f"{place}: no column holds a frequency; headings must be like"
            " 'c; m; pressure [bar]; frequency [Hz]'"
        )
    if "frequency_Hz" in held and "label" not in held and not {"c", "m"} <= held:
        raise InputError(f"{place}: frequencies need the columns c and m, or a column label")
    if "pressure" not in held and pressure_kPa is None and held & {"frequency_Hz", "quantity"}:
        raise InputError(f"{place}: no column holds the pressure; give --pressure-kPa")
    return columns


def _heading(text: str) -> tuple[str, str]:
    """Name and unit of a heading: 'Frequency [Hz]' -> 'frequency', 'hz'."""
    match = re.match(r"^(.*?)\s*(?:[\[(](.*?)[\])]\s*)?$", text.strip())
    name, unit = (match.group(1), match.group(2) or "") if match else (text, "")
    name = name.lower().translate(str.maketrans("éèêüäö", "eeeuao")).strip(" .:")
    if not unit:
        for end in (
            "_hz",
            "_kpa",
            "_bar",
            "_psi",
            "_n",
            "_m2",
            "_n_per_m",
            "_kg",
            "_kn",
            "_percent",
        ):
            if re.sub(r"\s", "_", name).endswith(end) and name != end:
                name, unit = name[: -len(end)], end[1:]
    unit = "%" if unit == "percent" else unit
    return re.sub(r"[\s\-_.]+", "_", name).strip("_"), units.plain(unit)


def _values(
    cells: list[str],
    columns: list[Column],
    comma: bool,
    pressure_kPa: float | None,
    run: str,
    place: str,
) -> Iterator[Value]:
    """Values of one line. Raises ValueError with what is wrong."""
    text = {column.meaning: cells[column.index] for column in columns}
    factor = {column.meaning: column for column in columns}

    def number(meaning: str, default: float | None = None) -> float:
        cell = text.get(meaning, "")
        if not cell and default is not None:
            return default
        try:
            value = float(cell.replace(",", ".") if comma else cell)
        except ValueError:
            value = nan
        if not isfinite(value):
            raise ValueError(f"{meaning} is '{cell}', must be a number")
        return value * factor[meaning].factor

    pressure = number("pressure", pressure_kPa or 0.0)
    load = number("load", 0.0)
    if load < 0:
        raise ValueError(f"load is {load:g}, must be at least 0")
    quantities = [q for q in QUANTITIES if text.get(q)]
    if text.get("value"):
        quantities = [text.get("quantity", "")]
        if quantities[0] not in QUANTITIES:
            raise ValueError(
                f"quantity is '{quantities[0]}', must be one of {', '.join(QUANTITIES)}"
            )
    if not quantities:
        raise ValueError("nothing was measured: the cell of the value is empty")
    sigma = factor["sigma"] if text.get("sigma") else None
    if sigma and sigma.of and sigma.of not in quantities:
        raise ValueError(f"sigma has the unit of {sigma.of}, which has no value here")
    if sigma and not sigma.of and not sigma.percent and len(quantities) > 1:
        raise ValueError(
            f"sigma can be that of {' or '.join(quantities)}: write its unit, as in 'sigma [Hz]',"
            " or 'sigma [%]' for all of them"
        )
    for quantity in quantities:
        value = number("value" if text.get("value") else quantity)
        label, member = None, ""
        if quantity == "frequency_Hz":
            label, member = _label(text), _member(text.get("member", ""), bool(load))
        own = number("sigma") if sigma and sigma.of in ("", quantity) else None
        if own is not None and sigma and sigma.percent:
            own *= 0.01 * value
        name = f"{run} {text['run']}" if text.get("run") else run
        at = 0.0 if quantity == "mass_kg" else pressure
        yield Value(quantity, label, member, at, load, value, own, name, place)


def _label(text: dict[str, str]) -> Label:
    c, m, kind = text.get("c", ""), text.get("m", ""), text.get("kind", "")
    if text.get("label") and "c" not in text:  # beside c and m it is the mode's number
        match = LABEL.match(text["label"])
        if not match:
            raise ValueError(
                f"label is '{text['label']}', must be like [2,1], or [0,0] lateral or torsional"
            )
        c, m, kind = match.group(1), match.group(2), kind or match.group(3)
    for name, cell, most in (("c", c, 20), ("m", m, 3)):
        if not (cell.isdecimal() and int(cell) <= most):
            raise ValueError(f"{name} is '{cell}', must be a whole number from 0 to {most}")
    word = kind.strip().lower()
    if word not in KINDS:
        raise ValueError(f"kind is '{kind}', must be lateral (axial), torsional or empty")
    zero = int(c) == int(m) == 0
    if zero and not word:
        raise ValueError("[0,0] needs a kind, lateral (axial) or torsional")
    return Label(int(c), int(m), KINDS[word] if zero else None)


def _member(cell: str, loaded: bool) -> str:
    word = cell.lower()
    if word not in MEMBERS:
        raise ValueError(f"member is '{cell}', must be 1, 2, symmetric, antisymmetric or empty")
    if loaded != (MEMBERS[word] in ("symmetric", "antisymmetric")):
        words = "symmetric or antisymmetric" if loaded else "1, 2 or empty"
        raise ValueError(
            f"member is '{cell}', must be {words} {'under load' if loaded else 'here'}"
        )
    return MEMBERS[word]


def _swapped(values: list[Value]) -> list[str]:
    """What is wrong with the columns as a whole."""
    f = [value for value in values if value.quantity == "frequency_Hz"]
    if len(f) < 4:
        return []
    frequencies, pressures = {v.value for v in f}, {v.pressure_kPa for v in f}
    if len(pressures) > len(f) / 2 and len(frequencies) < len(pressures):
        return [
            f"{f[0].place}: the pressure differs from line to line, the frequency hardly; are the"
            " columns swapped?"
        ]
    tall = [v for v in f if v.label and v.label.m > v.label.c]
    if len(tall) > len(f) / 2:
        return [f"{tall[0].place}: most modes have m above c; are the columns c and m swapped?"]
    return []


def _runs(values: list[Value], named: bool) -> list[Value]:
    """Lines that measure the same: runs, or the two members of a doublet.

    Without a column for the run: where every label stands k times, or one without waves does, they
    are k runs; two of a label with waves, where those without stand once, are its members.
    """
    times = Counter((value.run, value.key) for value in values)
    worst = max(times.values(), default=1)
    if worst == 1:
        return values
    twice = [key for (_, key), k in times.items() if k > 1]
    once = [key for (_, key), k in times.items() if k == 1]
    waves = all(key[1] is not None and key[1].c and not key[2] and not key[4] for key in twice)
    flat = any(key[1] is not None and not key[1].c for key in once)
    doubled = next(v for v in values if times[(v.run, v.key)] > 1)
    name = doubled.label.said if doubled.label else None
    if named and not (worst == 2 and waves):
        raise InputError(f"{doubled.place}: {name} stands twice in one run")
    if worst == 2 and waves and not (flat or named):
        raise InputError(
            f"{doubled.place}: {name} stands twice; repeats, or the two of a doublet?"
            " Say it in a column run or member"
        )
    members = worst == 2 and waves
    seen: Counter[tuple[str, object]] = Counter()
    result = []
    for value in values:
        seen[value.run, value.key] += 1
        nth = seen[value.run, value.key]
        if members and times[(value.run, value.key)] == 2:
            result.append(replace(value, member=str(nth)))
        else:
            result.append(value if members else replace(value, run=f"{value.run} {nth}"))
    return result
