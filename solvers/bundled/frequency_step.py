"""A frequency step: modes of the inflated tyre, and the derivatives of their eigenvalues.

A tyre may have point masses and springs, or a stiff sector, or turn: only one of the three.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..language.text import COMPLEX_STEP, Block, DeckError, Row
from .deck.request import Request
from .deck.steps import Deck, DeckStep, Tangent
from .modes.bordered import Bordered
from .modes.cavity import GasCavity, read_cavity
from .modes.damping import loss_forms
from .modes.frequency_dependent import SelfConsistent
from .modes.harmonics import HarmonicModes, HasModes, SeededTyre, Vibration, lowest_of_all
from .modes.response import Response, ResponseResult, tread_patch
from .modes.sensitivity import ModeShapes, RimAndAir, eigenvalue_rates, state_rate
from .modes.superelement import superelement
from .modes.wheel import Wheel, read_wheel
from .nonuniform.coupled import attached_modes
from .nonuniform.rotation import waves
from .nonuniform.splice import SpliceSector, sector_modes
from .section.boundary import vibrating
from .section.kept_fields import Factor
from .section.loads import agreed_spin, loads, pressures, spin
from .section.mechanics import total_mass
from .section.mesh import read_mesh
from .section.model import Model, build
from .section.point_elements import PointElements, read_point_elements
from .section.stability import stable_factor

Array = np.ndarray
Models = Callable[[float | None, bool, bool], Model]
"""Builds the section's model from the arguments dynamic_Hz, long_term, own_frequency of `build`."""


@dataclass
class Inflated:
    """The inflated tyre of a deck, and the requested results."""

    deck: Deck
    request: Request
    section: list[Block]  # model blocks of the job of the section
    revolve: list[Block]  # of the job that revolves it; empty if there is none
    sector: list[Block]  # of the section of a stiff sector (splice); empty if there is none
    models: Models
    half: bool  # whether the models have half of a symmetric section
    U: Array  # displacements (nodes, 3), m
    check: Callable[[], None]  # raises if the time limit is exceeded

    @property
    def model(self) -> Model:
        """The section at its relaxed static moduli."""
        return self.models(None, True, False)

    def attached(self) -> PointElements:
        """Point masses and springs on the tyre. Raises DeckError."""
        return read_point_elements(self.revolve, read_mesh(self.section))

    def wheel_and_cavity(
        self, model: Model, step: DeckStep
    ) -> tuple[Wheel | None, GasCavity | None]:
        """The rim, if it moves in the step, and the gas in the cavity, if it is modelled."""
        wheel = read_wheel(self.revolve, model.mesh, step) if step.revolved else None
        cavity = self.request.cavity
        if not cavity:
            return wheel, None
        return wheel, read_cavity(self.section, read_mesh(self.section), cavity)


