"""A tyre by the user's ABAQUS deck of its section."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from math import isclose
from pathlib import Path
from typing import Any

from ....errors import InputError
from ...own_deck.numbers import moduli
from ...own_deck.own_deck import UNIT_LENGTH, UNIT_MASS, OwnDeck
from ...own_deck.own_text import own_texts
from ...own_deck.section_mesh import OwnDeckMesh, section, section_mesh
from ...own_deck.solver_deck import SolverDeck
from ...own_deck.solver_mesh import REFERENCE_NODE
from ...own_deck.text import OwnDeckError, Place
from ...section.section import Section
from ...templates import TemplateNames
from ...usual_deck import deck_slips, unusual_numbers
from ..document import Document
from ..mistakes import CaseData, Mistake
from ..schema import Case
from .kind import Change
from .user_decks import UserDecks, lines_of_a_deck


@dataclass(frozen=True)
class SectionDeck(UserDecks):
    """Section, materials and inflation are those of one deck."""

    own: OwnDeck

    @property
    def deck(self) -> OwnDeck:
        """The deck."""
        return self.own

    @property
    def idle(self) -> Mapping[str, str]:  # type: ignore[override]
        """Parameters that set only the pressure, or nothing, and why they are not to be set."""
        return self.own.idle

    @property
    def known_numbers(self) -> Mapping[str, float]:
        """Plain numbers that change the section."""
        return self.own.section_numbers

    def check_case(self, document: Document, numbers: Mapping[str, float]) -> None:
        """Raises OwnDeckError for a deck that is no section with these numbers."""
        self.own.flat(numbers)

    def usual_lines(self, source: CaseData) -> dict[str, Any]:
        """Pressure, reference node and moduli of the deck."""
        flat = self.own.flat(source["numbers"])
        reference = flat.mesh.reference
        return lines_of_a_deck(source, flat.pressure_Pa / 1e3, reference, flat.static_moduli)

    def read_section(self, document: Document, data: dict[str, Any], folder: Path) -> Section:
        """The half of positive z of the deck's surfaces."""
        return section(self.own.flat(data["deck"]["numbers"]))

    def slips(self, data: CaseData) -> Iterator[Mistake]:
        """Radius and numbers of the deck that are unusual, each at its line."""
        return deck_slips(self.own, data["deck"]["numbers"])

    def unusual(self, numbers: Mapping[str, float]) -> Mapping[str, str]:
        """Why numbers are unusual, given all others of the deck."""
        return dict(unusual_numbers(self.own, numbers))

    def check(self, tyre: Any) -> None:
        """Raises OwnDeckError for numbers with which the deck is no section."""
        tyre.flat.text  # noqa: B018  building it checks the numbers

    def check_with_solver(self, tyre: Any) -> None:
        """Raises OwnDeckError if the bundled solver refuses something."""
        trial(tyre.flat)

    def mesh(self, tyre: Any) -> OwnDeckMesh:
        """The deck's own mesh."""
        return _mesh(tyre.flat)

    def place_of_line(self, tyre: Any, line: int) -> Place | None:
        """The line of the deck that a line, from 0, of the flat deck comes from; None: of none."""
        return _origin(tyre.flat, line)

    def template_names(self, tyre: Any) -> TemplateNames:
        """All text of the deck stands in the place of the mesh."""
        flat, point = tyre.flat, tyre.case.rim.reference_point_m
        return {
            "mesh": {
                "reference_node": REFERENCE_NODE,
                "reference_r": point.r,
                "reference_z": point.z,
                "radius": max(r for r, _ in flat.mesh.nodes.values()),
            },
            "mesh_block": flat.text,
            "sets": flat.set_names,
            "solids": [],
            "layers": [],
            "materials": [],
            "hourglass": None,
        }

    def own_texts(self, tyre: Any) -> dict[str, str]:
        """The deck and what it includes. Raises OwnDeckError for gauges and moduli that are not the
        deck's."""
        flat, c = tyre.flat, tyre.case
        why = {  # reason of a refusal, and whether it applies
            "deck.gauges must be 1, because the deck has its own nodes": self.source(c).thickened,
            "analysis.static_moduli must be those of its *STATIC": (
                (c.analysis.static_moduli == "long_term") != flat.long_term
            ),
        }
        for reason in (words for words, holds in why.items() if holds):
            raise flat.blocks.inflation[0].refused(reason)
        pressure = pressure_in_deck(tyre)
        rows = [(row, i) for _, row, i in flat.model.pressure if row.number(i) != pressure]
        return own_texts(self.own, self.numbers(c), [(row, i, pressure) for row, i in rows])

    def request(self) -> dict[str, Any]:
        """Units of the deck, m and kg."""
        units = self.own.units
        return {"own_deck": {"length_m": UNIT_LENGTH[units], "mass_kg": UNIT_MASS[units]}}

    def change_of(self, effect: Any, case: Case) -> Change:
        """The effect's change of numbers and named parts. Raises InputError without one."""
        if effect.add_to_deck is None:
            raise InputError("changes lines or regions of a section or a law, not a deck's numbers")
        if effect.part and not self.source(case).sets(effect.part):
            part = effect.part
            raise InputError(f"needs the sets of {part}: name them in deck.parts.{part}")
        change: Change = effect.add_to_deck
        return change

    def parts(self, case: Case, section: Section) -> tuple[Case, Mapping[str, str]]:
        """Compounds and cords with plain numbers, not marks, by their names in the deck."""
        flat, numbers = self.flat(case), self.numbers(case)
        names = dict.fromkeys((*flat.materials, *(ply.material for ply in flat.plies)))
        able = [m for m in names if self.moduli(case, m) and self.density(m) in numbers]
        return case, dict(zip(able, able, strict=True))

    def moduli(self, case: Case, material: str) -> dict[str, int]:
        """Paths of the moduli that are plain numbers: 1 where a number grows with the stiffness, -1
        where it falls (D1)."""
        return moduli(self.numbers(case), material)


def pressure_in_deck(tyre: Any) -> float:
    """The pressure of a resolved tyre in its deck's unit, mass / (length s^2); the deck's own
    number if it is that."""
    _, row, i = tyre.flat.model.pressure[0]  # data line, and place of the pressure in it
    units = tyre.written.kind.deck.units
    pressure = 1e3 * tyre.case.pressure_kPa * UNIT_LENGTH[units] / UNIT_MASS[units]
    own = float(row.number(i))
    return own if isclose(own, pressure, rel_tol=1e-12) else pressure


def trial(flat: SolverDeck) -> float:
    """The mass, kg, of the tyre that the bundled solver makes of a flat deck.

    Raises OwnDeckError where it refuses something.
    """
    bundled = import_module("tyrecal_solvers.bundled.adapter")
    outcome = bundled.examine(flat.text, flat.long_term)
    if isinstance(outcome, float):
        return outcome
    line, words = outcome  # of the flat deck, from 1
    raise OwnDeckError(_origin(flat, line - 1) or flat.lines[0][1], words)


def _origin(flat: SolverDeck, line: int) -> Place | None:
    return flat.lines[line][1] if 0 <= line < len(flat.lines) else None


@lru_cache(maxsize=8)
def _mesh(flat: SolverDeck) -> OwnDeckMesh:
    return section_mesh(flat)
