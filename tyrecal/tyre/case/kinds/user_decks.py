"""Tyres in decks of the user: their files, and the lines that their cases may leave out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..mistakes import CaseData
from ..schema import Case
from .kind import TyreKind

if TYPE_CHECKING:
    from ...own_deck.own_deck import OwnDeck
    from ...own_deck.own_decks import OwnDecks
    from ...section.section import Section
    from ..document import Document

# by default: the bundled solver computes section decks, ABAQUS those in three dimensions
TIME_LIMITS_S = {"bundled": 300.0, "abaqus": 3600.0}


@dataclass(frozen=True)
class UserDecks(TyreKind):
    """A tyre in files of the user, as they are before the case sets their numbers."""

    own: OwnDeck | OwnDecks

    @property
    def known_numbers(self) -> Mapping[str, float]:
        """Plain numbers that a case may set, by path."""
        raise NotImplementedError

    def check_case(self, document: Document, numbers: Mapping[str, float]) -> None:
        """Record what is wrong with the case's key ``deck`` and these numbers of the deck, or raise
        OwnDeckError for what is wrong with the deck."""
        raise NotImplementedError

    def files(self, case: Case, folder: Path) -> list[Path]:
        """The decks and all that they include."""
        return [self.own.path.parent / name for name in self.own.texts]

    def content_sha256(self, section: Section | None) -> str:
        """Hash of the decks without their plain numbers."""
        return self.own.sha256


def lines_of_a_deck(
    source: CaseData,
    pressure_kPa: float | None = 200.0,
    reference: tuple[float, float] = (0.0, 0.0),
    static_moduli: str = "",
    name: str = "",
    solver: str = "bundled",
) -> dict[str, Any]:
    """Keys that a case with a key ``deck`` may leave out, with values; None, "": not this key.
    reference: r, z of the rim's node, m.

    The defaults are for a deck that is wrong: they only keep its case from being blamed for it.
    """
    return {
        "name": name or Path(str(source.get("file"))).stem,
        "size": "not given",
        **({} if pressure_kPa is None else {"pressure_kPa": pressure_kPa}),
        "deck": {"units": source.get("units")},
        "rim": {"reference_point_m": dict(zip("rz", reference, strict=True))},
        "analysis": {"static_moduli": static_moduli} if static_moduli else {},
        "solver": {"name": solver, "time_limit_s": TIME_LIMITS_S[solver]},
    }
