"""A user's deck as its own text: unchanged but for marks, and numbers that are set by a path."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from .numbers import with_marks_filled, with_number
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
        own[row.place.line - 1] = with_number(own[row.place.line - 1], row, j, value)
    known = {name: numbers[name] for name in deck.marks if name in numbers}
    return {file: with_marks_filled("\n".join(own), known) for file, own in lines.items()}
