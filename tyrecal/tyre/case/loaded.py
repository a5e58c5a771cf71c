"""A case that was read and validated, with the section or the deck that it names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import InputError
from .parts import Setting, as_written
from .schema import Case

if TYPE_CHECKING:
    from ..own_deck.own_deck import OwnDeck
    from ..own_deck.own_decks import OwnDecks
    from ..section.section import Section


@dataclass(frozen=True)
class LoadedCase:
    """A valid case as typed data, with its section and its place."""

    case: Case
    path: Path  # of the case file
    drawn: Section | None  # as drawn, without effects; None: the tyre is in decks in 3-D
    folder: Path  # to which the case's own paths are relative
    file_data: dict[str, Any]  # the file with the keys that its deck adds; never changed by values
    # values that the user gave for this run, by name or path; results list them
    overrides: Mapping[str, Setting] = field(default_factory=dict)
    as_read: LoadedCase | None = None  # the case before any number was set; None: this one
    deck: OwnDeck | None = None  # the user's axisymmetric deck that the section comes from, if any
    decks: OwnDecks | None = None  # the user's decks in 3-D, in place of a section
    measured: Path | None = None  # the file with its targets, if the case names one
    assumed: Mapping[str, Any] = field(default_factory=dict)  # keys that its deck adds to the file

    def __repr__(self) -> str:
        case = self.case
        given = (f", {name}={as_written(value)}" for name, value in self.overrides.items())
        words = f"{case.name}, {case.pressure_kPa:g} kPa, mesh {case.mesh.level}{''.join(given)}"
        return f"LoadedCase({str(self.path)!r}: {words})"

    @property
    def section(self) -> Section:
        """The section. Raises InputError where there is none."""
        if self.drawn is None:
            raise InputError(
                f"'{self.path}' has no section, which this command needs: its tyre is given by"
                " decks in three dimensions"
            )
        return self.drawn

    @property
    def deck_numbers(self) -> Mapping[str, float]:
        """Numbers of the deck, by mark or path; none where the case names none."""
        return self.case.deck.numbers if self.case.deck else {}

    @property
    def files(self) -> list[Path]:
        """Files that the case names, except its templates."""
        named = [self.measured] if self.measured else []
        if own := self.deck or self.decks:
            return [*named, *(own.path.parent / name for name in own.texts)]
        return [*named, self.folder / self.case.section.file]

    @property
    def template_files(self) -> list[Path]:
        """The case's own templates, and all that they can include."""
        if not self.case.templates:
            return []
        paths = (self.folder / self.case.templates).rglob("*.j2")
        return sorted(path for path in paths if path.is_file())
