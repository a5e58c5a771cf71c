"""Tyres in decks of the user: their files, and the lines that their cases may leave out;
and those in three dimensions, which are known as text only, without a section."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ....errors import InputError
from ...own_deck.own_deck import Units
from ...own_deck.own_decks import OwnDecks
from ..document import Document
from ..mistakes import CaseData, suggestion
from ..schema import Case
from .kind import Change, TyreKind

if TYPE_CHECKING:
    from ...own_deck.own_deck import OwnDeck
    from ...section.section import Section

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


@dataclass(frozen=True)
class DecksIn3D(UserDecks):
    """All is in decks that a solver runs one after the other."""

    own: OwnDecks

    @property
    def decks(self) -> OwnDecks:
        """The decks."""
        return self.own

    @property
    def units(self) -> Units:  # type: ignore[override]
        """Units of the decks, which a solver gets as they are."""
        return self.own.units

    @property
    def known_numbers(self) -> Mapping[str, float]:
        """Plain numbers by path."""
        return self.own.numbers

    def check_case(self, document: Document, numbers: Mapping[str, float]) -> None:
        """Record a crown that is no node set. Raises OwnDeckError for decks that cannot be run."""
        # in an assembly the crown is INSTANCE.SET
        if self.own.crown.rpartition(".")[2] not in self.own.node_sets:
            hint = suggestion(self.own.crown, self.own.node_sets)
            document.add(("deck", "crown"), f"is no node set of the decks{hint}")
        else:
            self.own.check(numbers)

    def usual_lines(self, source: CaseData) -> dict[str, Any]:
        """Keys that the case may leave out, with values; no pressure where a mark stands for it.
        The decks contain how the rim is held, and what is computed."""
        pressure_kPa = self.own.pressure_Pa / 1e3 if self.own.pressures else None
        return lines_of_a_deck(source, pressure_kPa, name=self.own.path.stem, solver="abaqus")

    def own_texts(self, tyre: Any) -> dict[str, str]:
        """Texts of the decks and of what they include. `filled` gets the pressure in Pa and writes
        it in the decks' units."""
        return self.own.filled(self.numbers(tyre.case), 1e3 * tyre.case.pressure_kPa)

    def require_section(self, refusal: str) -> None:
        """Raises InputError(refusal)."""
        raise InputError(refusal)

    def require_rim(self) -> None:
        """Raises InputError."""
        raise InputError("must be absent: the decks state how the rim is held")

    def change_of(self, effect: Any, case: Case) -> Change:
        """Raises InputError."""
        raise InputError("changes a section, and the tyre is given by decks in three dimensions")
