"""Modal tables: CSV files as laboratories and spreadsheets write them.

A table has a line of headings; each says what the column holds, and its unit in brackets or
after a low line: ``Frequency [Hz]``, ``f (Hz)``, ``Fülldruck [bar]``, ``pressure_kPa``. The
measurements CSV is such a table, too. ``tyre.number_table`` reads cells and numbers.

Files of other formats are recognised by how they begin, so that a message can name them.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from math import isnan
from pathlib import Path

from ..errors import InputError
from ..files import read_bytes
from ..tyre.number_table import NumberMarks, cells_under, read_text_table
from ..tyre.usual import MAX_SIGMA
from ..units import QUANTITIES
from .columns import NUMBER_MEANINGS, TableColumn, is_unit, meaning_of, read_columns, unit_of
from .line import Line
from .measurement import CSV_COLUMNS, DAMPING_RATIO, RIM_COLUMN, Measurement

HEAD = 4096  # bytes that tell
PROPERTY_FILE, TYDEX = "tyre property file (.tir)", "TYDEX file"
FORMATS = (
    (rb"MATLAB [57]\.\d MAT-file", "MATLAB file (.mat)"),
    (rb"\x89HDF\r\n\x1a\n", "HDF5 file"),
    (
        rb"(?im)^\s*\[(?:MDI_HEADER|UNITS|MODEL|DIMENSION|OPERATING_CONDITIONS|VERTICAL)\]",
        PROPERTY_FILE,
    ),
    (rb"(?im)^\*\*(?:HEADER|CONSTANTS|MEASURCHANNELS)", TYDEX),
)


def other_format(raw: bytes) -> str | None:
    """Name of the format of a file that is neither a table nor a universal file; None if it may
    be one. raw: the file, or its first 4096 bytes."""
    head = raw[:HEAD]
    return next((name for pattern, name in FORMATS if re.search(pattern, head)), None)


MAX_LINES = 10_000  # of a file
MAX_TITLES = 20  # lines in which the headings are looked for
WITH_UNIT = re.compile(r"([+-]?[\d.,' ]*\d[.,]?(?:[eE][+-]?\d+)?)\s*([^\d\s.,].*)")
GAPS = {"n.a.", "na", "n/a", "n. a.", "#n/a", "#nv", "k.a.", "n.d.", "nd", "-", "--", "\u2013"}
RUNNING_NUMBER = re.compile(r"(?:mode|nr|no|#)?[\s._-]*(\d+)\.?", re.IGNORECASE)
OPENED = re.compile(r"^[\[(]\s*\d+$")  # a label that its comma has parted


def read_measurements(path: Path, labelled: bool = True) -> list[Measurement]:
    """A table that can be used as it is: the measurements CSV with `CSV_COLUMNS`, or another all of
    whose columns are known, with every sigma; it measures nothing twice.

    labelled: every frequency needs a label; else those of the unloaded tyre may have none. Raises
    InputError with every mistake, each with file and line; OSError.
    """
    lines, separator = _lines(path)
    place, headings = lines[0]
    known = [meaning_of(heading) for heading in headings]
    own = "quantity" in known and {*headings} - {RIM_COLUMN} != {*CSV_COLUMNS}
    if own or None in known or "sigma" not in known:
        raise InputError(
            f"{place}: the columns must be {','.join(CSV_COLUMNS)}, and {RIM_COLUMN} where it is"
            " not the case's, or like label,frequency_Hz,sigma_Hz,pressure_kPa,load_N,rim;"
            " 'tyrecal measured import' makes such a file of other tables"
        )
    columns = read_columns(headings, place, None)
    measurements = _measurements(
        path, lines, columns, separator, 0.0, _sigma_mistake, labelled=False
    )
    if labelled and (lacking := next((each for each in measurements if each.is_unlabelled), None)):
        raise InputError(
            f"{lacking.place}: the frequency has no label, c and m; --measured of 'tyrecal fit' and"
            " 'tyrecal diagnose', and 'tyrecal measured label' find it"
        )
    _refuse(_twice(measurements))
    return measurements


def read_table(path: Path, pressure_kPa: float | None = None) -> list[Measurement]:
    """A modal table; ``pressure_kPa`` where it has no column for it. Lines that measure the same
    are runs of their own; each frequency without a label is a mode that has none yet.

    Raises InputError with every mistake, each with file and line; OSError.
    """
    lines, separator = _lines(path)
    place, headings = lines[0]
    columns = read_columns(headings, place, pressure_kPa)
    measurements = _measurements(
        path, lines, columns, separator, pressure_kPa or 0.0, labelled=False
    )
    _refuse(_swapped(measurements))
    unlabelled = [each for each in measurements if each.is_unlabelled]
    named = [each for each in measurements if not each.is_unlabelled]
    return [*_runs(named, "run" in columns), *unlabelled]


def _measurements(
    path: Path,
    lines: list[tuple[str, list[str]]],
    columns: dict[str, TableColumn],
    separator: str,
    pressure_kPa: float,
    more: Callable[[Measurement], str | None] = lambda each: None,
    labelled: bool = True,
) -> list[Measurement]:
    """Measurements in all lines; ``more``: a further mistake in one of them. Raises InputError."""
    if len(lines) == 1:
        raise InputError(f"{path}: there is no measurement in it")
    if len(lines) > MAX_LINES:
        raise InputError(f"{path}: more than {MAX_LINES} lines")
    measurements: list[Measurement] = []
    mistakes: list[str] = []
    headings = lines[0][1]
    label = columns.get("label")
    if (
        label
        and "c" not in columns
        and _counts([cells[label.index] for _, cells in lines[1:] if label.index < len(cells)])
    ):
        columns = {meaning: each for meaning, each in columns.items() if meaning != "label"}
    numbers = [column.index for meaning, column in columns.items() if meaning in NUMBER_MEANINGS]
    written = [cells[i] for _, cells in lines[1:] for i in numbers if i < len(cells)]
    marks = NumberMarks.of(written, separator)
    for place, cells in lines[1:]:
        try:
            if len(cells) != len(headings) and any(OPENED.match(cell) for cell in cells):
                hint = 'write labels in quotes, "[1,1]", or in columns c and m'
                raise InputError(f"{len(cells)} cells, the headings are {len(headings)}; {hint}")
            cells = cells_under(headings, cells)
            text = {meaning: cells[column.index] for meaning, column in columns.items()}
            if any(is_gap(text.get(name, "")) for name in ("value", *QUANTITIES)) and not any(
                text.get(name) and not is_gap(text[name]) for name in ("value", *QUANTITIES)
            ):
                continue  # not measured, as the line says
            text = {meaning: "" if is_gap(cell) else cell for meaning, cell in text.items()}
            line = Line(place, text, columns, marks, labelled)
            values = list(line.measurements(pressure_kPa, f"{path}"))
            for each in values:
                if mistake := each.mistake or more(each):
                    raise InputError(mistake)
            measurements += values
        except InputError as error:
            mistakes.append(f"{place}: {error}")
    _refuse(mistakes)
    return _with_damping(measurements)


def _counts(labels: list[str]) -> bool:
    """Whether labels are running numbers, which name no mode: each one more than the one above, or
    1 again, as in another state."""
    matches = [RUNNING_NUMBER.fullmatch(label) for label in labels if label]
    numbers = [int(match[1]) for match in matches if match]
    counted = all(n in (1, before + 1) for n, before in zip(numbers, [0, *numbers], strict=False))
    return bool(numbers) and len(numbers) == len(matches) and counted


def _with_damping(measurements: list[Measurement]) -> list[Measurement]:
    """Frequencies with the damping ratios of their modes, and all else. Raises InputError where
    there is a damping ratio without the frequency of its mode in the same state."""
    ratios = {_of_mode(each): each for each in measurements if each.quantity == DAMPING_RATIO}
    others = [each for each in measurements if each.quantity != DAMPING_RATIO]
    known = {_of_mode(each) for each in others if each.quantity == "frequency_Hz"}
    _refuse(
        f"{each.place}: there is no frequency_Hz of {each.name} in the same state"
        for mode, each in ratios.items()
        if mode not in known
    )
    return [
        replace(each, damping_ratio=ratio.value, damping_sigma=ratio.sigma)
        if each.quantity == "frequency_Hz" and (ratio := ratios.get(_of_mode(each)))
        else each
        for each in others
    ]


def _of_mode(each: Measurement) -> tuple[object, ...]:
    return (*each.key[1:], each.run)


def _refuse(mistakes: Iterable[str]) -> None:
    """Raises InputError where there are mistakes."""
    if text := "\n".join(mistakes):
        raise InputError(text)


def _lines(path: Path) -> tuple[list[tuple[str, list[str]]], str]:
    """Lines that are not empty, with their places, the headings first; what separates cells."""
    if name := other_format(read_bytes(path)):
        way = (
            "'tyrecal measured import' makes a table of it"
            if name in (PROPERTY_FILE, TYDEX)
            else "tyrecal reads tables (CSV) and universal files with mode shapes or"
            " frequency-response functions: export one of these"
        )
        raise InputError(f"{path}: this is a {name}; {way}")
    try:
        table = read_text_table(path)
        lines = _with_one_heading(table.lines)
    except InputError as error:
        line = f", line {error.line}" if error.line else ""
        raise InputError(f"{path}{line}: {error}") from None
    return [(f"{path}, line {line}", cells) for line, cells in lines], table.separator


def _with_one_heading(lines: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """The lines from that of the headings on, without titles above it, and with the units of a
    second line of headings, or of all cells of a column, in the headings."""
    known = [sum(meaning_of(cell) is not None for cell in cells) for _, cells in lines[:MAX_TITLES]]
    start = next((i for i, count in enumerate(known) if count > 1), 0)
    for line, cells in lines[:start]:
        if meaning_of(cells[0]) in ("load", "pressure", "rim") and any(cells[1:]):
            raise InputError(f"'{cells[0]}' above the headings is not read: make it a column", line)
    (line, headings), rows = lines[start], lines[start + 1 :]
    headings = list(headings)
    second = rows[0][1] if rows else []
    if any(second) and all(not cell or is_unit(cell.strip("[]()")) for cell in second):
        for i, cell in enumerate(second[: len(headings)]):
            if cell:
                headings[i] += f" [{cell.strip('[]()')}]"
        del rows[0]
    rows = [(number, list(cells)) for number, cells in rows]
    for i, heading in enumerate(headings):
        if meaning_of(heading) in NUMBER_MEANINGS:
            _move_unit(headings, [cells for _, cells in rows if i < len(cells)], i)
    return [(line, headings), *rows]


def _move_unit(headings: list[str], rows: list[list[str]], column: int) -> None:
    """Move a unit that all cells of a column have to its heading, where that has none or the
    same."""
    filled = [cells for cells in rows if cells[column] and not is_gap(cells[column])]
    matches = [WITH_UNIT.fullmatch(cells[column]) for cells in filled]
    units = {match[2] if match else "" for match in matches}
    if len(units) != 1 or not is_unit(unit := units.pop()):
        return
    stated = unit_of(headings[column])
    if stated and stated != unit_of(f"x [{unit}]"):
        return
    headings[column] += "" if stated else f" [{unit}]"
    for cells, match in zip(filled, matches, strict=True):
        cells[column] = match[1] if match else ""


def is_gap(cell: str) -> bool:
    """Whether a cell marks a value that was not measured."""
    return cell.lower() in GAPS


def _sigma_mistake(each: Measurement) -> str | None:
    """Why a measurement's standard deviation cannot be right, or None."""
    if isnan(each.sigma) and each.quantity != DAMPING_RATIO:  # has a default
        return "sigma is '', must be the standard deviation, greater than 0"
    if each.sigma > (1.0 if each.quantity == DAMPING_RATIO else MAX_SIGMA) * each.value:
        most = f"{100 * MAX_SIGMA:.0f} %"
        return f"sigma is {each.sigma:g}, more than {most} of the value {each.value:g}"
    return None


