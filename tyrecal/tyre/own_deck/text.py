"""A deck's text as keyword blocks that remember their places, files that it includes among them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from ...errors import InputError

MAX_OWN_BYTES = 50_000_000  # of a deck and all that it includes
DEEPEST_INCLUDE = 5  # files that include others


class Place(NamedTuple):
    """A line (from 1) of a file, by its name relative to the deck's folder."""

    file: str
    line: int


class OwnDeckError(InputError):
    """A deck that is refused: the sentence begins with file, line and keyword."""

    def __init__(self, place: Place, message: str):
        super().__init__(f"{place.file}, line {place.line}: {message}")
        self.place, self.message = place, message

    def __reduce__(self) -> tuple[type[OwnDeckError], tuple[Place, str]]:
        """For another process."""
        return OwnDeckError, (self.place, self.message)


@dataclass(frozen=True, eq=False)
class Row:
    """A data line, those that continue it among it."""

    place: Place
    fields: tuple[str, ...]  # between the commas, without the blanks about them

    def text(self, index: int, default: str = "") -> str:
        """A field as it stands, ``default`` where it is missing or blank."""
        return (self.fields[index] if index < len(self.fields) else "") or default

    def name(self, index: int) -> str:
        """A field as the name of a set, surface or material."""
        return named(self.text(index))

    def number(self, index: int, default: float | None = None) -> float:
        """A field as a number."""
        text = self.text(index)
        if not text and default is not None:
            return default
        try:
            value = float(text.replace("D", "E").replace("d", "e"))
        except ValueError:
            what = f"'{text}' is not a number" if text else f"number {index + 1} is missing"
            raise OwnDeckError(self.place, what) from None
        if value - value != 0.0:
            raise OwnDeckError(self.place, f"'{text}' is not a finite number")
        return value

    def integer(self, index: int, default: int | None = None) -> int:
        """A field as a whole number."""
        text = self.text(index)
        if not text and default is not None:
            return default
        try:
            return int(text)
        except ValueError:
            what = f"'{text}' is no whole number" if text else f"number {index + 1} is missing"
            raise OwnDeckError(self.place, what) from None


@dataclass(frozen=True, eq=False)
class Block:
    """A keyword with its parameters and its data lines."""

    name: str
    place: Place
    parameters: dict[str, str]  # upper-case names
    rows: tuple[Row, ...]

    def get(self, parameter: str, default: str = "") -> str:
        """A parameter as a name, ``default`` where it is not given."""
        return named(self.parameters.get(parameter, default))

    def need(self, parameter: str) -> str:
        """A parameter that must be given."""
        value = self.get(parameter)
        if not value:
            raise self.refused(f"needs {parameter}=")
        return value

    def only_row(self) -> Row:
        """The data line of a keyword that takes one."""
        if len(self.rows) != 1:
            raise self.refused(f"takes one data line, it has {len(self.rows)}")
        return self.rows[0]

    def refused(self, message: str, row: Row | None = None) -> OwnDeckError:
        """What is wrong, at a data line or at the keyword."""
        return OwnDeckError(row.place if row else self.place, f"*{self.name}: {message}")


def named(text: str) -> str:
    """A name as ABAQUS compares them."""
    return " ".join(text.strip().strip('"').upper().split())


def read_blocks(path: Path) -> tuple[list[Block], dict[str, str]]:
    """The blocks of a deck, and the texts of its files by name. Raises OwnDeckError, OSError."""
    reader = _Reader(path.parent)
    reader.read(path.name, Place(path.name, 1))
    reader.close()
    return reader.blocks, reader.texts


