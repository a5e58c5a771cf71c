"""Runs a pair of decks: the section job (inflation) and the revolve job (modes) on top of it."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from . import grammar, press_job, sensitivity
from .air import Air, read_air
from .attached import read_attached
from .band import Cholesky, Numbering
from .border import Bordered
from .coupled import attached_modes
from .eigen import NotConverged
from .harmonics import Change, HarmonicModes, HasModes, Unstable, Vibration, lowest_of_all
from .inflation import InflationFailed, equilibrium
from .keywords import DeckError, Keyword, Row, read_keywords
from .mechanics import Load, mass
from .model import Model, build
from .pressing import NotPressed
from .results import StepResult, write
from .rotation import waves
from .section import Solids
from .sector import Sector, sector_modes
from .spectrum import NotSelfConsistent, SelfConsistent
from .steps import Deck, Step, Tangent
from .supports import numbering
from .wheel import Wheel, read_wheel

Array = np.ndarray
Failures = (InflationFailed, Unstable, NotConverged, NotSelfConsistent, NotPressed)


class TimedOut(ArithmeticError):
    """The time limit passed."""


@dataclass
class Request:
    """What the deck cannot say, from the file JOB.request.json beside it.

    harmonics: n to solve (None: as many as *FREQUENCY's number of modes takes);
    modes_per_harmonic; sensitivities: variable to [job, line, field, d number / d variable] rows;
    own_frequency: rubber with a table of moduli over frequency has, in each mode, that of the
    mode's own frequency, not of PROPERTY EVALUATION; cavity: {"material", "surfaces"} of the gas
    inside the closed surfaces; sector: {"job", "width_deg"} of a sector about Theta = 0 in which
    the tyre is that of another section job, of the same mesh.
    """

    harmonics: list[int] | None = None
    modes_per_harmonic: int = 2
    sensitivities: dict[str, list[Tangent]] = field(default_factory=dict)
    own_frequency: bool = False
    cavity: dict[str, Any] | None = None
    sector: dict[str, Any] | None = None


def run(folder: Path, job: str, oldjob: str | None, time_limit: float = float("inf")) -> None:
    """Run ``job`` (on top of ``oldjob``) in ``folder``; write JOB.json and JOB.npz there.

    Raises DeckError; InflationFailed, Unstable, NotConverged, TimedOut; OSError.
    """
    deadline = time.monotonic() + time_limit
    with _threads().limit(limits=1, user_api="blas"):
        texts = {name: (folder / f"{name}.inp").read_text() for name in (job, oldjob) if name}
        request = read_request(folder / f"{job}.request.json")
        sector = read_sector(folder, request.sector) if request.sector else []
        analysis = Analysis(Deck(texts, job, oldjob), request, deadline, sector)
        if analysis.road is not None:
            press_job.write(folder / job, analysis.model, analysis.press())
        else:
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


def read_sector(folder: Path, sector: dict[str, Any]) -> list[Keyword]:
    """The model blocks of the sector's section job. Raises DeckError, OSError."""
    job = sector["job"]
    text = (folder / f"{job}.inp").read_text()
    return grammar.check(read_keywords(text, job), False)[0]


class Analysis:
    """The steps of a deck, carried out one after the other from the state at rest."""

    def __init__(
        self,
        deck: Deck,
        request: Request,
        deadline: float = float("inf"),
        sector: Sequence[Keyword] = (),
    ):
        self.sector = list(sector)
        self.deck, self.request, self.deadline = deck, request, deadline
        self.section, self.steps = deck.read([])
        self.road = press_job.read_road(deck.revolve)
        self._models: dict[tuple[float | None, bool, bool], Model] = {}
        self.model = self._model(None, True)
        self.U = np.zeros((len(self.model.mesh.X), 3))
        self.mass_kg = float(2 * np.pi * mass(self.model).sum().real)
        self.mass_kg += read_attached(deck.revolve, self.model.mesh).total_kg
        self.factorisations = 0

    def run(self) -> list[StepResult]:
        """Results of every frequency step, or of the last static one where there is none."""
        results = []
        for place, step in enumerate(self.steps):
            if step.procedure.name == "STATIC":
                self._static(step)
            else:
                results.append(self._frequency(place, step))
        return results or [self._result(self.steps[-1], [], {})]

    def press(self) -> dict[str, Any]:
        """Footprints of a job with a road, one per step with a force on it, and modes there."""
        assert self.road is not None
        wanted: list[float] = []
        vibrations: dict[float, press_job.Vibrating] = {}
        for step in self.steps:
            if step.centrifugal:
                raise DeckError(step.procedure.line, "a turning tyre on a road is not honoured")
            if step.procedure.name == "FREQUENCY":
                if not wanted:
                    line = step.procedure.line
                    raise DeckError(line, "modes of a tyre on a road come after a force on it")
                vibrations[wanted[-1]] = self._vibrating(step)
                continue
            if step.procedure.name != "STATIC":
                raise DeckError(step.procedure.line, "a turning tyre on a road is not honoured")
            step.held = [row for row in step.held if row.text(0) != self.road.node]
            if not step.forces:
                self._static(step)
                continue
            row = step.forces[-1]
            if row.text(0) != self.road.node or row.integer(1) != 1:
                raise DeckError(row.line, "the force on the road is along the first axis")
            wanted.append(-float(np.real(row.number(2))))
            if not wanted[-1] > max([0.0, *wanted[:-1]]):
                raise DeckError(row.line, "loads on the road must push it to the tyre, and rise")
        if not wanted:
            raise DeckError(self.steps[-1].procedure.line, "no *CLOAD presses the road")
        step = [each for each in self.steps if each.procedure.name == "STATIC"][-1]
        model = self._model(None, step.long_term)
        loads = _loads(model, step)
        found = press_job.press(
            model, numbering(model, step), loads, self.U, self.road, wanted,
            self._check_time, TimedOut, vibrations,
        )  # fmt: skip
        return {"pressure_Pa": step.pressure, "mass_kg": self.mass_kg, **found}

    def _vibrating(self, step: Step) -> press_job.Vibrating:
        """What a *FREQUENCY step on the road asks for."""
        assert self.road is not None
        line, row = step.procedure.line, step.procedure.only_row()
        if any(row.fields[1:]):
            raise DeckError(row.line, "limits and shifts of a loaded tyre's modes are not honoured")
        if not any(r.text(0) == self.road.node and r.integer(1) == 1 for r in step.held):
            raise DeckError(
                line, f"node {self.road.node} must hold the road while the tyre vibrates"
            )
        if step.output not in self.model.mesh.node_sets:
            raise DeckError(line, "modes on the road need a *NODE FILE with a set of the section")
        numbers = self.model.mesh.node_sets[step.output]
        nodes = np.array([self.model.mesh.index[n] for n in numbers])
        model = self._model(step.procedure.number("PROPERTY EVALUATION"), step.long_term)
        return press_job.Vibrating(model, row.integer(0), nodes)

    def _model(
        self, dynamic_Hz: float | None, long_term: bool, own_frequency: bool = False
    ) -> Model:
        key = dynamic_Hz, long_term, own_frequency
        if key not in self._models:
            self._models[key] = build(self.section, *key)
        return self._models[key]

    def _turning(self, model: Model, step: Step) -> Model:
        """The model with the centrifugal load of a step. Raises DeckError."""
        spin2 = _uniform(model, step, step.centrifugal, "CENTRIF")
        return replace(model, spin2=spin2) if spin2 else model

    def _static(self, step: Step) -> None:
        self._check_time()
        model = self._turning(self._model(None, step.long_term), step)
        equations = numbering(model, step)
        found = equilibrium(model, equations, _loads(model, step), self.U, self._check_time)
        self.U = found.U
        self.factorisations += found.factorisations

    def _frequency(self, place: int, step: Step) -> StepResult:
        procedure = step.procedure
        dynamic_Hz = procedure.number("PROPERTY EVALUATION")
        row = procedure.rows[0] if procedure.rows else Row(procedure.line, [])
        shift = float(np.real(row.number(3, 0.0))) * (2 * np.pi) ** 2
        own = self.request.own_frequency
        model = self._turning(self._model(dynamic_Hz, step.long_term, own), step)
        equations = numbering(model, step)
        wheel, air = self._beside(self.section, model, step)
        vibration = Vibration(
            model, self.U, _loads(model, step), equations, shift,
            wheel, air, float(np.real(row.number(1, 0.0))),
        )  # fmt: skip
        factor = vibration.factor(0)
        solver: HasModes = vibration
        if model.laws:
            solver = SelfConsistent(vibration, model.laws)
        modes = self._modes(step, row, solver, factor)
        if row.text(2):
            modes = [m.below(float(np.real(row.number(2)))) for m in modes]
        newton = factor.tyre if isinstance(factor, Bordered) else factor
        if self.request.sensitivities and (dynamic_Hz is not None or shift):
            still = self._turning(self._model(None, step.long_term), step)  # Newton's tangent
            plain = Vibration(still, self.U, _loads(still, step), equations, 0.0).factor(0)
            newton = plain.tyre if isinstance(plain, Bordered) else plain
        rates: dict[str, list[Array]] = {}
        if self.request.sensitivities:
            fields, eigenvalues = _asked(modes)
            for variable, tangents in self.request.sensitivities.items():
                rates[variable] = self._rates(
                    tangents, place, dynamic_Hz, newton, equations, modes, fields, eigenvalues
                )
        return self._result(step, modes, rates)

    def _beside(
        self, section: list[Keyword], model: Model, step: Step
    ) -> tuple[Wheel | None, Air | None]:
        """The rim that moves in a step and the gas in the cavity, where there are such."""
        wheel = read_wheel(self.deck.revolve, model.mesh, step) if step.revolved else None
        cavity = self.request.cavity
        return wheel, read_air(section, model.mesh, cavity) if cavity else None

    def _modes(
        self,
        step: Step,
        row: Row,
        vibration: HasModes,
        factor: Cholesky | Bordered,
    ) -> list[HarmonicModes]:
        harmonics = self.request.harmonics if step.revolved else [0]
        count = self.request.modes_per_harmonic
        uneven = self._is_uneven(step)
        if harmonics is None:
            lowest = lowest_of_all(vibration, row.integer(0), self._check_time)
            if not uneven:
                return lowest
            harmonics, count = [m.n for m in lowest], max(len(m.eigenvalues) for m in lowest)
        if uneven:
            return self._uneven(step, vibration, harmonics, count)
        modes = []
        for n in harmonics:
            self._check_time()
            known = factor if n == 0 else None
            modes.append(vibration.modes(n, count, known))
        return modes

    def _is_uneven(self, step: Step) -> bool:
        """Whether the tyre is not the same all round, or turns."""
        turns = step.procedure.name == "COMPLEX FREQUENCY"
        return bool(turns or self.sector or read_attached(self.deck.revolve, self.model.mesh))

    def _uneven(
        self, step: Step, vibration: HasModes, harmonics: list[int], count: int
    ) -> list[HarmonicModes]:
        """Modes of a tyre that is not the same all round, or that turns."""
        line = step.procedure.line
        attached = read_attached(self.deck.revolve, self.model.mesh)
        turns = step.procedure.name == "COMPLEX FREQUENCY"
        if bool(attached) + turns + bool(self.sector) > 1:
            raise DeckError(
                line,
                "of masses and springs on the tyre, a sector of other stuff, and its turning, one"
                " at a time is honoured",
            )
        if not (isinstance(vibration, Vibration) and vibration.plain):
            raise DeckError(
                line,
                "masses and springs on the tyre, a sector of other stuff, or its turning, are not"
                " honoured together with a rim that moves, air in the cavity or rubber at each"
                " mode's own frequency",
            )
        if turns:
            spin = _agreed_spin(self.model, step)
            modes = []
            for n in harmonics:
                self._check_time()
                modes.append(waves(vibration, spin, n, count))
            return modes
        if attached:
            equations = vibration.numbering
            if (equations.equation[attached.rows, attached.components] == equations.size).any():
                raise DeckError(line, "masses and springs on nodes that are held do nothing")
            return attached_modes(vibration, attached, harmonics, count, self._check_time)
        if step.procedure.number("PROPERTY EVALUATION") is not None or vibration.shift:
            raise DeckError(line, "a sector of other stuff is honoured at the static moduli")
        if self.request.sensitivities:
            raise DeckError(line, "a tyre with a sector of other stuff has no exact derivatives")
        assert self.request.sector
        model, other = (build(k, None, step.long_term) for k in (self.section, self.sector))
        if model.mesh is not other.mesh:
            raise DeckError(line, "the sector's section job must have the same mesh")
        sector = Sector(np.radians(float(self.request.sector["width_deg"])), other)
        return sector_modes(
            vibration, self.U, _loads(model, step), model, sector, harmonics, count,
            self._check_time,
        )  # fmt: skip

    def _rates(
        self,
        tangents: list[Tangent],
        place: int,
        dynamic_Hz: float | None,
        factor: Cholesky,
        equations: Numbering,
        modes: list[HarmonicModes],
        fields: sensitivity.Fields,
        eigenvalues: Array,
    ) -> list[Array]:
        """d lambda / d variable per harmonic, with the deck's numbers carrying its tangent."""
        section, steps = self.deck.read(tangents)
        step = steps[place]
        still = self._turning(build(section, None, step.long_term), step)
        V = sensitivity.state_rate(still, self.U, _loads(still, step), equations, factor)
        moving = still
        own = self.request.own_frequency
        if dynamic_Hz is not None or own:
            moving = self._turning(build(section, dynamic_Hz, step.long_term, own), step)
        wheel, air = self._beside(section, moving, step)
        beside = None
        if wheel or air:
            rim, flow = [q for m in modes for q in m.rim], [w for m in modes for w in m.air]
            beside = sensitivity.Beside(wheel, air, rim, flow)
        forms = sensitivity.eigenvalue_rates(
            moving, self.U, V, _loads(moving, step), fields, eigenvalues, beside
        )
        attached = read_attached(self.deck.revolve, self.model.mesh)
        spin = _uniform(self.model, step, step.spin, "ROTDYNF")
        change = Change(moving, spin, attached)
        each = np.split(forms, np.cumsum([len(m.eigenvalues) for m in modes])[:-1])
        return [
            m.makeup.rates(own_forms, change) if m.makeup else own_forms
            for m, own_forms in zip(modes, each, strict=True)
        ]

    def _result(
        self, step: Step, modes: list[HarmonicModes], rates: dict[str, list[Array]]
    ) -> StepResult:
        return StepResult(
            step.number, step.pressure, self.mass_kg, modes, rates, self.U, self.factorisations
        )

    def _check_time(self) -> None:
        if time.monotonic() > self.deadline:
            raise TimedOut("the time limit passed")


def _asked(modes: list[HarmonicModes]) -> tuple[sensitivity.Fields, Array]:
    """The fields and the eigenvalues whose derivatives are asked for."""
    forms = [m.forms() for m in modes]
    n, shapes, owner, eigenvalues = (np.concatenate(x) for x in zip(*forms, strict=True))
    before = np.cumsum([0, *(len(values) for *_, values in forms[:-1])])
    owner += np.repeat(before, [len(own) for _, _, own, _ in forms])
    return sensitivity.Fields(n, shapes, owner), eigenvalues


def _uniform(
    model: Model, step: Step, sets: dict[str, complex | float], load: str
) -> complex | float:
    """The magnitude of a load that all of the tyre bears, 0 where there is none."""
    if not sets:
        return 0.0
    line, elements = step.procedure.line, model.mesh.element_sets
    unknown = [name for name in sets if name not in elements]
    if unknown:
        raise DeckError(line, f"element set {unknown[0]} of the step's *DLOAD is not defined")
    loaded = {number for name in sets for number in elements[name]}
    cords = {tuple(row) for c in model.cords for row in c.lines.connectivity.tolist()}
    for number in set(model.mesh.place) - loaded:
        kind, row = model.mesh.place[number]
        block = model.mesh.blocks[kind]
        if isinstance(block, Solids) or tuple(block.connectivity[row].tolist()) in cords:
            raise DeckError(line, f"element {number} has mass, but is left out of the load {load}")
    if len(set(sets.values())) > 1:
        raise DeckError(line, f"the load {load} must be one for all elements of the tyre")
    return next(iter(sets.values()))


def _agreed_spin(model: Model, step: Step) -> float:
    """Omega, rad/s, on which the step's loads agree. Raises DeckError."""
    line, spin = step.procedure.line, float(np.real(_uniform(model, step, step.spin, "ROTDYNF")))
    spin2 = float(np.real(_uniform(model, step, step.centrifugal, "CENTRIF")))
    if not spin:
        raise DeckError(line, "*COMPLEX FREQUENCY is honoured of a turning tyre: no ROTDYNF")
    if not abs(spin2 - spin**2) <= 1e-9 * spin**2:
        raise DeckError(line, f"CENTRIF {spin2:g} is not the square of ROTDYNF {spin:g}")
    return spin


def _loads(model: Model, step: Step) -> list[Load]:
    for surface in step.pressures:
        if surface not in model.mesh.faces:
            raise DeckError(step.procedure.line, f"surface {surface} of the step is not defined")
    return [Load(model.mesh.faces[s], value) for s, value in step.pressures.items()]
