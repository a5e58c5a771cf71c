"""Number of modes and pressure of a modes deck, read from the deck itself, because a user's own
template may change them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..language.text import WHOLE_DECK, DeckError, read_keywords


@dataclass(frozen=True)
class AskedModes:
    """modes: how many, None where a frequency range decides; pressure: the largest, in its unit."""

    modes: int | None
    pressure: float


def read_question(path: Path) -> AskedModes:
    """The question of a deck. Raises DeckError."""
    modes, pressure = None, 0.0
    procedures = 0
    for k in read_keywords(path.read_text(encoding="utf-8"), path.stem):
        if k.name == "FREQUENCY":
            procedures += 1
            row = k.only_row()
            modes = row.integer(0) if not (row.text(1) or row.text(2)) else None
        elif k.name == "DSLOAD":
            pressure = max(row.number(2) for row in k.rows)
    if procedures != 1:
        raise DeckError(WHOLE_DECK, f"{path.name} needs one *FREQUENCY step, it has {procedures}")
    return AskedModes(modes, pressure)
