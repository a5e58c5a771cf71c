"""The questions that a tyre answers however its case gives it: `TyreKind`.

Every case has one (`LoadedCase.kind`). All rooms call its methods and need not know which kind it
is, so another way to give a tyre is one more class here. A question that a kind cannot answer
raises InputError in the user's words.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ....errors import InputError
from ...templates import TemplateNames
from ..mistakes import CaseData
from ..parts import DeckSource, SectionOrigin
from ..schema import Case

if TYPE_CHECKING:
    from ...own_deck.own_deck import OwnDeck, Units
    from ...own_deck.own_decks import OwnDecks
    from ...own_deck.solver_deck import SolverDeck
    from ...own_deck.text import Place
    from ...section.mesh import SectionMesh
    from ...section.section import Section
    from ..document import Document
    from ..mistakes import Mistake

Change = Callable[[Any, float], Any]  # LoadedCase and an effect's parameter to a LoadedCase


class TyreKind:
    """How a case gives its tyre. The answers here hold for kinds that give no others.

    ``effect`` is a `tyre.effects.Effect`, ``tyre`` a `tyre.resolve.Tyre`.
    """

    # capabilities that a solver must have for such a tyre
    needs: ClassVar[frozenset[str]] = frozenset({"own_deck"})
    # whether the parts that effects change are known by its lines and regions, without deck.parts
    names_its_parts: ClassVar[bool] = False
    units: Units = "m"  # of the texts that solvers get
    idle: Mapping[str, str] = {}  # numbers of a deck, by path, that a case may not set, and why

    @property
    def deck(self) -> OwnDeck:
        """The section deck. Raises InputError for a tyre without one."""
        raise InputError("the tyre is not given by a section deck")

    @property
    def decks(self) -> OwnDecks:
        """The decks in three dimensions. Raises InputError for a tyre without them."""
        raise InputError("the tyre is not given by decks in three dimensions")

    def source(self, case: Case) -> DeckSource:
        """The key ``deck`` of the case. Raises InputError if there is none."""
        if case.deck is None:
            raise InputError("the case names no deck")
        return case.deck

    def numbers(self, case: Case) -> Mapping[str, float]:
        """Numbers of its decks by mark or path."""
        return self.source(case).numbers

    def flat(self, case: Case) -> SolverDeck:
        """The section deck with the case's numbers and gauges. Raises InputError without one."""
        source = self.source(case)
        return self.deck.flat(source.numbers, source.thickened)

    def usual_lines(self, source: CaseData) -> dict[str, Any]:
        """Keys that a case may leave out, with values; ``source``: its key ``deck``."""
        return {}

    def read_section(self, document: Document, data: dict[str, Any], folder: Path) -> Any:
        """The `Section` as drawn; None without one, or if it is wrong, with mistakes added."""
        return None

    def folds(self, data: CaseData, section: Section) -> str | None:
        """Why the section cannot be meshed, None if it can; a deck has its own mesh."""
        return None

    def slips(self, data: CaseData) -> Iterable[Mistake]:
        """Unusual numbers of its deck's text, each at its line."""
        return ()

    def unusual(self, numbers: Mapping[str, float]) -> Mapping[str, str]:
        """Why numbers of its deck, by path, are unusual."""
        return {}

    def files(self, case: Case, folder: Path) -> list[Path]:
        """Files that hold the tyre; ``folder``: of the case."""
        raise NotImplementedError

    def content_sha256(self, section: Section | None) -> str:
        """Hash of the tyre without the numbers that a case gives; ``section``: as drawn."""
        raise NotImplementedError

    def require_section(self, refusal: str) -> None:
        """Raises InputError(refusal) for a tyre without a section."""

    def section(self, drawn: Section | None, refusal: str) -> Section:
        """The section as drawn. Raises InputError(refusal) for a tyre without one."""
        self.require_section(refusal)
        assert drawn is not None
        return drawn

    def require_rim(self) -> None:
        """Raises ValueError for a tyre that contains what holds its rim."""

    def check(self, tyre: Any) -> None:
        """Raises InputError for a resolved tyre that cannot have its numbers."""

    def check_with_solver(self, tyre: Any) -> None:
        """Raises InputError if the bundled solver refuses a resolved tyre's deck of the user."""

    def mesh(self, tyre: Any) -> SectionMesh:
        """The mesh of the section of a resolved tyre that has one."""
        raise NotImplementedError

    def place_of_line(self, tyre: Any, line: int) -> Place | None:
        """The user's line behind a line (from 0) of the flat deck; None if there is none."""
        return None

    def template_names(self, tyre: Any) -> TemplateNames:
        """Names for deck templates of a resolved tyre whose mesh is a text; {}: tyrecal writes the
        mesh."""
        return {}

    def own_texts(self, tyre: Any) -> dict[str, str]:
        """The user's decks of a resolved tyre: their texts by file, only numbers changed. {}:
        tyrecal writes the decks. Raises InputError for what they cannot express."""
        return {}

    def request(self) -> dict[str, Any]:
        """Requests to a solver that no deck holds."""
        return {}

    def section_origin(self, case: Case) -> SectionOrigin | None:
        """Origin of the section's data, exact in decks; None: the case does not state it."""
        return "exact"

    def change_of(self, effect: Any, case: Case) -> Change:
        """The effect's change of such a tyre. Raises ValueError if it has nothing to change."""
        raise NotImplementedError

    def check_effect(self, effect: Any, case: Any) -> None:
        """Raises ValueError if a `LoadedCase` of a deck cannot have the effect at half the upper
        end of its range, or half the lower one if that is 0."""
        effect.of(case)(case, effect.high / 2 or effect.low / 2)

    def shape_uncertainty(self, effect: Any) -> Change | None:
        """The change by the effect with its second, uncertain number one standard deviation off; a
        deck has none."""
        return None

    def parts(self, case: Case, section: Section) -> tuple[Case, Mapping[str, str]]:
        """A case in which each part of the section has its own material, and the parts' names by
        material."""
        raise NotImplementedError

    def moduli(self, case: Case, material: str) -> dict[str, int]:
        """Paths of a material's moduli: 1 where a number grows with the stiffness, -1 where it
        falls."""
        return {}

    def density(self, material: str) -> str:
        """Path of a material's density."""
        return f"material {material} / DENSITY / density"
