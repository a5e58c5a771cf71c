"""Runs a pair of decks: the section job (inflation) and the revolve job (modes, or footprints)."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from ..errors import RunFailed
from ..language.text import COMPLEX_STEP, Block, DeckError, read_deck
from .deck.request import Request, read_request, read_sector
from .deck.start import PressedStart, read_pressed_start, read_start
from .deck.steps import Deck, DeckStep
from .frequency_step import FrequencyStep, Inflated
from .modes.cavity import read_cavity
from .modes.harmonics import HarmonicModes
from .modes.sensitivity import state_rate
from .modes.wheel import free_along_load
from .results import StepResult, write
from .road.road_data import (
    ROAD_NUMBERS,
    InflatedTangent,
    LoadRequest,
    ModeRequest,
    RimRequest,
    TyreToPress,
    read_road,
)
from .section import mechanics
from .section.boundary import keeps_half_turn, numbering, rim_motion, vibrating
from .section.inflation import equilibrium
from .section.loads import loads, pressures
from .section.mesh import DeckMesh, read_mesh
from .section.model import Model, build
from .section.stability import slower, stable_factor


def run(folder: Path, job: str, oldjob: str | None, time_limit_s: float = float("inf")) -> None:
    """Run ``job`` (on top of ``oldjob``) in ``folder``; write JOB.json and JOB.npz there.

    time_limit_s: of processor time. Raises Refused, RunFailed, OSError.
    """
    with _threads().limit(limits=1, user_api="blas"):
        texts = {name: read_deck(folder / f"{name}.inp") for name in (job, oldjob) if name}
        deck = Deck(texts, job, oldjob)
        request = read_request(folder / f"{job}.request.json", list(texts))
        sector = read_sector(folder, request.sector) if request.sector else []
        start = read_start(folder, texts[oldjob or job])
        analysis = Job(deck, request, time_limit_s, sector, start)
        try:
            if analysis.road is not None:
                from .road import footprint_job  # late: only what is pressed needs it

                pressed_start = read_pressed_start(folder, texts[job])
                footprint_job.write(folder / job, analysis.model, analysis.press(pressed_start))
            else:
                write(folder / job, analysis.model, analysis.run())
        except (np.linalg.LinAlgError, OverflowError, ZeroDivisionError) as error:
            raise RunFailed("crashed", f"the deck's numbers are too far apart: {error}") from None


@cache
def _threads() -> ThreadpoolController:
    """One BLAS thread: the matrices are small, and the bytes do not depend on the machine."""
    return ThreadpoolController()


def _on_nodes(shape: np.ndarray | None, mesh: DeckMesh) -> np.ndarray | None:
    """The displacements (n, 3) of a shape to start from; None where it is of other nodes."""
    if shape is None or sorted(shape[:, 0]) != sorted(mesh.index):
        return None
    U = np.zeros((len(mesh.X), 3))
    U[[mesh.index[int(number)] for number in shape[:, 0]]] = shape[:, 1:]
    return U


class Job:
    """The steps of a deck, carried out one after the other from the state at rest."""

    def __init__(
        self,
        deck: Deck,
        request: Request,
        time_limit_s: float = float("inf"),
        sector: Sequence[Block] = (),
        start: np.ndarray | None = None,
    ):
        section, revolve, self.steps = deck.read([])
        self.time_limit_s, self.began_s = time_limit_s, time.thread_time()
        self.road = read_road(revolve)
        mesh = read_mesh(section)
        filled = [section, list(sector)] if sector else [section]
        symmetric = [self._off_road(s) for s in self.steps if not (self.road and s.forces)]
        half = all(keeps_half_turn(read_mesh(each), each, symmetric) for each in filled)
        self.inflating = cache(partial(build, section, half=half))
        models = self.inflating
        if half and self.road:  # a tyre on the road is whole
            half, models = False, cache(partial(build, section))
        self.model = models(None, True, False)
        U = np.zeros((len(mesh.X), 3))
        check = self._check_time
        self.tyre = Inflated(deck, request, section, revolve, list(sector), models, half, U, check)
        self.mass_kg = float(mechanics.total_mass(self.model).real)
        self.mass_kg += float(self.tyre.attached().total_kg.real)
        self.factorisations = 0
        self.guess = _on_nodes(start, mesh)

    def run(self) -> list[StepResult]:
        """Results of every frequency step, or of the last static one where there is none."""
        results: list[StepResult] = []
        for place, step in enumerate(self.steps):
            with self._slower(step):
                if step.procedure.name == "STATIC":
                    self._static(step)
                else:
                    work = FrequencyStep(self.tyre, place, step)
                    modes = work.modes()
                    rates = work.rates(modes)
                    results.append(self._result(step, modes, *rates, work.damping(modes)))
                    results[-1].response = work.response()
        if not results:
            with self._slower(self.steps[-1]):
                self._judge(self.steps[-1])
        return results or [self._result(self.steps[-1], [], {}, {})]

    def press(self, start: PressedStart | None = None) -> dict[str, Any]:
        """Footprints of a job with a road, one per step with a force on it, modes and slopes
        there; ``start``: another tyre on the road, whose states begin the loads."""
        assert self.road is not None
        wanted: list[float] = []
        vibrations: dict[float, ModeRequest] = {}
        rim_motions: dict[float, list[list[float]]] = {}
        for step in self.steps:
            if step.centrifugal:
                raise DeckError(step.procedure.place, "a turning tyre on a road is not honoured")
            if step.procedure.name == "FREQUENCY":
                if not wanted:
                    place = step.procedure.place
                    raise DeckError(place, "modes of a tyre on a road come after a force on it")
                vibrations[wanted[-1]] = self._vibrating(step)
                continue
            if step.procedure.name != "STATIC":
                raise DeckError(step.procedure.place, "a turning tyre on a road is not honoured")
            if step.is_perturbation:
                if not wanted:
                    place = step.procedure.place
                    raise DeckError(place, "motions of the rim on a road come after a force on it")
                rim_motions.setdefault(wanted[-1], []).append(self._rim_motion(step))
                continue
            step.held = self._off_road(step).held
            if not step.forces:
                self._static(step)
                continue
            if not wanted:
                self._judge(step)
            row = step.forces[-1]
            if row.text(0) != self.road.node or row.integer(1) != 1:
                raise DeckError(row.place, "the force on the road is along the first axis")
            wanted.append(-row.number(2))
            if not wanted[-1] > max([0.0, *wanted[:-1]]):
                raise DeckError(row.place, "loads on the road must push it to the tyre, and rise")
        if not wanted:
            raise DeckError(self.steps[-1].procedure.place, "no *CLOAD presses the road")
        last, inflated = self._on_road()
        step = self.steps[last]
        rim = {load: self._rim_request(motions) for load, motions in rim_motions.items()}
        from .road import footprint_job, pressed_start  # late, as in `run`

        result = footprint_job.press(
            inflated,
            self.road,
            {load: LoadRequest(vibrations.get(load), rim.get(load)) for load in wanted},
            self._check_time,
            self._inflated_tangents(inflated, last),
            partial(pressed_start.begin, start) if start else None,
        )
        if self.tyre.request.cavity:
            result |= self._cavity(inflated.model, result)
        return {"pressure_Pa": step.pressure, "mass_kg": self.mass_kg, **result}

    def _on_road(self) -> tuple[int, TyreToPress]:
        """The place of the last static step, and the tyre in it."""
        static = [each.procedure.name == "STATIC" for each in self.steps]
        last = max(i for i, each in enumerate(self.steps) if static[i] and not each.is_perturbation)
        step = self.steps[last]
        model = self.tyre.models(None, step.long_term, False)
        acting = pressures(model, step)
        return last, TyreToPress(model, numbering(model, step), acting, self.tyre.U)

    def _off_road(self, step: DeckStep) -> DeckStep:
        """A step that holds all that it did but the road."""
        node = self.road.node if self.road else None
        return replace(step, held=[row for row in step.held if row.text(0) != node])

    def _inflated_tangents(self, tyre: TyreToPress, place: int) -> dict[str, InflatedTangent]:
        """Tangents by variable of the tyre of the last static step, at its ``place``."""
        sensitivities = self.tyre.request.sensitivities
        if not sensitivities:
            return {}
        equations = tyre.equations
        stiffness = mechanics.tangents(tyre.model, tyre.U, tyre.loads, harmonics=False)[0]
        newton, tangents = equations.factor(equations.assemble(stiffness)), {}
        for variable, rows in sensitivities.items():
            section, revolve, steps = self.tyre.deck.read(rows)
            step, road = steps[place], read_road(revolve)
            step.held = self._off_road(step).held
            seeded = build(section, None, step.long_term)
            loads, rate = pressures(seeded, step), lambda number: np.imag(number) / COMPLEX_STEP
            U = state_rate(seeded, tyre.U, loads, equations, newton)
            numbers = {name: float(rate(getattr(road, name))) for name in ROAD_NUMBERS}
            tangents[variable] = InflatedTangent(seeded, loads, U, numbers)
        return tangents

    def _cavity(self, model: Model, result: dict[str, Any]) -> dict[str, Any]:
        """cavity_Hz of the first wave in the cavity: of the inflated tyre, and in each footprint
        the two, fore-aft and vertical."""
        assert self.tyre.request.cavity
        from .road.pressed_cavity import cavity_modes  # late: SciPy's splines take 0.3 s

        air = read_cavity(self.tyre.section, model.mesh, self.tyre.request.cavity)
        X, U = model.mesh.X, self.tyre.U
        hertz = lambda u, angles: cavity_modes(air, X, u, angles).tolist()
        footprints = [
            {**each, "cavity_Hz": hertz(each["displacement"], result["angles"])}
            for each in result["footprints"]
        ]
        free, _ = hertz(np.stack([U, U]), np.array([0.0, np.pi]))
        return {"cavity_Hz": free, "footprints": footprints}

    def _vibrating(self, step: DeckStep) -> ModeRequest:
        """Settings of a *FREQUENCY step of a tyre on the road. Raises DeckError."""
        assert self.road is not None
        place, row = step.procedure.place, step.procedure.only_row()
        if any(row.fields[1:]):
            raise DeckError(
                row.place, "limits and shifts of a loaded tyre's modes are not honoured"
            )
        if not any(r.text(0) == self.road.node and r.integer(1) == 1 for r in step.held):
            raise DeckError(
                place, f"node {self.road.node} must hold the road while the tyre vibrates"
            )
        if step.output not in self.model.mesh.node_sets:
            raise DeckError(place, "modes on the road need a *NODE FILE with a set of the section")
        numbers = self.model.mesh.node_sets[step.output]
        nodes = np.array([self.model.mesh.index[n] for n in numbers])
        dynamic_Hz = step.procedure.number("PROPERTY EVALUATION")
        model = self.tyre.models(dynamic_Hz, step.long_term, False)
        wheel_kg = free_along_load(self.tyre.revolve, self.model.mesh, step)
        response = self.tyre.request.response
        if response and wheel_kg is not None:
            raise DeckError(place, "a response on the road needs a rim that is held")
        return ModeRequest(model, row.integer(0), nodes, wheel_kg, response)

    def _rim_motion(self, step: DeckStep) -> list[float]:
        """Motion (6,) of the rim in a linear step of a tyre on a road: m and rad, along and about
        the deck's axes. Raises DeckError."""
        assert self.road is not None
        place, references = step.procedure.place, list(self.model.mesh.reference_nodes)
        if len(references) != 1:
            raise DeckError(place, "motions of one rim are honoured")
        held = [row for row in step.held if row.text(0) == self.road.node]
        freedoms = {dof for row in held for dof in range(row.integer(1), 1 + row.integer(2, 0))}
        if freedoms != set(range(1, 7)) or any(row.value(3, 0.0) for row in held):
            words = f"node {self.road.node} must be held in 1, 6 while the rim is moved"
            raise DeckError(place, words)
        motion = rim_motion(self.model.mesh, step, references[0])
        if motion.keys() != freedoms:
            raise DeckError(place, f"node {references[0]} needs a displacement in each of 1 to 6")
        return [motion[dof] for dof in range(1, 7)]

    def _rim_request(self, motions: list[list[float]]) -> RimRequest:
        """Request for the reactions to motions of the rim."""
        (reference,) = self.model.mesh.reference_nodes
        row = self.model.mesh.index[reference]
        return RimRequest(np.array(motions), float(np.real(self.model.mesh.X[row, 1])))

    def _static(self, step: DeckStep) -> None:
        """Inflate: find the equilibrium under a step's loads, which becomes the tyre's state."""
        self._check_time()
        model = self.inflating(None, step.long_term, False)
        acting, equations = loads(model, step), numbering(model, step)
        guess, self.guess = self.guess, None  # of the first step
        U, factorisations = equilibrium(
            model, equations, acting, self.tyre.U, self._check_time, guess
        )
        self.tyre.U = model.mesh.symmetry.field(U)
        self.factorisations += factorisations

    def _judge(self, step: DeckStep) -> None:
        """Raises RunFailed (``unstable``) unless the inflated tyre is stable."""
        model = self.inflating(None, step.long_term, False)
        stable_factor(model, self.tyre.U, loads(model, step), vibrating(model, step))

    @contextmanager
    def _slower(self, step: DeckStep) -> Iterator[None]:
        """Adds the highest stable speed to the failure of a tyre that turns."""
        try:
            yield
        except RunFailed as failure:
            model = self.inflating(None, step.long_term, False)
            acting, own = loads(model, step), (numbering(model, step), vibrating(model, step))
            raise slower(failure, model, self.tyre.U, acting, *own, self._check_time) from None

    def _result(
        self,
        step: DeckStep,
        modes: list[HarmonicModes],
        rates: dict[str, list[np.ndarray]],
        mass_rates: dict[str, float],
        damping: list[np.ndarray] | None = None,
    ) -> StepResult:
        return StepResult(
            step.number,
            step.pressure,
            self.mass_kg,
            modes,
            rates,
            self.tyre.U,
            self.factorisations,
            mass_rates,
            damping,
        )

    def _check_time(self) -> None:
        """Raises RunFailed once this thread has used up its processor time: a clock would end runs
        that only wait for a busy machine."""
        if time.thread_time() - self.began_s > self.time_limit_s:
            limit = f"{self.time_limit_s:g} s of processor time"
            raise RunFailed("timed_out", f"the run was ended at its time limit of {limit}")
