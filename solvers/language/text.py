"""A deck's text as keyword blocks that remember their places, included files among them.

Everything that reads a deck reads it here: user decks, the bundled solver, the checks for ABAQUS
and CalculiX. Keywords, parameters and their words come out as the manual spells them in full.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple, Self, TypeVar

from ..errors import Refused
from .element_types import NODES_AND_SECTION
from .spelling import full_keyword, full_parameters, named

Number = TypeVar("Number", int, float)
MAX_DECK_BYTES = 100_000_000  # of a deck and all that it includes
MAX_KEYWORDS = 20_000  # of a deck and all that it includes; tyres have hundreds
MAX_LABEL = 999_999_999  # number of a node or element, by the manual
MAX_CHARACTERS = 4096  # with those that continue it; ABAQUS reads 256 of each
DEEPEST_INCLUDE = 5  # files that include others
COMPLEX_STEP = 1e-30  # so small that its square vanishes against every real part


class Place(NamedTuple):
    """A line (from 1) of a file; a subclass chooses the error that a mistake there raises."""

    file: str
    line: int

    def error(self, message: str) -> Exception:
        """The error to raise for what stands here."""
        return DeckError(self, message)

    def __str__(self) -> str:
        return f"{self.file}, line {self.line}" if self.line else self.file


class DeckError(Refused):
    """A deck that cannot be honoured, or is none; the sentence begins with file and line. The line
    of ``place`` is 0 where no single line is to blame."""

    def __init__(self, place: Place, message: str):
        super().__init__(f"{place}: {message}")
        self.place, self.message = place, message


WHOLE_DECK = Place("deck", 0)


def _plain(text: str) -> str:
    """The text of a number. Raises ValueError for digits that Python reads and ABAQUS does not."""
    if "_" in text or not text.isascii():
        raise ValueError
    return text


def number_from(text: str) -> float:
    """The number that a field states, its exponent with E or D. Raises ValueError."""
    return float(_plain(text).upper().replace("D", "E"))


def is_label(text: str) -> bool:
    """Whether a field is the number of a node or element, not the name of a set."""
    return text.isascii() and text.isdigit()


@dataclass(frozen=True, eq=False)
class Row:
    """A data line, including the lines that continue it."""

    place: Place
    line: str
    tangents: Mapping[int, float] | None = None  # by field: d number / d variable of a slope

    @cached_property
    def fields(self) -> tuple[str, ...]:
        """The text between the commas, without the blanks around it."""
        return tuple(text.strip() for text in self.line.split(","))

    def text(self, index: int, default: str = "") -> str:
        """A field as it is written, ``default`` if it is missing or blank."""
        return (self.fields[index] if index < len(self.fields) else "") or default

    def name(self, index: int) -> str:
        """A field as the name of a set, surface or material."""
        return named(self.text(index))

    def number(self, index: int, default: float | None = None) -> float:
        """A field as a finite number."""
        value = self._parsed(index, default, number_from, "is not a number")
        if value - value != 0.0:
            raise self.place.error(f"'{self.text(index)}' is not a finite number")
        return value

    def _parsed(
        self, index: int, default: Number | None, parse: Callable[[str], Number], words: str
    ) -> Number:
        text = self.text(index)
        if not text and default is not None:
            return default
        try:
            return parse(text)
        except ValueError:
            what = f"'{text[:40]}' {words}" if text else f"number {index + 1} is missing"
            raise self.place.error(what) from None

    def value(self, index: int, default: float | None = None) -> complex | float:
        """A field as a number; its imaginary part is the tangent times COMPLEX_STEP."""
        number = self.number(index, default)
        if self.tangents and index in self.tangents:
            return complex(number, COMPLEX_STEP * self.tangents[index])
        return number

    def integer(self, index: int, default: int | None = None) -> int:
        """A field as a whole number."""
        return self._parsed(index, default, lambda text: int(_plain(text)), "is no whole number")


@dataclass(frozen=True, eq=False)
class Block:
    """A keyword with its parameters and its data lines."""

    name: str
    place: Place
    parameters: Mapping[str, str]  # upper-case names
    rows: Sequence[Row] = field(default=())

    @cached_property
    def identity(self) -> tuple[object, ...]:
        """Content of the block without its place: a key for what is derived from it."""
        return self.name, tuple(self.parameters.items()), tuple(row.line for row in self.rows)

    @cached_property
    def is_seeded(self) -> bool:
        """Whether a number of a data line carries a tangent."""
        return any(row.tangents for row in self.rows)

    def get(self, parameter: str, default: str = "") -> str:
        """A parameter as a name, ``default`` if it is not given."""
        return named(self.parameters.get(parameter, default))

    def need(self, parameter: str) -> str:
        """A parameter that must be given."""
        value = self.get(parameter)
        if not value:
            raise self.refused(f"needs {parameter}=")
        return value

    def number(self, parameter: str) -> float | None:
        """A parameter as a number, None if it is not given."""
        text = self.parameters.get(parameter, "")
        return Row(self.place, text).number(0) if text else None

    def integer(self, parameter: str, default: str = "") -> int:
        """A parameter as a whole number."""
        text = self.parameters.get(parameter, default)
        return Row(self.place, text or self.need(parameter)).integer(0)

    def only_row(self) -> Row:
        """The data line of a keyword that takes one."""
        if len(self.rows) != 1:
            raise self.refused(f"takes one data line, it has {len(self.rows)}")
        return self.rows[0]

    def refused(self, message: str, row: Row | None = None) -> Exception:
        """The error for a mistake in a data line, or in the keyword."""
        return (row.place if row else self.place).error(f"*{self.name}: {message}")


@dataclass
class Reader:
    """Reads a deck in ``folder`` and the files that it includes, whose places are of ``kind``."""

    folder: Path | None  # None: nothing is included
    kind: type[Place] = Place
    most_bytes: int = MAX_DECK_BYTES
    blocks: list[Block] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)  # by file
    _rows: list[Row] = field(default_factory=list)  # of the last block

    def read(self, file: str) -> Self:
        """Read a file of the folder. Raises OSError and the error of the places."""
        self._read(file, self.kind(file, 1), (), False)
        return self

    def read_text(self, file: str, text: str) -> Self:
        """Read a text whose lines count as those of ``file``."""
        self._lines(file, text, (), False)
        return self

    def _read(self, file: str, place: Place, above: tuple[str, ...], only_data: bool) -> None:
        self.texts[file] = text = self._text(file, place)
        self._lines(file, text, above, only_data)

    def _lines(self, file: str, text: str, above: tuple[str, ...], only_data: bool) -> None:
        for start, line in self._logical_lines(file, text):
            if not line.startswith("*"):
                if not self.blocks:
                    raise start.error(f"data '{line[:40]}' before the first keyword")
                self._rows.append(Row(start, line))
                continue
            if len(self.blocks) == MAX_KEYWORDS:
                raise start.error(f"decks of more than {MAX_KEYWORDS} keywords are not read")
            block = self._keyword(start, line)
            if only_data:
                raise block.refused("is in a file of data lines")
            if block.name != "INCLUDE":
                self._rows = []
                kept = {k: v for k, v in block.parameters.items() if k != "INPUT"}
                self.blocks.append(Block(block.name, start, kept, self._rows))
            if block.name == "INCLUDE" or "INPUT" in block.parameters:
                other = self._included(block, (*above, file))
                self._read(other, start, (*above, file), block.name != "INCLUDE")

    def _logical_lines(self, file: str, text: str) -> Iterator[tuple[Place, str]]:
        """Lines without comments, each with the lines that continue it, and where they begin."""
        pending, start = "", self.kind(file, 0)
        for count, raw in enumerate(text.split("\n"), start=1):
            line = raw.strip()
            if line.startswith("**") or not line:
                continue
            if pending and (pending.startswith("*") or not line.startswith("*")):
                line = pending + line
            else:
                if pending:
                    yield start, pending
                start = self.kind(file, count)
            if len(line) > MAX_CHARACTERS:
                raise start.error(f"more than {MAX_CHARACTERS} characters in a line are not read")
            pending = ""
            if line.endswith(",") and (line.startswith("*") or self._is_short_element(line)):
                pending = line
            else:
                yield start, line
        if pending.startswith("*"):
            raise start.error(f"'{pending[:60]}' ends in a comma, but the file ends there")
        if pending:
            yield start, pending

    def _is_short_element(self, line: str) -> bool:
        """Whether an element's data line ends before its last node; a comma at its end does not
        count."""
        if not self.blocks or self.blocks[-1].name != "ELEMENT":
            return False
        nodes, _ = NODES_AND_SECTION.get(self.blocks[-1].get("TYPE"), (0, ""))
        return not nodes or line.count(",") <= nodes

    def _keyword(self, place: Place, line: str) -> Block:
        name, *parts = line[1:].split(",")
        try:
            name = full_keyword(name)
            pairs = [part.partition("=") for part in parts if part.strip()]
            given = [(key, value.strip() if equals else "") for key, equals, value in pairs]
            parameters: dict[str, str] = {}
            for key, value in full_parameters(name, given):
                if key in parameters:
                    raise place.error(f"*{name}: {key} is given twice")
                parameters[key] = value
        except ValueError as error:
            raise place.error(f"*{named(name)}: {error}") from None
        return Block(name, place, parameters)

    def _included(self, block: Block, above: tuple[str, ...]) -> str:
        """The name of the file that a keyword includes."""
        other = block.parameters.get("INPUT", "").strip().strip('"')
        if not other or (block.name == "INCLUDE" and len(block.parameters) > 1):
            raise block.refused("takes INPUT=FILE and nothing else")
        path = Path(other)
        if self.folder is None:
            raise block.refused("is not honoured: no file is included here")
        if path.is_absolute() or ".." in path.parts or "\\" in other:
            raise block.refused(f"INPUT={other} leads out of the deck's folder: copy it there")
        inside = (self.folder / path).resolve().is_relative_to(self.folder.resolve())
        if not inside or not (self.folder / path).is_file():
            raise block.refused(f"INPUT={other} is no file in the deck's folder")
        if other in above or len(above) > DEEPEST_INCLUDE:
            raise block.refused(f"INPUT={other} includes itself, or is too deep")
        return other

    def _text(self, file: str, place: Place) -> str:
        left = self.most_bytes - sum(len(text) for text in self.texts.values())
        with ((self.folder or Path()) / file).open("rb") as stream:
            content = stream.read(left + 1)
        if len(content) > left:
            raise place.error(f"decks of more than {self.most_bytes / 1e6:g} MB are not read")
        try:
            return content.decode("utf-8-sig")
        except UnicodeDecodeError:
            return content.decode("latin-1")  # headings have umlauts; keywords are plain letters


def read_keywords(text: str, job: str = "") -> list[Block]:
    """The keyword blocks of a job's deck that includes nothing. Raises DeckError."""
    return Reader(None).read_text(f"{job}.inp" if job else WHOLE_DECK.file, text).blocks


