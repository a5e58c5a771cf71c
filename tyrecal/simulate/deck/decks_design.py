"""The design of a case whose tyre is in decks in three dimensions: their texts as the user has
them, except marks, numbers, the pressure, and what the labels of modes need printed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from ...tyre.case import LoadedCase
from ...tyre.case.kinds.user_decks import DecksIn3D
from ...tyre.case.schema import SolverChoice
from ...tyre.own_deck.own_deck import UNIT_LENGTH, UNIT_MASS
from ...tyre.own_deck.own_decks import OwnDecks
from ...tyre.own_deck.text import OwnDeckError, Place, named
from ...tyre.resolve import resolved
from ...tyre.templates import TemplateFailed
from ...tyre.values import set_values
from .decks import Design, DesignEvaluator, header, refuse_outside, steps
from .tyre_design import TyreDesign

Added = dict[Place, list[str]]  # lines that are written before these places


class DecksDesign:
    """A case at values of its variables, or of any of its numbers (see `decks.Design`)."""

    section_nodes = 0
    nominal = None  # no solver of such decks can use a shape to start from
    is_nominal = False
    has_slopes = False

    def __init__(self, case: LoadedCase, values: Mapping[str, float] | None = None):
        """Raises ValueError for an unknown name, or a value that the case cannot have."""
        self.values: Mapping[str, float] = dict(values or {})
        self.case = resolved(set_values(case, self.values)).written  # its effects as numbers
        self.decks = self.case.kind.decks

    def at(self, values: Mapping[str, float]) -> DecksDesign:
        """The case with these values. Raises ValueError."""
        return DecksDesign(self.case, values)

    @property
    def header(self) -> str:
        """Comment lines that identify the tyre of the decks."""
        return header(self.case)

    @property
    def pressure_kPa(self) -> float:
        """Pressure of the case, which counts in place of the decks'."""
        return self.case.case.pressure_kPa

    @property
    def request(self) -> dict[str, Any]:
        """How the decks are run, and SI units per unit of their answer (time is in s); they request
        modes themselves: ``modes`` of them, or None where a range of frequencies decides. ``jobs``:
        pairs of a deck and the one that it continues, "": none; ``mass_sets``: all sets with a
        mass."""
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
        """Raises TemplateFailed: these decks have no neighbours, sensitivities are differences of
        frequencies."""
        raise TemplateFailed(f"{name}: decks in three dimensions have no exact sensitivities")

    def steps(self, name: str, value: float, step: float) -> list[float]:
        """Values of a number for differences."""
        return steps(self.case, name, value, step)

    def check(self, evaluator: DesignEvaluator) -> None:
        """Raises OwnDeckError if they ask for shapes that name no modes, DeckRefused if the solver
        cannot run them."""
        output_lines(self.decks, evaluator.solver.dialect)
        evaluator.refuse_lacking(self)

    def remarks(self, evaluator: DesignEvaluator) -> Iterator[str]:
        """The lines added for the solver, one sentence, in words. Raises as `check` does."""
        evaluator.refuse_lacking(self)
        yield added_words(self.decks, evaluator.solver.dialect)

    def explained(self, refusal: str) -> str:
        """The solver's own words."""
        return refusal

    @property
    def advice_on_buckling(self) -> str:
        """Nothing: these decks are not pressed."""
        return ""

    def texts(self, dialect: str, request: Mapping[str, Any]) -> dict[str, str]:
        """File name to text, without the header. Raises TemplateFailed."""
        if request["loads_N"]:
            raise TemplateFailed(
                "decks in three dimensions are not pressed on a road: put the road into the decks"
            )
        try:
            files = self.decks.filled(self.case.deck_numbers, 1e3 * self.pressure_kPa)
            added = output_lines(self.decks, dialect)
        except OwnDeckError as error:
            raise TemplateFailed(str(error)) from None
        for (file, line), more in sorted(added.items(), reverse=True):  # the last lines first
            lines = files[file].split("\n")
            files[file] = "\n".join([*lines[: line - 1], *more, *lines[line - 1 :]])
        for name, text in files.items():
            refuse_outside(name, text)
        return files


def design_of(case: LoadedCase, values: Mapping[str, float] | None = None) -> Design:
    """The design of a case, at values of its variables or other numbers. Raises ValueError."""
    is_in_3d = isinstance(case.kind, DecksIn3D)
    return DecksDesign(case, values) if is_in_3d else TyreDesign(case, values)


def output_lines(decks: OwnDecks, dialect: str) -> Added:
    """Lines that are added to the decks, so that the modes' shapes and the mass can be read; none
    in another dialect than abaqus and calculix.

    Raises OwnDeckError where the step of the modes asks for other shapes.
    """
    of_nodes, others = OUTPUT.get(dialect, (("U",), None))
    node_files = [block for block in decks.modes_step if block.name == "NODE FILE"]
    for block in node_files:
        fields = {named(field) for row in block.rows for field in row.fields}
        whole = set(block.parameters) <= {"NSET", "GLOBAL"} and block.get("GLOBAL") != "NO"
        if block.get("NSET") != decks.crown or not whole or not {*of_nodes} <= fields:
            raise block.refused(
                f"in the step of the modes only NSET={decks.crown} is requested, with"
                f" {' and '.join(of_nodes)} of all modes in global directions: shapes there name"
                " the modes"
            )
    if others is None:
        return {}
    shapes = [] if node_files else [f"*NODE FILE, NSET={decks.crown}", ", ".join(of_nodes)]
    added = others(decks)
    end = decks.modes_step[-1].place
    added[end] = shapes + added.get(end, [])
    return {place: lines for place, lines in added.items() if lines}


def added_words(decks: OwnDecks, dialect: str) -> str:
    """The added lines and their places, in words; "" where nothing is added. Raises
    OwnDeckError."""
    return "; ".join(
        f"{file}, line {line}: added before it, to label modes: {' / '.join(more)}"
        for (file, line), more in output_lines(decks, dialect).items()
    )


def _abaqus(decks: OwnDecks) -> Added:
    """Eigenvalues in addition to the shapes, and the file that holds them as text: once in an
    analysis, "and the format cannot be changed upon restart" (manual, *FILE FORMAT)."""
    blocks = [block for deck in decks.restarted for block in deck.blocks]  # of one analysis
    formats = [block for block in blocks if block.name == "FILE FORMAT"]
    if formats and "ASCII" not in formats[0].parameters:
        raise formats[0].refused("must have ASCII: shapes are read from the results file as text")
    first = next(block for block in blocks if block.name == "STEP").place
    has_modal_file = any(block.name == "MODAL FILE" for block in decks.modes_step)
    return {
        first: [] if formats else ["*FILE FORMAT, ASCII"],
        decks.modes_step[-1].place: [] if has_modal_file else ["*MODAL FILE"],
    }


def _calculix(decks: OwnDecks) -> Added:
    """The masses of all that has a section."""
    masses = ([f"*EL PRINT, ELSET={name}, TOTALS=ONLY", "EMAS"] for name in decks.solid_sets)
    return {decks.modes_step[-1].place: [line for each in masses for line in each]}


# by dialect: fields printed at the nodes of `OwnDecks.crown`, and a function of all other lines
OUTPUT: dict[str, tuple[tuple[str, ...], Callable[[OwnDecks], Added] | None]] = {
    "abaqus": (("U", "COORD"), _abaqus),
    "calculix": (("U",), _calculix),
}