class FrequencyStep:
    """Modes and derivatives of one frequency step; ``place``: its index among the deck's steps.

    Raises DeckError, RunFailed.
    """

    def __init__(self, tyre: Inflated, place: int, step: DeckStep):
        self.tyre, self.place, self.step = tyre, place, step
        self.dynamic_Hz = step.procedure.number("PROPERTY EVALUATION")
        # how many modes, the lowest and the highest frequency, the shift in cycles squared
        rows = step.procedure.rows
        self.row = rows[0] if rows else Row(step.procedure.place, "")
        self.model = _model(tyre, step, self.dynamic_Hz, tyre.request.own_frequency)
        self.equations = vibrating(self.model, step)
        self.vibration = Vibration(
            self.model,
            tyre.U,
            loads(self.model, step),
            self.equations,
            self.row.number(3, 0.0) * (2 * np.pi) ** 2,
            *tyre.wheel_and_cavity(self.model, step),
            lowest_Hz=self.row.number(1, 0.0),
        )
        self.factor = self.vibration.factor(0)
        self.static_factor = self._static_factor()

    def modes(self) -> list[HarmonicModes]:
        """Modes by harmonic."""
        solver: HasModes = self.vibration
        if self.model.tables:
            solver = SelfConsistent(self.vibration, self.model.tables)
        modes = self._modes(solver)
        return [m.below(self.row.number(2)) for m in modes] if self.row.text(2) else modes

    def _modes(self, solver: HasModes) -> list[HarmonicModes]:
        """Modes of the wanted harmonics, coupled if the tyre is not uniform."""
        tyre, step = self.tyre, self.step
        harmonics = tyre.request.harmonics if step.revolved else [0]
        count, nonuniform = tyre.request.modes_per_harmonic, is_nonuniform(tyre, step)
        if harmonics is None:
            lowest = lowest_of_all(solver, self.row.integer(0), tyre.check)
            if not nonuniform:
                return lowest
            harmonics, count = [m.n for m in lowest], max(len(m.eigenvalues) for m in lowest)
        if nonuniform:
            return nonuniform_modes(tyre, step, solver, harmonics, count)
        modes = []
        for n in harmonics:
            tyre.check()
            modes.append(solver.modes(n, count, None if n else self.factor))
        return modes

    def rates(self, modes: list[HarmonicModes]) -> tuple[dict[str, list[Array]], dict[str, float]]:
        """Derivatives by each variable: of the eigenvalues omega^2 (1/s2), one array per entry of
        ``modes`` (m,), and of the mass (kg)."""
        sensitivities = self.tyre.request.sensitivities
        if not sensitivities:
            return {}, {}
        fields, eigenvalues = _fields(modes)
        by_variable = {
            v: self._rates(rows, modes, fields, eigenvalues) for v, rows in sensitivities.items()
        }
        return {v: rates for v, (rates, _) in by_variable.items()}, {
            v: mass for v, (_, mass) in by_variable.items()
        }

    def damping(self, modes: list[HarmonicModes]) -> list[Array] | None:
        """Damping ratios, one array (m,) per entry of ``modes``; None if no material has a loss
        factor."""
        if not self.model.lossy:
            return None
        fields, eigenvalues = _fields(modes)
        forms = loss_forms(self.model, self.tyre.U, fields, eigenvalues)
        # a growth of K at the rate of the losses changes lambda at twice the rate of damping
        constant = SeededTyre(self.model, spin(self.model, self.step), self.tyre.attached())
        return [
            rates / (2 * m.eigenvalues)
            for m, rates in zip(modes, _of_modes(modes, forms, constant), strict=True)
        ]

    def response(self) -> ResponseResult | None:
        """The requested responses; None if there are none. Raises DeckError, RunFailed."""
        wanted, place, model, U = (
            self.tyre.request.response,
            self.step.procedure.place,
            self.model,
            self.tyre.U,
        )
        if wanted is None:
            return None
        held, wheel = self.vibration, self.vibration.wheel
        if is_nonuniform(self.tyre, self.step) or held.air:
            words = "a response needs a tyre that is the same all round, without gas"
            raise DeckError(place, words)
        if wheel or held.shift:
            if wanted.modes:
                raise DeckError(place, "matrices need a rim that is held")
            acting = loads(model, self.step)
            held = Vibration(model, U, acting, self.equations, 0.0)
        if wheel and not all(wheel.stiffness.get(m) for m in wheel.free) and not wanted.lowest_Hz:
            raise DeckError(place, "a free wheel has no response at 0 Hz: begin above it")
        if self.step.output not in model.mesh.node_sets:
            raise DeckError(place, "a response needs a *NODE FILE with a set of the tread's nodes")
        tread = [model.mesh.index[n] for n in model.mesh.node_sets[self.step.output]]
        patch = tread_patch(model.mesh.X, U, np.array(tread), wanted.patch_m)
        lowest, highest = wanted.lowest_Hz, wanted.highest_Hz
        frequencies = np.linspace(lowest, highest, wanted.lines)
        response = Response(held, model, U, patch, highest, self.tyre.check, wheel)
        points = wanted.points()
        counts = len(response.harmonics), response.wanted
        receptance, hub = response.at(frequencies, *points)
        matrices = {}
        if wanted.modes:
            matrices = vars(superelement(response, wanted.modes, points[1]))
        return ResponseResult(frequencies, receptance, hub, patch.radius, *counts, matrices)

    def _static_factor(self) -> Factor:
        """Factor of the static tangent at U, for dU / d variable; the vibration's if it is the same
        matrix."""
        if self.dynamic_Hz is not None or self.vibration.shift:
            still = _model(self.tyre, self.step, None, own=False)
            return stable_factor(still, self.tyre.U, loads(still, self.step), self.equations)
        return self.factor.tyre if isinstance(self.factor, Bordered) else self.factor

    def _rates(
        self,
        tangents: list[Tangent],
        modes: list[HarmonicModes],
        fields: ModeShapes,
        eigenvalues: Array,
    ) -> tuple[list[Array], float]:
        """Derivatives by one variable, as in `rates`, by complex steps.

        tangents: the numbers of the deck that depend on it, with their derivatives.
        """
        section, revolve, steps = self.tyre.deck.read(tangents)
        models = partial(build, section, half=self.tyre.half)
        seeded = replace(self.tyre, section=section, revolve=revolve, models=models)
        step, U, own = steps[self.place], seeded.U, seeded.request.own_frequency
        still = moving = _model(seeded, step, None, own=False)
        V = state_rate(still, U, loads(still, step), self.equations, self.static_factor)
        if self.dynamic_Hz is not None or own:
            moving = _model(seeded, step, self.dynamic_Hz, own)
        wheel, air = seeded.wheel_and_cavity(moving, step)
        rim_and_air = None
        if wheel or air:
            # amplitudes of the rim's motions and of the gas flow in each mode
            rim, flow = [q for m in modes for q in m.rim], [w for m in modes for w in m.air]
            rim_and_air = RimAndAir(wheel, air, rim, flow)
        acting = loads(moving, step)
        forms = eigenvalue_rates(moving, U, V, acting, fields, eigenvalues, rim_and_air)
        attached = read_point_elements(revolve, moving.mesh)
        tyre = SeededTyre(moving, spin(self.model, step), attached)
        mass = (total_mass(moving) + attached.total_kg).imag / COMPLEX_STEP
        return _of_modes(modes, forms, tyre), float(mass)


