"""Text decks of one design, and the slopes of their numbers by its variables, whatever made it.

Each begins with a comment that says what it is of.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, Protocol

import numpy as np

from ...tyre.case import LoadedCase
from ...tyre.case.identity import tyre_sha256
from ...tyre.case.schema import SolverChoice
from ...tyre.effects import catalogue
from ...tyre.number_units import EFFECT_PATH, unit_of
from ...tyre.templates import TemplateFailed

MAX_NAME_LENGTH = 200  # of a case, as a line of a deck has at most 256 characters
FIRST = b"** Written by tyrecal: "
HEADER_LINES = 3  # comments at the start of a deck, of its version: no part of its meaning
UNITS_IN_WORDS = {"m": "SI units: m, kg, s, Pa", "mm": "units: mm, t, s, MPa"}
LEADS_OUTSIDE = re.compile(  # but for comments: an absolute path or one upwards, code of one's own
    r"^(?!\*\*).*=[ \t]*[\"']?(?:[/\\~@]|\.\.|[a-z]:[/\\]).*|^\*[ \t]*USER[ \t]*SUBROUTINE.*",
    re.MULTILINE | re.IGNORECASE,
)
# what distinguishes designs: header, pressure (kPa), and values by name
DesignKey = tuple[str, float, tuple[tuple[str, float], ...]]
DeckSlopes = dict[str, list[tuple[str, int, int, float]]]  # see `Decks.tangents`


class DesignEvaluator(Protocol):
    """An `Evaluator`, as a design needs it."""

    @property
    def solver(self) -> Any:
        """The adapter."""

    def refuse_lacking(self, design: Design) -> None:
        """Raises DeckRefused if the solver cannot express what the design has."""


class Design(Protocol):
    """A design to evaluate: a tyre with all its numbers, which can write itself as decks.

    `TyreDesign` is one, of a case; whatever has these is another.
    """

    values: Mapping[str, float]
    """Values of the design variables, and of other numbers that were set, by name or path."""

    @property
    def header(self) -> str:
        """The comment lines that each of its decks begins with."""

    @property
    def pressure_kPa(self) -> float:
        """The inflation pressure that its decks state."""

    @property
    def request(self) -> dict[str, Any]:
        """``highest_harmonic`` and ``modes_per_harmonic`` that it wants, and requests that decks
        cannot express."""

    @property
    def needs(self) -> dict[str, str]:
        """Capabilities that a solver must have for it, and a sentence's end of what it lacks."""

    @property
    def has_slopes(self) -> bool:
        """Whether a solver with gradients gives exact ones of it."""

    @property
    def solver(self) -> SolverChoice:
        """The solver that the case names, its options and time limit."""

    @property
    def nominal(self) -> Design | None:
        """The tyre before anything was set, whose inflated shape is a good start for all others;
        None where none is known."""

    @property
    def is_nominal(self) -> bool:
        """Whether this is `nominal`."""

    def at(self, values: Mapping[str, float]) -> Design:
        """The design with numbers set. Raises ValueError where it cannot have them."""

    def neighbour(self, name: str, side: int) -> tuple[Design, float]:
        """The design a small step to one side (1, -1) of a variable, and its value there."""

    def steps(self, name: str, value: float, step: float) -> list[float]:
        """Values of a number for differences, see `steps`."""

    @property
    def section_nodes(self) -> int:
        """Number of nodes of its section; 0: it has none."""

    def check(self, evaluator: DesignEvaluator) -> None:
        """Raises InputError if the solver of its case cannot run the decks of a user."""

    def remarks(self, evaluator: DesignEvaluator) -> Iterable[str]:
        """Sentences on its texts before the first run. Raises InputError as `check` does."""

    def explained(self, refusal: str) -> str:
        """A solver's refusal of its texts in words for who made it."""

    @property
    def advice_on_buckling(self) -> str:
        """A sentence that helps if the tyre finds no stable equilibrium; "": nothing is known."""

    def texts(self, dialect: str, request: Mapping[str, Any]) -> dict[str, str]:
        """File name to text, without the header. Raises TemplateFailed."""


