"""A tyre by the user's decks in three dimensions: known as text only, without a section."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ....errors import InputError
from ...own_deck.own_deck import Units
from ...own_deck.own_decks import OwnDecks
from ..document import Document
from ..mistakes import CaseData, suggestion
from ..schema import Case
from .kind import Change
from .user_decks import UserDecks, lines_of_a_deck


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
