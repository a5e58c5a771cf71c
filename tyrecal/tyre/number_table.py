"""The one reader of tables: measurements, stations of a section, curves of an outline.

Spreadsheets and programs write the same table in many ways. Read are commas, semicolons and tabs
between cells, UTF-8 and UTF-16 with or without a mark, and decimal points as well as commas. A
number such as 4.000 is 4 or 4000, depending on who wrote it: the other numbers of its file decide,
and where they contradict one reading it is refused, never guessed. Every table with numbers must
be read here.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from math import inf, nan
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from ..errors import InputError
from ..files import read_bytes

MAX_SHEET_ROWS = 10_002  # of a workbook's sheet
MAX_WORKBOOK_BYTES = 20_000_000  # unpacked
MAX_CELL = 300  # characters: patterns tried on more would take for ever
SEPARATORS = ("\t", ";", ",")
GROUP_SPACES = " \u00a0\u2009\u202f'\u2019"  # between thousands
SPACED = re.compile(rf"(?<=\d)[{GROUP_SPACES}](?=\d{{3}}(?!\d))")
NUMBER = re.compile(r"([+-]?)(\d[\d.,]*|[.,]\d+)([eE][+-]?\d{1,3})?")
ONE_MARK = re.compile(r"[1-9]\d{0,2}[.,]\d{3}")  # one thousand, or three digits behind the point


@dataclass(frozen=True)
class TextTable:
    """Lines of a table that are not empty: their numbers in the file and their cells, stripped."""

    separator: str
    lines: list[tuple[int, list[str]]]  # line from 1, cells


def read_text_table(path: Path) -> TextTable:
    """The cells of a file. Raises InputError, OSError."""
    return _text_table(read_bytes(path))


def _text_table(raw: bytes) -> TextTable:
    if raw[:2] == b"PK":
        return _checked(TextTable(",", _workbook_lines(raw)))
    text = _text(raw)
    first = 0
    separators: Sequence[str] = SEPARATORS
    if text.startswith("sep="):  # Excel's own way to name the separator
        named, _, text = text.partition("\n")
        first, separators = 1, [named[4:5] or ","]
    tables = [TextTable(each, _lines(text, each, first)) for each in separators]
    return _checked(max(tables, key=_regularity))  # of equals the first


def _checked(table: TextTable) -> TextTable:
    """The table, checked. Raises InputError where it is empty or a cell is too long."""
    if not table.lines:
        raise InputError("the file is empty", 1)
    for line, cells in table.lines:
        if (longest := max(map(len, cells))) > MAX_CELL:
            raise InputError(f"a cell of {longest} characters", line)
    return table


def _text(raw: bytes) -> str:
    wide = raw[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = raw.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        if wide:
            raise InputError("neither text nor a universal file") from None
        text = raw.decode("cp1252", errors="replace")
    if "\0" in text:
        raise InputError("neither text nor a universal file")
    return text


def _workbook_lines(raw: bytes) -> list[tuple[int, list[str]]]:
    """Rows of the one sheet of a workbook that holds anything."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise InputError(
            "this is a workbook: save the sheet as CSV, or run pip install '.[excel]' in a clone of"
            " tyrecal"
        ) from None
    try:
        with ZipFile(io.BytesIO(raw)) as parts:
            if sum(part.file_size for part in parts.infolist()) > MAX_WORKBOOK_BYTES:
                raise InputError("the workbook is too large: save the sheet as CSV")
        book = load_workbook(io.BytesIO(raw), data_only=True)
        sheets = {}
        for sheet in book.worksheets:
            rows = islice(sheet.iter_rows(), MAX_SHEET_ROWS)  # each as wide as the sheet
            texts = [[_cell_text(cell) for cell in row] for row in rows]
            for area in sheet.merged_cells.ranges:  # each of its cells holds what the first shows
                for row in texts[area.min_row - 1 : area.max_row]:
                    width = area.max_col - area.min_col + 1
                    first = texts[area.min_row - 1][area.min_col - 1]
                    row[area.min_col - 1 : area.max_col] = [first] * width
            if lines := [(i, cells) for i, cells in enumerate(texts, start=1) if any(cells)]:
                sheets[sheet.title] = lines
    except InputError:
        raise
    except Exception as error:  # openpyxl lets those of zip, XML and its own through
        words = f"not a workbook that can be read ({str(error)[:80]}): save the sheet as CSV"
        raise InputError(words) from None
    if len(sheets) != 1:
        names = ", ".join(sheets) or "none"
        raise InputError(f"one sheet must hold data, got {names}: save one as CSV")
    return next(iter(sheets.values()))


def _cell_text(cell: Any) -> str:
    """A cell of a workbook as a file of text has it; 0.005 that is shown as 0.5 % is '0.5 %'."""
    if isinstance(cell.value, float | int) and str(cell.number_format).endswith("%"):
        return f"{100 * cell.value:.12g} %"
    return "" if cell.value is None else str(cell.value).strip()


def _lines(text: str, separator: str, first: int) -> list[tuple[int, list[str]]]:
    rows = csv.reader(io.StringIO(text), delimiter=separator, skipinitialspace=separator != "\t")
    lines: list[tuple[int, list[str]]] = []
    try:
        for row in rows:
            cells = [cell.strip() for cell in row]
            if any(cells):
                lines.append((first + rows.line_num, cells))
    except csv.Error:
        raise InputError("not a table of text", first + rows.line_num) from None
    return lines


def _regularity(table: TextTable) -> int:
    """How many lines have the commonest number of cells, of lines with more than one."""
    widths = Counter(len(cells) for _, cells in table.lines if len(cells) > 1)
    return max(widths.values(), default=0)


