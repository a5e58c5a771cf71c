"""Decks as the tool hands them to an adapter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol


class WrittenDecks(Protocol):
    """Decks and requests of one run. ``options``: the solver's options from the case; ``request``:
    for a user's deck its units under ``own_deck``, for decks in three dimensions ``own_decks``."""

    options: Mapping[str, Any]
    request: Mapping[str, Any]

    def texts(self, dialect: str) -> dict[str, str]:
        """File name to text."""
