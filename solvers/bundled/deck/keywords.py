"""ABAQUS keyword grammar: a deck as a list of keyword blocks that remember their lines.

Not by meshio, which reads nodes, elements and sets, passes over the rest, and knows no lines.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from ...errors import Refused

MAX_DECK_BYTES = 100_000_000


class LineNumber(int):
    """A 1-based line number that knows the job whose deck it counts in."""

    job = ""

    def __new__(cls, number: int, job: str) -> LineNumber:
        line = super().__new__(cls, number)
        line.job = job
        return line


class DeckError(Refused):
    """The deck asks for something that the solver cannot honour, or is not a deck.

    ``line``: 1-based line of the deck, 0 where no single line is to blame.
    """

    def __init__(self, line: int, message: str):
        job = getattr(line, "job", "")
        where = f"{job}.inp" if job else "deck"
        super().__init__(f"{where}, line {line}: {message}" if line else f"{where}: {message}")
        self.line = line


def read_deck(path: Path) -> str:
    """The text of a deck, or of what stands beside it. Raises DeckError where it is no file of
    text, or too large; OSError."""
    if path.exists() and not path.is_file():
        raise DeckError(0, f"{path.name} is not a regular file")
    with path.open("rb") as file:
        content = file.read(MAX_DECK_BYTES + 1)
    if len(content) > MAX_DECK_BYTES:
        raise DeckError(0, f"{path.name} is larger than {MAX_DECK_BYTES / 1e6:g} MB")
    try:
        return content.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        raise DeckError(0, f"{path.name} is not text in UTF-8") from None


@dataclass
class DataLine:
    """One data line."""

    line: int  # 1-based
    fields: list[str]  # between the commas
    # of a field's index: d number / d variable, where a slope is asked for
    tangents: Mapping[int, float] = field(default_factory=dict)

    def text(self, index: int, default: str = "") -> str:
        """Field ``index`` as text, or ``default`` when it is missing or blank."""
        value = self.fields[index] if index < len(self.fields) else ""
        return value or default

    def number(self, index: int, default: float | None = None) -> complex | float:
        """Field ``index`` as a number; complex by its tangent, where it has one."""
        text = self.text(index)
        if not text:
            if default is None:
                raise DeckError(self.line, f"number {index + 1} of the line is missing")
            return default
        try:
            value = float(text.replace("D", "E").replace("d", "e"))
        except ValueError:
            raise DeckError(self.line, f"'{text}' is not a number") from None
        if value - value != 0.0:
            raise DeckError(self.line, f"'{text}' is not a finite number")
        tangent = self.tangents.get(index)
        return value if tangent is None else complex(value, COMPLEX_STEP * tangent)

    def real(self, index: int, default: float | None = None) -> float:
        """Field ``index`` as a number without a tangent."""
        return self.number(index, default).real

    def integer(self, index: int) -> int:
        """Field ``index`` as an integer."""
        try:
            return int(self.text(index))
        except ValueError:
            raise DeckError(self.line, f"'{self.text(index)}' is not a whole number") from None


COMPLEX_STEP = 1e-30  # so small that its square vanishes against every real part


@dataclass
class Keyword:
    """One keyword with its parameters and its data lines."""

    name: str
    line: LineNumber
    parameters: dict[str, str]  # upper-case names
    lines: list[tuple[int, str]]  # 1-based numbers and texts
    # by line, then by field (see `seed`)
    tangents: Mapping[int, Mapping[int, float]] = field(default_factory=dict)

    @cached_property
    def rows(self) -> list[DataLine]:
        """The data lines, split at their commas."""
        return [
            DataLine(
                LineNumber(number, self.line.job),
                [f.strip() for f in text.split(",")],
                self.tangents.get(number, {}),
            )
            for number, text in self.lines
        ]

    @cached_property
    def identity(self) -> tuple[object, ...]:
        """What the block says, wherever it stands: a key for what is derived from it."""
        return self.name, tuple(self.parameters.items()), tuple(text for _, text in self.lines)

    def get(self, parameter: str, default: str = "") -> str:
        """A parameter's value, upper case, as ABAQUS compares names."""
        return self.parameters.get(parameter, default).upper()

    def need(self, parameter: str) -> str:
        """A parameter that must be present."""
        if not self.parameters.get(parameter):
            raise DeckError(self.line, f"*{self.name} needs {parameter}=")
        return self.get(parameter)

    def number(self, parameter: str) -> float | None:
        """A parameter as a number, None where it is not given."""
        text = self.get(parameter)
        try:
            return float(text) if text else None
        except ValueError:
            raise DeckError(self.line, f"{parameter}={text} is not a number") from None

    def only_row(self) -> DataLine:
        """The single data row of a keyword that has exactly one."""
        if len(self.rows) != 1:
            raise DeckError(self.line, f"*{self.name} takes one data line, got {len(self.rows)}")
        return self.rows[0]


def read_keywords(text: str, job: str = "") -> list[Keyword]:
    """Split a deck into keyword blocks.

    Raises DeckError where data stand before the first keyword.
    """
    keywords: list[Keyword] = []
    pending, pending_line = "", LineNumber(0, job)
    lines: list[tuple[int, str]] = []
    for count, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if line.startswith("**"):
            continue
        if pending:
            pending += line
        elif line.startswith("*"):
            pending, pending_line = line, LineNumber(count, job)
        elif not line:
            continue
        elif not keywords:
            raise DeckError(LineNumber(count, job), f"data '{line[:40]}' before the first keyword")
        else:
            lines.append((count, line))
            continue
        if pending.endswith(","):
            continue
        lines = []
        keywords.append(_keyword(pending, pending_line, lines))
        pending = ""
    if pending:
        raise DeckError(pending_line, f"'{pending}' ends in a comma but the deck ends there")
    return keywords


def _keyword(line: str, number: LineNumber, lines: list[tuple[int, str]]) -> Keyword:
    name, *rest = (part.strip() for part in line[1:].split(","))
    parameters = {}
    for part in rest:
        key, _, value = part.partition("=")
        key = " ".join(key.upper().split())
        if key in parameters:
            raise DeckError(number, f"{key} is given twice")
        parameters[key] = value.strip().strip('"')
    return Keyword(" ".join(name.upper().split()), number, parameters, lines)


def seed(keywords: list[Keyword], tangents: list[tuple[int, int, float]]) -> list[Keyword]:
    """Copies of the blocks in which the numbers at (line, field) carry a tangent.

    ``tangents``: (1-based line, 0-based field, d number / d variable).
    Raises DeckError when a place holds no data field.
    """
    by_line: dict[int, dict[int, float]] = {}
    for line, index, value in tangents:
        by_line.setdefault(line, {})[index] = value
    result = []
    for keyword in keywords:
        first = keyword.lines[0][0] if keyword.lines else 0
        last = keyword.lines[-1][0] if keyword.lines else -1
        inside = [line for line in by_line if first <= line <= last]
        texts = dict(keyword.lines) if inside else {}
        own = {line: by_line.pop(line) for line in inside if line in texts}
        copy = Keyword(keyword.name, keyword.line, keyword.parameters, keyword.lines, own)
        for line, fields in own.items():
            if max(fields) > texts[line].count(","):
                raise DeckError(
                    LineNumber(line, keyword.line.job),
                    "a sensitivity is asked for, but the line has no such field",
                )
        result.append(copy if own else keyword)
    if by_line:
        raise DeckError(min(by_line), "a sensitivity is asked for, but the line holds no data")
    return result