def _twice(measurements: list[Measurement]) -> Iterator[str]:
    """Lines that measure what another does."""
    seen: dict[tuple[object, ...], Measurement] = {}
    for each in measurements:
        if each.is_unlabelled:
            continue
        place = (each.quantity, each.label, each.state)
        first = seen.setdefault((*place, each.member), each)
        if first is not each:
            yield f"{each.place}: measures the same as {_line(first)}"
        other = seen.get((*place, "")) if each.member else None
        other = other or next((seen[(*place, m)] for m in "12" if (*place, m) in seen), None)
        if other and bool(other.member) != bool(each.member):
            reason = f"{_line(other)} gives it one value for both"
            yield f"{each.place}: gives a pair a member, {reason}"


def _line(each: Measurement) -> str:
    return each.place.rpartition(", ")[2]


def _swapped(values: list[Measurement]) -> list[str]:
    """Mistakes in the columns as a whole."""
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


def _runs(values: list[Measurement], named: bool) -> list[Measurement]:
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
    # a key is the quantity, label, member, pressure, load and rim
    waves = all(key[1] is not None and key[1].c and not key[2] and not key[4] for key in twice)
    flat = any(key[1] is not None and not key[1].c for key in once)
    members = worst == 2 and waves
    doubled = next(v for v in values if times[v.run, v.key] > 1)
    if named and not members:
        raise InputError(f"{doubled.place}: {doubled.name} is given twice in one run")
    if members and not (flat or named):
        raise InputError(
            f"{doubled.place}: {doubled.name} is given twice: add a column run (repeats) or member"
            " (the two modes of a pair)"
        )
    if members:  # the lower one is 1, whatever the order of the lines
        ranks: Counter[tuple[str, object]] = Counter()
        member: dict[int, str] = {}
        for value in sorted(values, key=lambda each: each.value):
            at = value.run, value.key
            ranks[at] += 1
            member[id(value)] = str(ranks[at]) if times[at] == 2 else value.member
        return [replace(value, member=member[id(value)]) for value in values]
    seen: Counter[tuple[str, object]] = Counter()
    result = []
    for value in values:
        at = value.run, value.key
        seen[at] += 1
        result.append(replace(value, run=f"{value.run} {seen[at]}"))
    return result
