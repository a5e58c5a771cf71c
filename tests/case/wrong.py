"""Wrong cases made from a right one, and the words that their refusal must contain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

CASES = Path(__file__).parents[2] / "cases"
GOOD = (CASES / "p235_75r17.yaml").read_text()
TABLE = (CASES / "p235_75r17.csv").read_text()
CSV = "p235_75r17.csv"
STATIONS = "section.stations"


@dataclass(frozen=True)
class Bad:
    """``key`` and ``words`` that a mistake must have; ``write`` makes the case in a folder."""

    key: str
    words: str
    write: Callable[[Path], Path]


BAD: dict[str, Bad] = {}


def write(name: str, folder: Path) -> Path:
    """Put the wrong case ``name`` into ``folder``, its station table too; the path to give."""
    (folder / CSV).write_text(TABLE)
    return BAD[name].write(folder)


def content(name: str, key: str, words: str, text: str | bytes) -> None:
    """A case file of this text."""

    def put(folder: Path) -> Path:
        path = folder / "case.yaml"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    assert name not in BAD
    BAD[name] = Bad(key, words, put)


def edit(name: str, key: str, words: str, *edits: str) -> None:
    """Edits are pairs: text of the good case, text in its place (first occurrence)."""
    text = GOOD
    for old, new in zip(edits[::2], edits[1::2], strict=True):
        assert old in text, old
        text = text.replace(old, new, 1)
    content(name, key, words, text)


def table(name: str, words: str, table: str | bytes) -> None:
    """The good case with another station table."""

    def put(folder: Path) -> Path:
        (folder / CSV).write_bytes(table.encode() if isinstance(table, str) else table)
        path = folder / "case.yaml"
        path.write_text(GOOD)
        return path

    BAD[name] = Bad(STATIONS, words, put)


def made(name: str, key: str, words: str, put: Callable[[Path], Path]) -> None:
    """Whatever ``put`` leaves in a folder; it returns the path to give."""
    BAD[name] = Bad(key, words, put)


PRESSURE = "pressure_kPa: 240.0"
NAME = "stations: p235_75r17.csv"