def _fields(modes: list[HarmonicModes]) -> tuple[ModeShapes, Array]:
    """All modes as sums of shapes, as one mode can have several harmonics, and their
    eigenvalues."""
    forms = [m.forms() for m in modes]
    n, shapes, owner, eigenvalues = (np.concatenate(x) for x in zip(*forms, strict=True))
    before = np.cumsum([0, *(len(values) for *_, values in forms[:-1])])
    owner += np.repeat(before, [len(own) for _, _, own, _ in forms])
    return ModeShapes(n, shapes, owner), eigenvalues


def _of_modes(modes: list[HarmonicModes], forms: Array, tyre: SeededTyre) -> list[Array]:
    """d lambda, one array (m,) per entry of ``modes``, from the forms of all modes."""
    each = np.split(forms, np.cumsum([len(m.eigenvalues) for m in modes])[:-1])
    return [
        m.combination.rates(its, tyre) if m.combination else its
        for m, its in zip(modes, each, strict=True)
    ]


def _model(tyre: Inflated, step: DeckStep, dynamic_Hz: float | None, own: bool) -> Model:
    """The model in a step, see `section.model.build`; own: of each mode's own frequency."""
    return tyre.models(dynamic_Hz, step.long_term, own)


def is_nonuniform(tyre: Inflated, step: DeckStep) -> bool:
    """Whether the tyre has point elements or a sector, or turns, so that harmonics are coupled."""
    return bool(_turns(step) or tyre.sector or tyre.attached())


def nonuniform_modes(
    tyre: Inflated, step: DeckStep, vibration: HasModes, harmonics: list[int], count: int
) -> list[HarmonicModes]:
    """The ``count`` lowest modes of each harmonic. Raises DeckError, RunFailed."""
    place = step.procedure.place
    attached, turns = tyre.attached(), _turns(step)
    if bool(attached) + turns + bool(tyre.sector) > 1:
        raise DeckError(
            place,
            "of masses and springs on the tyre, a sector of other stuff, and its turning, one"
            " at a time is honoured",
        )
    if not (isinstance(vibration, Vibration) and vibration.plain):
        raise DeckError(
            place,
            "masses and springs on the tyre, a sector of other stuff, or its turning, are not"
            " honoured together with a rim that moves, air in the cavity or rubber at each"
            " mode's own frequency",
        )
    if turns:
        spin = agreed_spin(tyre.model, step)
        modes = []
        for n in harmonics:
            tyre.check()
            modes.append(waves(vibration, spin, n, count))
        return modes
    if attached:
        if not vibration.numbering.free[attached.rows, attached.components].all():
            raise DeckError(place, "masses and springs on nodes that are held do nothing")
        return attached_modes(vibration, attached, harmonics, count, tyre.check)
    return _sector_modes(tyre, step, vibration, harmonics, count)


def _sector_modes(
    tyre: Inflated, step: DeckStep, vibration: Vibration, harmonics: list[int], count: int
) -> list[HarmonicModes]:
    """Modes of a tyre with a stiff sector, at the static moduli."""
    place = step.procedure.place
    if step.procedure.number("PROPERTY EVALUATION") is not None or vibration.shift:
        raise DeckError(place, "a sector of other stuff is honoured at the static moduli")
    if tyre.request.sensitivities:
        raise DeckError(place, "a tyre with a sector of other stuff has no exact derivatives")
    assert tyre.request.sector
    model, other = (
        build(keywords, None, step.long_term, half=tyre.half)
        for keywords in (tyre.section, tyre.sector)
    )
    if model.mesh is not other.mesh:
        raise DeckError(place, "the sector's section job must have the same mesh")
    sector = SpliceSector(np.radians(tyre.request.sector.width_deg), other)
    return sector_modes(
        vibration, tyre.U, pressures(model, step), model, sector, harmonics, count, tyre.check
    )


def _turns(step: DeckStep) -> bool:
    return step.procedure.name == "COMPLEX FREQUENCY"