class _Reader:
    """Of a deck and the files that it takes in: a file of data goes on where the line stands."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.left = MAX_OWN_BYTES
        self.blocks: list[Block] = []
        self.texts: dict[str, str] = {}
        self.opened: tuple[str, Place, dict[str, str]] | None = None  # the keyword, its place ...
        self.rows: list[Row] = []

    def close(self) -> None:
        """The keyword that is open has all its data."""
        if self.opened:
            self.blocks.append(Block(*self.opened, tuple(self.rows)))
        self.rows = []

    def read(
        self, file: str, asked: Place, above: tuple[str, ...] = (), data: bool = False
    ) -> None:
        """All lines of a file; ``data``: none of them a keyword."""
        self.texts[file] = text = self._text(file, asked)
        for start, line in _lines(file, text, lambda: self.opened[0] if self.opened else ""):
            if not line.startswith("*"):
                if self.opened is None:
                    raise OwnDeckError(start, f"data '{line[:40]}' before the first keyword")
                self.rows.append(_row(start, line))
                continue
            keyword = _keyword(start, line)
            if data:
                raise Block(*keyword, ()).refused("stands in a file of data lines")
            name, _, parameters = keyword
            if name != "INCLUDE":
                self.close()
                self.opened = name, start, {k: v for k, v in parameters.items() if k != "INPUT"}
            if name == "INCLUDE" or "INPUT" in parameters:
                other = self._other(Block(*keyword, ()), (*above, file))
                self.read(other, start, (*above, file), name != "INCLUDE")

    def _other(self, block: Block, above: tuple[str, ...]) -> str:
        """The name of the file that a keyword takes in."""
        other = block.parameters.get("INPUT", "").strip().strip('"')
        if not other or (block.name == "INCLUDE" and len(block.parameters) > 1):
            raise block.refused("takes INPUT=FILE and nothing else")
        path = Path(other)
        if path.is_absolute() or ".." in path.parts or "\\" in other:
            raise block.refused(f"INPUT={other} leads out of the deck's folder: copy it there")
        inside = (self.folder / path).resolve().is_relative_to(self.folder.resolve())
        if not inside or not (self.folder / path).is_file():
            raise block.refused(f"INPUT={other} is no file in the deck's folder")
        if other in above or len(above) > DEEPEST_INCLUDE:
            raise block.refused(f"INPUT={other} includes itself, or is too deep")
        return other

    def _text(self, file: str, place: Place) -> str:
        with (self.folder / file).open("rb") as stream:
            content = stream.read(self.left + 1)
        self.left -= len(content)
        if self.left < 0:
            raise OwnDeckError(place, f"decks of more than {MAX_OWN_BYTES / 1e6:g} MB are not read")
        try:
            return content.decode("utf-8-sig")
        except UnicodeDecodeError:
            return content.decode("latin-1")  # of a heading's umlauts; keywords are plain letters


def _lines(file: str, text: str, keyword: Callable[[], str]) -> Iterator[tuple[Place, str]]:
    """Keyword and data lines of a text with what continues them, and where they begin, without
    comments; ``keyword``: that whose data a line is."""
    pending, start = "", Place(file, 0)
    for count, raw in enumerate(text.split("\n"), start=1):
        line = raw.strip()
        if line.startswith("**") or not line:
            continue
        if pending and (pending.startswith("*") or not line.startswith("*")):
            line = pending + line
        else:
            if pending:  # a data line that ended in a comma, of which no more comes
                yield start, pending
            start = Place(file, count)
        pending = ""
        if line.endswith(",") and (line.startswith("*") or keyword() in ("ELEMENT", "ELCOPY")):
            pending = line
        else:
            yield start, line
    if pending.startswith("*"):
        raise OwnDeckError(start, f"'{pending[:60]}' ends in a comma, but the file ends there")
    if pending:
        yield start, pending


def _row(place: Place, line: str) -> Row:
    return Row(place, tuple(field.strip() for field in line.split(",")))


def _keyword(place: Place, line: str) -> tuple[str, Place, dict[str, str]]:
    name, *rest = (part.strip() for part in line[1:].split(","))
    parameters: dict[str, str] = {}
    for part in rest:
        key, _, value = part.partition("=")
        key = named(key)
        if key in parameters:
            raise OwnDeckError(place, f"*{named(name)}: {key} is given twice")
        if key:
            parameters[key] = value.strip()
    return named(name), place, parameters


def names_of(blocks: Sequence[Block]) -> list[str]:
    """The keywords of blocks, each once, in their order."""
    return list(dict.fromkeys(block.name for block in blocks))
