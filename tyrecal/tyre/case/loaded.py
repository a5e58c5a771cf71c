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
    """A valid case as typed data, with its section and its place."""

    case: Case
    path: Path  # of the case file
    section: Section
    folder: Path  # to which the case's own paths are relative
    file_data: dict[str, Any]  # as the file has it, whatever is set later
    # set by the user since, by name or path, for results to say
    overrides: Mapping[str, float] = field(default_factory=dict)
    as_read: LoadedCase | None = None  # before any number was set; None: none was