@dataclass(frozen=True)
class PressedTyre:
    """A tyre on the road at q loads, at which another one's loads begin."""

    nodes: np.ndarray  # (n,) numbers
    displacement: np.ndarray  # (q, rings, n, 3) under the loads, m
    load_N: np.ndarray  # (q,)
    deflection_m: np.ndarray  # (q,)
    # by variable: its value, and the derivatives of displacement and deflection by it
    slopes: Mapping[str, tuple[float, np.ndarray, np.ndarray]] = field(default_factory=dict)

    def predicted(self, values: Mapping[str, float]) -> PressedTyre:
        """The tyre with other values of its variables, to first order in their logarithms."""
        displacement, deflection = self.displacement, self.deflection_m
        for name, (value, by_displacement, by_deflection) in self.slopes.items():
            ratio = values.get(name, value) / value if value else 1.0
            change = value * math.log(ratio) if ratio > 0 else 0.0
            displacement = displacement + change * by_displacement
            deflection = deflection + change * by_deflection
        return replace(self, displacement=displacement, deflection_m=deflection)


@dataclass(eq=False)
class Decks:
    """Texts of a design's decks, written on request: the input of a solver's adapter."""

    design: Design
    gradients: tuple[str, ...] = ()  # variables whose places in the deck are wanted
    modes_per_harmonic: int | None = None  # the design's, or a larger number for a second look
    loads_N: tuple[float, ...] = ()  # press the tyre on the road with these, and find no modes
    loaded_modes: int = 0  # how many to find on the road
    # (n, 4) node numbers and displacements, m, of a shape near the inflated one, for solvers that
    # can use it (``start``)
    start: np.ndarray | None = None
    pressed_start: PressedTyre | None = None  # a tyre on the road near this one
    response: Mapping[str, Any] | None = None  # responses that are wanted
    rim_stiffness: bool = False  # that of the rim is wanted at each load

    def __post_init__(self) -> None:
        self.request = {
            **self.design.request,
            "loads_N": self.loads_N,
            "loaded_modes": self.loaded_modes,
            **({"response": self.response} if self.response else {}),
            "rim_stiffness": self.rim_stiffness,
        }
        if self.modes_per_harmonic:
            self.request["modes_per_harmonic"] = self.modes_per_harmonic
        self._header = self.design.header  # of all its texts: slopes come of their data

    @property
    def values(self) -> Mapping[str, float]:
        """Values of the design's variables, by name."""
        return self.design.values

    @property
    def options(self) -> Mapping[str, Any]:
        """The solver's own, from the case."""
        return self.design.solver.options

    def texts(self, dialect: str) -> dict[str, str]:
        """File name to text, which begins with `header`. Raises TemplateFailed."""
        return self._texts(self.design, dialect)

    def _texts(self, design: Design, dialect: str) -> dict[str, str]:
        written = design.texts(dialect, self.request)
        return {file: self._header + text for file, text in written.items()}

    def tangents(self, dialect: str) -> DeckSlopes:
        """Per variable, rows [job, 1-based line, 0-based field, d number / d variable].

        From two decks written a little to either side of the variable, so it holds for any
        template; the derivative is exact where the deck's number is linear in the variable.
        Raises TemplateFailed where keywords come and go with the variable.
        """
        result: DeckSlopes = {}
        for name in self.gradients:
            above, below = self.design.neighbour(name, 1), self.design.neighbour(name, -1)
            texts = [self._texts(design, dialect) for design, _ in (above, below)]
            if self.values[name] == 0:  # an effect: its keywords may be there on one side only
                own = self.texts(dialect)
                if any(
                    t.keys() != own.keys() or _keywords(t[file]) != _keywords(own[file])
                    for t in texts
                    for file in own
                ):
                    raise TemplateFailed(
                        f"{name} is 0, where keywords of the deck change: it has no sensitivity"
                        " there, give it another value"
                    )
            result[name] = [
                (file.removesuffix(".inp"), *row)
                for file in texts[0]
                for row in _slopes(file, texts[0][file], texts[1][file], above[1] - below[1])
            ]
        return result


