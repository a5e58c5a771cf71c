"""A case that was read and judged, with the section that it names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .schema import Case

if TYPE_CHECKING:
    from ..section.section import Section


@dataclass(frozen=True)
class LoadedCase:
    """A valid case: typed (``case``), as plain data (``raw``), with its section and its place.

    path: the case file; folder: where it lies, to which its own paths are relative;
    file_pressure_kPa: the pressure in the file, whatever is set later; overrides: what the user
    has set since, by name or path, for results to say.
    """

    case: Case
    path: Path
    section: Section
    folder: Path
    raw: dict[str, Any]
    file_pressure_kPa: float | None = None
    overrides: Mapping[str, float] = field(default_factory=dict)
