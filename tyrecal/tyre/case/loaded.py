"""A case that was read and judged, with the section that it names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .schema import Case

if TYPE_CHECKING:
    from ..own_deck.own_deck import OwnDeck
    from ..section.section import Section


@dataclass(frozen=True)
class LoadedCase:
    """A valid case as typed data, with its section and its place."""

    case: Case
    path: Path  # of the case file
    section: Section
    folder: Path  # to which the case's own paths are relative
    file_data: dict[str, Any]  # as the file has it, whatever is set later
    # set by the user since, by name or path, for results to say
    overrides: Mapping[str, float] = field(default_factory=dict)
    as_read: LoadedCase | None = None  # before any number was set; None: none was
    deck: OwnDeck | None = None  # that the section is of, where the case names one

    @property
    def deck_numbers(self) -> Mapping[str, float]:
        """Of the deck, by mark or path; none where the case names none."""
        return self.case.deck.numbers if self.case.deck else {}

    @property
    def files(self) -> list[Path]:
        """That the section stands in."""
        if self.deck:
            return [self.deck.path.parent / name for name in self.deck.texts]
        return [self.folder / self.case.section.file]