def read_deck(path: Path) -> str:
    """The text of a deck, or of a file next to it. Raises DeckError if it is no file, or too
    large; OSError."""
    if path.exists() and not path.is_file():
        raise DeckError(WHOLE_DECK, f"{path.name} is not a regular file")
    text = Reader(path.parent)._text(path.name, Place(path.name, 0))
    return text.replace("\r\n", "\n").replace("\r", "\n")


def seed(blocks: Sequence[Block], tangents: Sequence[tuple[int, int, float]]) -> list[Block]:
    """Copies of the blocks in which the numbers at (line, field) carry a tangent.

    tangents: (1-based line, 0-based field, d number / d variable).
    Raises DeckError if a place holds no data field.
    """
    by_line: dict[int, dict[int, float]] = {}
    for line, index, value in tangents:
        by_line.setdefault(line, {})[index] = value
    result = []
    for block in blocks:
        if by_line.keys() & {row.place.line for row in block.rows}:
            rows = [replace(row, tangents=by_line.pop(row.place.line, None)) for row in block.rows]
            for row in rows:
                if row.tangents and max(row.tangents) >= len(row.fields):
                    words = "a sensitivity is requested, but the line has no such field"
                    raise DeckError(row.place, words)
            block = replace(block, rows=rows)
        result.append(block)
    if by_line:
        words = "a sensitivity is requested, but the line holds no data"
        raise DeckError(Place(WHOLE_DECK.file, min(by_line)), words)
    return result


def names_of(blocks: Sequence[Block]) -> list[str]:
    """The keywords of blocks, each once, in their order."""
    return list(dict.fromkeys(block.name for block in blocks))