def cells_under(headings: Sequence[str], cells: Sequence[str]) -> list[str]:
    """The cells of a line, one for each heading; only the first column, a number of the line, may
    have none. Raises InputError where there are others."""
    width = len(headings)
    if len(cells) < width or any(cells[width:]):
        raise InputError(f"{len(cells)} cells, the headings are {width}")
    for heading, cell in zip(headings[1:], cells[1:], strict=False):
        if cell and not heading:
            raise InputError(f"'{cell}' is in a column without a heading")
    return list(cells[:width])


@dataclass(frozen=True)
class NamedTable:
    """A table with our own headings: those of its columns in order, and its rows."""

    headings: list[str]
    rows: list[NamedRow]


@dataclass(frozen=True)
class NamedRow:
    """A line of a table: its number in the file, its cells by heading, the marks of numbers."""

    line: int
    cells: dict[str, str]
    marks: NumberMarks

    def millimetres(self, column: str) -> float:
        """The number in a column, NaN where it is empty. Raises InputError."""
        cell = self.cells[column]
        try:
            value = self.marks.number(cell) if cell else nan
        except InputError as error:
            must = str(error).replace("must be a number", "must be a number in mm")
            raise InputError(f"{column} is '{cell}', {must}", self.line) from None
        if abs(value) == inf:
            raise InputError(f"{column} is '{cell}', must be a number in mm", self.line)
        return value


def read_named_table(path: Path) -> NamedTable:
    """A table whose columns have our own names, those that end in ``_mm`` numbers. Raises
    InputError, OSError."""
    return named_table(read_bytes(path))


@lru_cache(maxsize=8)  # loading a case takes its table twice, studies of variants again and again
def named_table(raw: bytes) -> NamedTable:
    """The table in a file's content. Raises InputError."""
    table = _text_table(raw)
    first, headings = table.lines[0]
    for column, count in Counter(filter(None, headings)).items():
        if count > 1:
            raise InputError(f"column '{column}' is given {count} times", first)
    lines = []
    for line, cells in table.lines[1:]:
        try:
            lines.append((line, dict(zip(headings, cells_under(headings, cells), strict=True))))
        except InputError as error:
            raise InputError(str(error), line) from None
    numbers = [c for _, row in lines for name, c in row.items() if name.endswith("_mm")]
    marks = NumberMarks.of(numbers, table.separator)
    return NamedTable([*filter(None, headings)], [NamedRow(n, row, marks) for n, row in lines])


@dataclass(frozen=True)
class NumberMarks:
    """Marks that numbers of one file have without doubt: decimal ones, and between thousands."""

    decimal: frozenset[str]
    thousands: frozenset[str]

    @classmethod
    def of(cls, cells: Iterable[str], separator: str) -> NumberMarks:
        """The marks of the numbers among ``cells``; where commas separate cells, points are
        decimal."""
        pairs = [(".", "")] if separator == "," else []
        for cell in cells:
            if (match := NUMBER.match(_plain(cell))) and not _is_ambiguous(match):
                pairs.append(_marks(match[2]))
        decimal, thousands = zip(*pairs, strict=True) if pairs else ((), ())
        return cls(frozenset(decimal) - {""}, frozenset(thousands) - {""})

    def number(self, cell: str) -> float:
        """The number in a cell. Raises InputError with what would be right, in words that follow
        those of the cell."""
        match = NUMBER.fullmatch(_plain(cell))
        if not match:
            raise InputError("must be a number")
        sign, digits, exponent = match[1], match[2], match[3] or ""
        decimal, thousands = _marks(digits)
        if _is_ambiguous(match) and not self._is_decimal(digits, decimal):
            decimal, thousands = "", decimal
        whole, _, part = digits.partition(decimal) if decimal else (digits, "", "")
        groups = whole.split(thousands) if thousands else [whole]
        three = all(len(each) == 3 for each in groups[1:]) and len(groups[0]) <= 3
        if not all(each.isdigit() for each in filter(None, [*groups, part])) or (
            len(groups) > 1 and not (groups[0] and three)
        ):
            raise InputError("must be a number")
        return float(f"{sign}{''.join(groups)}.{part}{exponent}")

    def _is_decimal(self, digits: str, mark: str) -> bool:
        """Whether the mark before three digits is a decimal one. Raises InputError where the file
        has numbers for both readings."""
        other = ".,"[mark == "."]
        if mark in self.thousands and mark not in self.decimal:
            return False
        if mark not in self.thousands and other not in self.decimal:
            return True
        thousand, small = digits.replace(mark, ""), digits.replace(mark, ".").rstrip("0")
        small = small.rstrip(".")
        reason = "commas" if other == "," else "points"
        raise InputError(
            f"which can be {thousand} or {small}, because other numbers of the file have decimal"
            f" {reason}: write {thousand} or {small.replace('.', other)}"
        )


def _is_ambiguous(match: re.Match[str]) -> bool:
    """Whether a number such as 4.000 or 79,500 has two readings."""
    return not match[3] and ONE_MARK.fullmatch(match[2]) is not None


def _marks(digits: str) -> tuple[str, str]:
    """The decimal mark of a number and that between its thousands; the first where it can be
    either."""
    used = sorted(".,", key=digits.rfind)
    thousands, decimal = (mark if mark in digits else "" for mark in used)
    if not thousands and digits.count(decimal or " ") > 1:
        return "", decimal
    return decimal, thousands


def _plain(cell: str) -> str:
    """A cell without spaces and apostrophes between thousands, and with a plain minus."""
    return SPACED.sub("", cell.strip().replace("\u2212", "-"))
