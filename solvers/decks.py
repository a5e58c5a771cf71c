"""Decks as the tool hands them to an adapter."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol


class WrittenDecks(Protocol):
    """Decks and requests of one run. ``options``: the solver's options from the case; ``request``:
    for a user's deck its units under ``own_deck``, for decks in three dimensions ``own_decks``."""

    options: Mapping[str, Any]
    request: Mapping[str, Any]

    def texts(self, dialect: str) -> dict[str, str]:
        """File name to text."""


def save_texts(texts: Mapping[str, str], folder: Path) -> list[Path]:
    """Write decks into a run folder. Raises OSError."""
    paths = [folder / name for name in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="")
    return paths
