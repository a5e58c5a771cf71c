"""A case that was read and validated, with the section or the deck that it names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .kinds.kind import TyreKind
from .kinds.stations import Stations
from .parts import Setting, as_written
from .schema import Case

if TYPE_CHECKING:
    from ..section.section import Section


@dataclass(frozen=True)
class LoadedCase:
    """A valid case as typed data, with its section and its place."""

    case: Case
    path: Path  # of the case file
    # before its gauges, as its file, or an effect, gives it; None: its kind has none
    drawn: Section | None
    folder: Path  # to which the case's own paths are relative
    file_data: dict[str, Any]  # the file with the keys that its deck adds; never changed by values
    # values that the user gave for this run, by name or path; results list them
    overrides: Mapping[str, Setting] = field(default_factory=dict)
    as_read: LoadedCase | None = None  # the case before any number was set; None: this one
    kind: TyreKind = field(default_factory=Stations)  # how the case gives its tyre
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
        return self.kind.section(
            self.drawn,
            f"'{self.path}' has no section, which this command needs: its tyre is given by"
            " decks in three dimensions",
        )

    @property
    def deck_numbers(self) -> Mapping[str, float]:
        """Numbers of the deck, by mark or path; none where the case names none."""
        return self.kind.numbers(self.case)

    @property
    def files(self) -> list[Path]:
        """Files that the case names, except its templates."""
        named = [self.measured] if self.measured else []
        return [*named, *self.kind.files(self.case, self.folder)]

    @property
    def template_files(self) -> list[Path]:
        """The case's own templates, and all that they can include."""
        if not self.case.templates:
            return []
        paths = (self.folder / self.case.templates).rglob("*.j2")
        return sorted(path for path in paths if path.is_file())
