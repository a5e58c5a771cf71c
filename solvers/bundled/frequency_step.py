"""A frequency step: modes of the inflated tyre, and how fast their eigenvalues change.

Of a tyre that is not the same all round, or that turns, one thing at a time is honoured.
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
from .modes.frequency_dependent import SelfConsistent
from .modes.harmonics import HarmonicModes, HasModes, SeededTyre, Vibration, lowest_of_all
from .modes.sensitivity import ModeShapes, RimAndAir, eigenvalue_rates, state_rate
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
"""The section's model by `model.build`'s arguments dynamic_Hz, long_term, own_frequency."""


@dataclass
class Inflated:
    """A deck's tyre, and what is requested of it."""

    deck: Deck
    request: Request
    # model blocks: of the section's job; of the job that revolves it, of the section in a splice,
    # both empty where there is none
    section: list[Block]
    revolve: list[Block]
    sector: list[Block]
    models: Models
    half: bool  # they are of half the section, which stands for the whole
    U: Array  # displacements (nodes, 3), m
    check: Callable[[], None]  # raises where the time is over

    @property
    def model(self) -> Model:
        """The section at its relaxed static moduli."""
        return self.models(None, True, False)

    def attached(self) -> PointElements:
        """Masses and springs on the tyre. Raises DeckError."""
        return read_point_elements(self.revolve, read_mesh(self.section))

    def wheel_and_cavity(
        self, model: Model, step: DeckStep
    ) -> tuple[Wheel | None, GasCavity | None]:
        """The rim that moves in a step and the gas in the cavity, where there are such."""
        wheel = read_wheel(self.revolve, model.mesh, step) if step.revolved else None
        cavity = self.request.cavity
        if not cavity:
            return wheel, None
        return wheel, read_cavity(self.section, read_mesh(self.section), cavity)


class FrequencyStep:
    """A step of the tyre; ``place``: its own among all of the deck.

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
        self.newton = self._static_factor()

    def modes(self) -> list[HarmonicModes]:
        """Modes by harmonic."""
        solver: HasModes = self.vibration
        if self.model.tables:
            solver = SelfConsistent(self.vibration, self.model.tables)
        modes = self._modes(solver)
        return [m.below(self.row.number(2)) for m in modes] if self.row.text(2) else modes

    def _modes(self, solver: HasModes) -> list[HarmonicModes]:
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
        """d lambda / d variable per harmonic, and d mass / d variable, by variable."""
        sensitivities = self.tyre.request.sensitivities
        if not sensitivities:
            return {}, {}
        forms = [m.forms() for m in modes]
        n, shapes, owner, eigenvalues = (np.concatenate(x) for x in zip(*forms, strict=True))
        before = np.cumsum([0, *(len(values) for *_, values in forms[:-1])])
        owner += np.repeat(before, [len(own) for _, _, own, _ in forms])
        fields = ModeShapes(n, shapes, owner)
        by_variable = {
            v: self._rates(rows, modes, fields, eigenvalues) for v, rows in sensitivities.items()
        }
        return {v: rates for v, (rates, _) in by_variable.items()}, {
            v: mass for v, (_, mass) in by_variable.items()
        }

    def _static_factor(self) -> Factor:
        """`stable_factor` of the inflated tyre, or that of its vibration if it is the same."""
        if self.dynamic_Hz is not None or self.vibration.shift:
            still = _model(self.tyre, self.step, None, False)
            return stable_factor(still, self.tyre.U, loads(still, self.step), self.equations)
        return self.factor.tyre if isinstance(self.factor, Bordered) else self.factor

    def _rates(
        self,
        tangents: list[Tangent],
        modes: list[HarmonicModes],
        fields: ModeShapes,
        eigenvalues: Array,
    ) -> tuple[list[Array], float]:
        """Per harmonic, and the mass's; the deck's numbers carry the variable's tangent."""
        section, revolve, steps = self.tyre.deck.read(tangents)
        models = partial(build, section, half=self.tyre.half)
        seeded = replace(self.tyre, section=section, revolve=revolve, models=models)
        step, U, own = steps[self.place], seeded.U, seeded.request.own_frequency
        still = moving = _model(seeded, step, None, False)
        V = state_rate(still, U, loads(still, step), self.equations, self.newton)
        if self.dynamic_Hz is not None or own:
            moving = _model(seeded, step, self.dynamic_Hz, own)
        wheel, air = seeded.wheel_and_cavity(moving, step)
        rim_and_air = None
        if wheel or air:
            rim, flow = [q for m in modes for q in m.rim], [w for m in modes for w in m.air]
            rim_and_air = RimAndAir(wheel, air, rim, flow)
        acting = loads(moving, step)
        forms = eigenvalue_rates(moving, U, V, acting, fields, eigenvalues, rim_and_air)
        attached = read_point_elements(revolve, moving.mesh)
        tyre = SeededTyre(moving, spin(self.model, step), attached)
        each = np.split(forms, np.cumsum([len(m.eigenvalues) for m in modes])[:-1])
        mass = (total_mass(moving) + attached.total_kg).imag / COMPLEX_STEP
        rates = [
            m.combination.rates(its, tyre) if m.combination else its
            for m, its in zip(modes, each, strict=True)
        ]
        return rates, float(mass)


def _model(tyre: Inflated, step: DeckStep, dynamic_Hz: float | None, own: bool) -> Model:
    return tyre.models(dynamic_Hz, step.long_term, own)


def is_nonuniform(tyre: Inflated, step: DeckStep) -> bool:
    """Whether the tyre is not the same all round, or turns."""
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
    """Modes with a sector of other stuff, at the static moduli."""
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
    sector = SpliceSector(np.radians(float(tyre.request.sector["width_deg"])), other)
    return sector_modes(
        vibration, tyre.U, pressures(model, step), model, sector, harmonics, count, tyre.check
    )


def _turns(step: DeckStep) -> bool:
    return step.procedure.name == "COMPLEX FREQUENCY"