def _keywords(text: str) -> tuple[int, list[str]]:
    """The deck's number of lines, and its keyword lines."""
    return text.count("\n"), re.findall(r"^\*\w.*", text, re.MULTILINE)


def _slopes(file: str, above: str, below: str, width: float) -> list[tuple[int, int, float]]:
    """Fields that differ between two decks: (line, field, difference over ``width``).

    Comments and headings may differ as they like. Raises TemplateFailed.
    """
    if above == below:
        return []
    first, second = above.splitlines(), below.splitlines()
    if len(first) != len(second):
        raise TemplateFailed(f"{file}: its number of lines depends on a variable: no derivative")
    rows, keyword = [], ""  # that the line stands under, or is
    for line, (one, other) in enumerate(zip(first, second, strict=True), 1):
        if one.startswith("*") and not one.startswith("**"):
            keyword = one.split(",")[0].upper()
        if one == other or one.startswith("**") or keyword == "*HEADING":
            continue
        if keyword == "*DAMPING":  # no frequency depends on it
            continue
        try:
            if one.startswith("*"):
                raise ValueError("a keyword line")
            fields = zip(one.split(","), other.split(","), strict=True)
            rows += [
                (line, i, (float(a) - float(b)) / width)
                for i, (a, b) in enumerate(fields)
                if a != b
            ]
        except ValueError:
            raise TemplateFailed(
                f"{file}, line {line}: '{one.strip()}' changes with a variable, but not as numbers"
                " of a data line: it has no exact derivative"
            ) from None
    return rows


def steps(case: LoadedCase, name: str, value: float, step: float) -> list[float]:
    """Values of a number a ``step`` above and below ``value``, for differences of results.

    The step is a share of the value; of a linear variable or an effect, of its range; of an angle
    of 0, of 90 degrees. A value is left out if its sign differs, or if it lies beyond the bounds of
    a variable that is within them; the step is a third of their distance at most.
    """
    variable, width = case.case.variables.get(name), abs(value) or 1.0
    low, high = -inf, inf
    if variable:
        span = variable.upper - variable.lower
        width = width if variable.scale == "log" else span
        if variable.lower <= value <= variable.upper:
            low, high, width = variable.lower, variable.upper, min(width, span / (3 * step))
    elif name.startswith(EFFECT_PATH):
        effect = catalogue()[name.removeprefix(EFFECT_PATH)]
        width = effect.high - effect.low
    elif not value and unit_of(name) == "degrees":
        width = 90.0
    both = [value + side * step * width for side in (1, -1)]
    return [each for each in both if low <= each <= high and each * value >= 0]


def header(case: LoadedCase) -> str:
    """The comment that every deck of a tyre begins with: what it is of.

    Nothing in it differs between two studies of one case and mesh, nor between editions of the
    tool; what else asks the same shares the record too, whose keys are of decks `without_header`.
    """
    c = case.case
    units = UNITS_IN_WORDS[case.kind.units]
    return (
        f"{FIRST.decode()}{c.name[:MAX_NAME_LENGTH]}\n"
        f"** tyre_sha256 {tyre_sha256(case)}, mesh {c.mesh.level}\n"
        f"** {units}; angles in degrees, of rebar layers from the meridian\n"
    )


def refuse_outside(file: str, text: str) -> None:
    """Raises TemplateFailed where a deck of a user's own templates would have the solver read or
    write elsewhere than in its run folder, compile a program or load a library."""
    for match in LEADS_OUTSIDE.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        raise TemplateFailed(
            f"{file}, line {line}: '{match[0].strip():.60}' leads out of the run's folder"
        )


def without_header(text: bytes) -> bytes:
    """A file of a run, a deck without its name: the part that determines the solver's answer."""
    return text.split(b"\n", HEADER_LINES)[-1] if text.startswith(FIRST) else text
