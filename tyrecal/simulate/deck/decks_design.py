"""The design of a case whose tyre stands in decks in three dimensions: their texts as the user has
them, but for marks, numbers, the pressure, and what the labels of modes need printed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ...tyre.case import LoadedCase
from ...tyre.case.schema import SolverChoice
from ...tyre.own_deck.own_deck import UNIT_LENGTH, UNIT_MASS
from ...tyre.own_deck.own_decks import OwnDecks
from ...tyre.own_deck.text import OwnDeckError, named
from ...tyre.resolve import resolved
from ...tyre.templates import TemplateFailed
from ...tyre.values import set_values
from .decks import Design, header, refuse_outside
from .tyre_design import TyreDesign


class DecksDesign:
    """A case at values of its variables, or of any of its numbers (see `decks.Design`)."""

    nominal = None  # no solver of such decks can use a shape to start from
    is_nominal = False
    has_slopes = False

    def __init__(self, case: LoadedCase, values: Mapping[str, float] | None = None):
        """Raises ValueError for an unknown name, or a value that the case cannot have."""
        self.values: Mapping[str, float] = dict(values or {})
        self.case = resolved(set_values(case, self.values)).written
        assert self.case.decks
        self.decks: OwnDecks = self.case.decks

    def at(self, values: Mapping[str, float]) -> DecksDesign:
        """The case with these values. Raises ValueError."""
        return DecksDesign(self.case, values)

    @property
    def header(self) -> str:
        """What the decks are of."""
        return header(self.case)

    @property
    def pressure_kPa(self) -> float:
        """That of the case, which counts in place of the decks'."""
        return self.case.case.pressure_kPa

    @property
    def request(self) -> dict[str, Any]:
        """How the decks are run, and what their answer is in; they ask for modes themselves."""
        units = self.decks.units
        return {
            "modes_per_harmonic": self.case.case.analysis.modes_per_harmonic,
            "own_decks": {
                "jobs": self.decks.jobs,
                "modes": self.decks.modes,
                "pressure_Pa": 1e3 * self.pressure_kPa,
                "length_m": UNIT_LENGTH[units],
                "mass_kg": UNIT_MASS[units],
                "mass_sets": self.decks.solid_sets,
            },
        }

    @property
    def needs(self) -> dict[str, str]:
        """A solver that reads them."""
        words = "decks in three dimensions; 'tyrecal solvers' shows which one can (own_decks)"
        return {"own_decks": words}

    @property
    def solver(self) -> SolverChoice:
        """The case's."""
        return self.case.case.solver

    def neighbour(self, name: str, side: int) -> tuple[Design, float]:
        """None: a fit takes differences of frequencies."""
        raise TemplateFailed(f"{name}: decks in three dimensions have no exact slopes")

    def explained(self, refusal: str) -> str:
        """The solver's own words."""
        return refusal

    def texts(self, dialect: str, request: Mapping[str, Any]) -> dict[str, str]:
        """File name to text, without the header. Raises TemplateFailed."""
        if request["loads_N"]:
            raise TemplateFailed(
                "decks in three dimensions are not pressed on a road: they say all"
            )
        try:
            files = self.decks.filled(self.case.deck_numbers, 1e3 * self.pressure_kPa)
            added = output_lines(self.decks, dialect)
        except OwnDeckError as error:
            raise TemplateFailed(str(error)) from None
        file, line = self.decks.modes_step[-1].place
        lines = files[file].splitlines(keepends=True)
        files[file] = "".join(
            [*lines[: line - 1], *(f"{each}\n" for each in added), *lines[line - 1 :]]
        )
        for name, text in files.items():
            refuse_outside(name, text)
        return files


def design_of(case: LoadedCase, values: Mapping[str, float] | None = None) -> Design:
    """The design of a case, at values of its variables or other numbers. Raises ValueError."""
    return DecksDesign(case, values) if case.decks else TyreDesign(case, values)


def output_lines(decks: OwnDecks, dialect: str) -> list[str]:
    """What the step of the modes must ask for besides, so that its modes can be labelled.

    Raises OwnDeckError where it asks for shapes of other nodes.
    """
    asked = [block for block in decks.modes_step if block.name == "NODE FILE"]
    for block in asked:
        if block.get("NSET") != decks.crown or "U" not in map(
            named, (field for row in block.rows for field in row.fields)
        ):
            raise block.refused(
                f"in the step of the modes only NSET={decks.crown} is asked for, with U: shapes"
                " there name the modes"
            )
    return OUTPUT[dialect](decks, bool(asked)) if dialect in OUTPUT else []


def added_words(decks: OwnDecks, dialect: str) -> str:
    """What is added, and where, in words; "" where nothing is. Raises OwnDeckError."""
    added, (file, line) = output_lines(decks, dialect), decks.modes_step[-1].place
    return f"{file}, line {line}: added before it, to label modes: {' / '.join(added)}" * bool(
        added
    )


def _abaqus(decks: OwnDecks, asked: bool) -> list[str]:
    """Shapes and places as text in the results file, and eigenvalues with them."""
    ascii_file = any(
        block.name == "FILE FORMAT" and "ASCII" in block.parameters for block in decks.blocks
    )
    modal = any(block.name == "MODAL FILE" for block in decks.modes_step)
    return [
        *([] if ascii_file else ["*FILE FORMAT, ASCII"]),
        *([] if asked else [f"*NODE FILE, NSET={decks.crown}", "U, COORD"]),
        *([] if modal else ["*MODAL FILE"]),
    ]


def _calculix(decks: OwnDecks, asked: bool) -> list[str]:
    """Shapes, and the masses of all that has a section."""
    masses = ([f"*EL PRINT, ELSET={name}, TOTALS=ONLY", "EMAS"] for name in decks.solid_sets)
    shapes = [] if asked else [f"*NODE FILE, NSET={decks.crown}", "U"]
    return [*shapes, *(line for each in masses for line in each)]


OUTPUT: dict[str, Callable[[OwnDecks, bool], list[str]]] = {
    "abaqus": _abaqus,
    "calculix": _calculix,
}
