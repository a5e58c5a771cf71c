"""A deck's text as keyword blocks that remember their places, files that it includes among them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    texts: dict[str, str] = {}
    return list(_blocks(path.name, path.parent, (), [MAX_OWN_BYTES], texts)), texts


def _blocks(
    file: str, folder: Path, above: tuple[str, ...], left: list[int], texts: dict[str, str]
) -> Iterator[Block]:
    texts[file] = _text(folder / file, Place(file, 1), left)
    for block in _file_blocks(file, texts[file]):
        if block.name != "INCLUDE":
            yield block
            continue
        other = block.parameters.get("INPUT", "").strip().strip('"')
        if not other or set(block.parameters) != {"INPUT"} or block.rows:
            raise block.refused("takes INPUT=FILE and nothing else")
        path = Path(other)
        if path.is_absolute() or ".." in path.parts or "\\" in other:
            raise block.refused(f"INPUT={other} leads out of the deck's folder: copy it there")
        inside = (folder / path).resolve().is_relative_to(folder.resolve())
        if not inside or not (folder / path).is_file():
            raise block.refused(f"INPUT={other} is no file in the deck's folder")
        if other in (*above, file) or len(above) >= DEEPEST_INCLUDE:
            raise block.refused(f"INPUT={other} includes itself, or is too deep")
        yield from _blocks(other, folder, (*above, file), left, texts)


def _text(path: Path, place: Place, left: list[int]) -> str:
    with path.open("rb") as stream:
        content = stream.read(left[0] + 1)
    left[0] -= len(content)
    if left[0] < 0:
        raise OwnDeckError(place, f"decks of more than {MAX_OWN_BYTES / 1e6:g} MB are not read")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")  # of a heading's umlauts; keywords are plain letters


def _file_blocks(file: str, text: str) -> Iterator[Block]:
    """The blocks of one file."""
    block: tuple[str, Place, dict[str, str]] | None = None
    rows: list[Row] = []
    pending, start, keyword = "", Place(file, 0), False
    for count, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if line.startswith("**") or not line:
            continue
        if pending and not (not keyword and line.startswith("*")):
            line = pending + line
        else:
            if pending:  # a data line that ended in a comma, of which no more comes
                rows.append(_row(start, pending))
            start, keyword = Place(file, count), line.startswith("*")
        pending = ""
        data_of = block[0] if block and not keyword else ""
        if line.endswith(",") and (keyword or data_of in ("ELEMENT", "ELCOPY")):
            pending = line
            continue
        if not keyword:
            if block is None:
                raise OwnDeckError(start, f"data '{line[:40]}' before the first keyword")
            rows.append(_row(start, line))
            continue
        if block:
            yield Block(*block, tuple(rows))
        block, rows = _keyword(start, line), []
    if pending and keyword:
        raise OwnDeckError(start, f"'{pending[:60]}' ends in a comma, but the file ends there")
    if pending:
        rows.append(_row(start, pending))
    if block:
        yield Block(*block, tuple(rows))


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
