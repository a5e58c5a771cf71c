"""A user's deck as its own text: unchanged but for marks, and numbers that are set by a path."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from .numbers import assigned, with_marks_filled, written, written_as
from .own_deck import OwnDeck
from .text import Row

Setting = tuple[Row, int, float]  # a number of a field of a data line


def own_texts(
    deck: OwnDeck, numbers: Mapping[str, float], pressures: Iterable[Setting] = ()
) -> dict[str, str]:
    """Text by file name, that it includes too, relative to its folder. pressures: in the deck's own
    unit, in place of its own."""
    places = [
        (deck.blocks[k].rows[i], j, numbers[path])
        for path, (k, i, j) in deck.places.items()
        if path in numbers and numbers[path] != deck.numbers[path]
    ]
    lines = {file: text.split("\n") for file, text in deck.texts.items()}
    for row, j, value in (*places, *pressures):
        own = lines[row.place.file]
        own[row.place.line - 1] = _with(own[row.place.line - 1], row, j, value)
    known = {name: numbers[name] for name in deck.marks if name in numbers}
    return {file: with_marks_filled("\n".join(own), known) for file, own in lines.items()}


def _with(line: str, row: Row, index: int, value: float) -> str:
    """A data line with a number at a field, or NAME = value, the rest as it stands."""
    if index < 0:
        name, _, rest = line.partition("=")
        before = assigned(row)[1]
        return f"{name}={rest.replace(before, written_as(value, before), 1)}"
    fields = line.split(",")
    fields[index] = re.sub(r"\S.*\S|\S", written(value), fields[index], count=1)
    return ",".join(fields)
