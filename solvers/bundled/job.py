"""Runs a pair of decks: the section job (inflation) and the revolve job (modes) on top of it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from . import grammar, sensitivity
from .band import Numbering
from .eigen import NotConverged
from .harmonics import HarmonicModes, Unstable, Vibration
from .inflation import InflationFailed, equilibrium
from .keywords import DeckError, Keyword, Row, read_keywords, seed
from .mechanics import Load, mass
from .model import Model, build
from .results import StepResult, write

Array = np.ndarray
Failures = (InflationFailed, Unstable, NotConverged)
MOST_HARMONICS = 60


class TimedOut(ArithmeticError):
    """The time limit passed."""


@dataclass
class Request:
    """What the deck cannot say, from the file JOB.request.json beside it.

    harmonics: n to solve (None: as many as *FREQUENCY's number of modes takes);
    modes_per_harmonic; sensitivities: variable to [job, line, field, d number / d variable] rows.
    """

    harmonics: list[int] | None = None
    modes_per_harmonic: int = 2
    sensitivities: dict[str, list[tuple[str, int, int, float]]] = field(default_factory=dict)


def run(folder: Path, job: str, oldjob: str | None, time_limit: float = float("inf")) -> None:
    """Run ``job`` (on top of ``oldjob``) in ``folder``; write JOB.json and JOB.npz there.

    Raises DeckError; InflationFailed, Unstable, NotConverged, TimedOut; OSError.
    """
    deadline = time.monotonic() + time_limit
    with _threads().limit(limits=1, user_api="blas"):
        texts = {name: (folder / f"{name}.inp").read_text() for name in (job, oldjob) if name}
        request = read_request(folder / f"{job}.request.json")
        analysis = Analysis(texts, job, oldjob, request, deadline)
        write(folder / job, analysis.model, analysis.run())


@cache
def _threads() -> ThreadpoolController:
    """One BLAS thread: the matrices are small, and the bytes do not depend on the machine."""
    return ThreadpoolController()


def read_request(path: Path) -> Request:
    """The side file, or the plain request where there is none. Raises DeckError."""
    if not path.exists():
        return Request()
    try:
        return Request(**json.loads(path.read_text()))
    except (ValueError, TypeError) as error:
        raise DeckError(0, f"{path.name} is not a request: {error}") from None


class _Deck:
    """Both jobs' keyword blocks, plain or carrying the tangent of one variable."""

    def __init__(self, texts: dict[str, str], job: str, oldjob: str | None):
        self._order = [oldjob, job] if oldjob else [job]
        self._keywords = {name: read_keywords(texts[name], name) for name in self._order}

    def split(self, tangents: list) -> tuple[list[Keyword], list[Keyword], list[list[Keyword]]]:
        """Section model, revolve model and all steps in order."""
        section: list[Keyword] = []
        revolve: list[Keyword] = []
        steps: list[list[Keyword]] = []
        for place, name in enumerate(self._order):
            own = [(line, index, value) for job, line, index, value in tangents if job == name]
            keywords = self._keywords[name]
            model, own_steps = grammar.check(seed(keywords, own) if own else keywords, place > 0)
            (revolve if place else section).extend(model)
            steps += own_steps
        return section, revolve, steps


class Analysis:
    """Static and frequency steps of a deck, carried out one after the other."""

    def __init__(
        self,
        texts: dict[str, str],
        job: str,
        oldjob: str | None,
        request: Request,
        deadline: float = float("inf"),
    ):
        self.deck = _Deck(texts, job, oldjob)
        self.job, self.revolved, self.request = job, oldjob is not None, request
        self.deadline = deadline
        self.section, self.revolve, self.steps = self.deck.split([])
        self._check_transfer()
        self._models: dict[tuple[float | None, bool], Model] = {}
        self.model = self._model(None, True)
        self.U = np.zeros((len(self.model.mesh.X), 3))
        self.factorisations = 0
        self._numberings: dict[bytes, Numbering] = self.model.mesh.numberings

    def run(self) -> list[StepResult]:
        """Results of every frequency step (of the last static step where there is none)."""
        results = []
        state = _Conditions()
        for place, step in enumerate(self.steps):
            procedure = _procedure(step)
            state.update(step)
            if procedure.name == "STATIC":
                state.long_term = "LONG TERM" in procedure.parameters
                self._static(state)
            else:
                results.append(self._frequency(place, procedure, state))
        if not results:
            results.append(
                StepResult(
                    len(self.steps),
                    self._pressure(state),
                    self._mass(),
                    [],
                    {},
                    self.U,
                    self.factorisations,
                )
            )
        return results

    def _check_transfer(self) -> None:
        if not self.revolved:
            return
        names = [k.name for k in self.revolve]
        for needed in ("SYMMETRIC MODEL GENERATION", "SYMMETRIC RESULTS TRANSFER"):
            if needed not in names:
                raise DeckError(1, f"{self.job}.inp runs on another job but has no *{needed}")
        for k in self.revolve:
            if k.name == "SYMMETRIC RESULTS TRANSFER":
                increments = _increments(self.section_steps()[0])
                if int(k.need("STEP")) != 1 or int(k.need("INC")) > increments:
                    raise DeckError(
                        k.line, f"the first job has one step of {increments} increments"
                    )
            if (
                k.name == "SYMMETRIC MODEL GENERATION"
                and k.rows
                and (np.real(k.rows[-1].number(0)) != 360.0)
            ):
                raise DeckError(k.line, "the tyre is revolved by 360 degrees, in one segment")

    def section_steps(self) -> list[list[Keyword]]:
        """Steps of the section job."""
        return self.steps[:1]

    def _model(self, dynamic_Hz: float | None, long_term: bool) -> Model:
        key = dynamic_Hz, long_term
        if key not in self._models:
            self._models[key] = build(self.section, dynamic_Hz, long_term)
        return self._models[key]

    def _static(self, state: _Conditions) -> None:
        self._check_time()
        model = self._model(None, state.long_term)
        numbering = self._numbering(state)
        found = equilibrium(model, numbering, self._loads(model, state), self.U, self._check_time)
        self.U = found.U
        self.factorisations += found.factorisations

    def _frequency(self, place: int, procedure: Keyword, state: _Conditions) -> StepResult:
        dynamic = procedure.get("PROPERTY EVALUATION")
        dynamic_Hz = float(dynamic) if dynamic else None
        row = procedure.rows[0] if procedure.rows else Row(procedure.line, [])
        wanted = row.integer(0) if row.text(0) else None
        highest = np.real(row.number(2, np.inf)) if row.text(2) else np.inf
        shift = float(np.real(row.number(3, 0.0))) * (2 * np.pi) ** 2
        model = self._model(dynamic_Hz, state.long_term)
        loads, numbering = self._loads(model, state), self._numbering(state)
        vibration = Vibration(model, self.U, loads, numbering, shift)
        static_factor = vibration.factor(0)
        modes = self._harmonics(vibration, static_factor, wanted)
        modes = [_below(m, highest) for m in modes]
        rates: dict[str, list[Array]] = {}
        strains: sensitivity.Strains = {}
        for variable, tangents in self.request.sensitivities.items():
            if dynamic_Hz is not None or shift:  # then K(0) of the vibration is not Newton's
                plain = Vibration(self._model(None, state.long_term), self.U, loads, numbering, 0.0)
                static_factor = plain.factor(0)
            rates[variable] = self._rates(
                tangents, place, dynamic_Hz, static_factor, modes, strains
            )
        return StepResult(
            place + 1,
            self._pressure(state),
            self._mass(),
            modes,
            rates,
            self.U,
            self.factorisations,
        )

    def _harmonics(
        self, vibration: Vibration, static_factor: Any, wanted: int | None
    ) -> list[HarmonicModes]:
        request = self.request
        if request.harmonics is not None or not self.revolved:
            modes = []
            for n in request.harmonics if request.harmonics is not None else [0]:
                self._check_time()
                factor = static_factor if n == 0 else None
                modes.append(vibration.modes(n, request.modes_per_harmonic, factor))
            return modes
        if wanted is None:
            raise DeckError(0, f"*FREQUENCY of {self.job}.inp does not say how many modes")
        return lowest_of_all(vibration, wanted, self._check_time)

    def _rates(
        self,
        tangents: list[tuple[str, int, int, float]],
        place: int,
        dynamic_Hz: float | None,
        factor: Any,
        modes: list[HarmonicModes],
        strains: sensitivity.Strains,
    ) -> list[Array]:
        """d lambda / d variable per harmonic, with the deck's numbers carrying its tangent."""
        section, _, steps = self.deck.split([tuple(t) for t in tangents])
        state = _Conditions()
        for step in steps[: place + 1]:
            state.update(step)
            procedure = _procedure(step)
            if procedure.name == "STATIC":
                state.long_term = "LONG TERM" in procedure.parameters
        numbering = self._numbering(state)
        static = build(section, None, state.long_term)
        V = sensitivity.state_rate(static, self.U, self._loads(static, state), numbering, factor)
        moving = static if dynamic_Hz is None else build(section, dynamic_Hz, state.long_term)
        n = np.concatenate([np.full(len(m.eigenvalues), m.n) for m in modes])
        shapes = np.concatenate([m.shapes for m in modes])
        values = np.concatenate([m.eigenvalues for m in modes])
        rates = sensitivity.eigenvalue_rates(
            moving, self.U, V, self._loads(moving, state), n, shapes, values, strains
        )
        return np.split(rates, np.cumsum([len(m.eigenvalues) for m in modes])[:-1])

    def _loads(self, model: Model, state: _Conditions) -> list[Load]:
        loads = []
        for surface, (line, value) in state.pressures.items():
            if surface not in model.mesh.faces:
                raise DeckError(line, f"surface {surface} is not defined")
            loads.append(Load(model.mesh.faces[surface], value))
        return loads

    def _pressure(self, state: _Conditions) -> float:
        values = [float(np.real(value)) for _, value in state.pressures.values()]
        return max(values, default=0.0)

    def _mass(self) -> float:
        return float(2 * np.pi * mass(self.model).sum().real)

    def _numbering(self, state: _Conditions) -> Numbering:
        mesh = self.model.mesh
        free = np.ones((len(mesh.X), 3), bool)
        touched = np.zeros(len(mesh.X), bool)
        for block in mesh.blocks.values():
            touched[block.connectivity] = True
        free[~touched] = False
        for reference, tied in mesh.reference_nodes.items():
            if not any(
                row.text(0) == str(reference)
                and int(row.text(1)) <= 1
                and int(row.text(2) or row.text(1)) >= 6
                for row in state.held
            ):
                raise DeckError(
                    state.line,
                    f"the rim's reference node {reference} must be held in"
                    " 1, 6: a wheel free to move is not honoured",
                )
            free[[mesh.index[i] for i in tied]] = False
        for row in state.held:
            self._hold(row, free)
        key = free.tobytes()
        if key not in self._numberings:
            groups = [b.connectivity for b in mesh.blocks.values()]
            groups += [c.lines.connectivity for c in self.model.cords]
            self._numberings[key] = Numbering(groups, free)
        return self._numberings[key]

    def _hold(self, row: Row, free: Array) -> None:
        mesh = self.model.mesh
        name = row.text(0).upper()
        if name.isdigit() and int(name) in mesh.reference_nodes:
            return
        nodes = mesh.node_sets.get(name) or ([int(name)] if name.isdigit() else None)
        if nodes is None or any(n not in mesh.index for n in nodes):
            raise DeckError(row.line, f"node or node set {name} is not defined")
        first = row.integer(1)
        last = row.integer(2) if row.text(2) else first
        if row.text(3) and row.number(3) != 0.0:
            raise DeckError(row.line, "only zero displacements are honoured")
        components = {1: 0, 2: 2, 5: 1} if not self.revolved else {2: 2}
        if self.revolved and first == 1 and last >= 3:
            components = {1: 0, 2: 1, 3: 2}
        chosen = [components[d] for d in range(first, last + 1) if d in components]
        if not chosen:
            raise DeckError(
                row.line, f"degrees of freedom {first} to {last} of a set cannot be held here"
            )
        for component in chosen:
            free[[mesh.index[n] for n in nodes], component] = False

    def _check_time(self) -> None:
        if time.monotonic() > self.deadline:
            raise TimedOut("the time limit passed")


class _Conditions:
    """Loads and boundary conditions, which carry on from step to step."""

    def __init__(self) -> None:
        self.pressures: dict[str, tuple[int, complex | float]] = {}
        self.held: list[Row] = []
        self.long_term = False
        self.line = 0

    def update(self, step: list[Keyword]) -> None:
        """Take over the conditions of a step. Raises DeckError."""
        self.line = step[0].line
        for k in step:
            if k.name == "BOUNDARY":
                self.held += k.rows
            elif k.name == "DSLOAD":
                for row in k.rows:
                    if row.text(1).upper() != "P":
                        raise DeckError(
                            row.line, f"load type {row.text(1)} is not honoured, only P"
                        )
                    self.pressures[row.text(0).upper()] = row.line, row.number(2)


def _procedure(step: list[Keyword]) -> Keyword:
    found = [k for k in step if k.name in ("STATIC", "FREQUENCY")]
    if len(found) != 1:
        raise DeckError(step[0].line, "a step needs one *STATIC or *FREQUENCY")
    if found[0].name == "STATIC" and step[0].get("NLGEOM", "NO") not in ("YES", ""):
        raise DeckError(step[0].line, "a *STATIC step needs NLGEOM=YES")
    if found[0].name == "STATIC" and "NLGEOM" not in step[0].parameters:
        raise DeckError(step[0].line, "a *STATIC step needs NLGEOM=YES")
    return found[0]


def _increments(step: list[Keyword]) -> int:
    procedure = _procedure(step)
    if "DIRECT" not in procedure.parameters:
        raise DeckError(procedure.line, "the increments must be fixed (DIRECT) for a transfer")
    row = procedure.only_row()
    return int(np.ceil(np.real(row.number(1) / row.number(0)) - 1e-9))


def _below(modes: HarmonicModes, highest_Hz: float) -> HarmonicModes:
    keep = modes.eigenvalues <= (2 * np.pi * highest_Hz) ** 2
    return (
        modes if keep.all() else HarmonicModes(modes.n, modes.eigenvalues[keep], modes.shapes[keep])
    )


def lowest_of_all(
    vibration: Vibration, wanted: int, check: Callable[[], None]
) -> list[HarmonicModes]:
    """The ``wanted`` lowest modes over all harmonics, doublets counted twice.

    Harmonics are added until one starts above the highest mode kept.
    """
    found: list[HarmonicModes] = []
    for n in range(MOST_HARMONICS):
        check()
        each, count = 2, wanted
        while True:
            each = min(2 * each, count)
            modes = vibration.modes(n, each)
            limit = _limit([*found, modes], wanted)
            if modes.eigenvalues[-1] > limit or each >= count:
                break
        found.append(modes)
        if n >= 2 and modes.eigenvalues[0] > limit:
            break
    limit = _limit(found, wanted)
    return [_below(m, np.sqrt(limit) / (2 * np.pi) * (1 + 1e-12)) for m in found]


def _limit(found: list[HarmonicModes], wanted: int) -> float:
    values = np.sort(np.concatenate([np.repeat(m.eigenvalues, 2 if m.n else 1) for m in found]))
    return float(values[wanted - 1]) if len(values) >= wanted else float("inf")
