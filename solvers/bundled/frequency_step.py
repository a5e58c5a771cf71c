"""A frequency step: modes of the inflated tyre, and how fast their eigenvalues change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .deck.keywords import DataLine
from .deck.steps import DeckStep, Tangent
from .modes import sensitivity
from .modes.bordered import Bordered
from .modes.frequency_dependent import SelfConsistent
from .modes.harmonics import HarmonicModes, HasModes, SeededTyre, Vibration, lowest_of_all
from .modes.inflated import Inflated
from .nonuniform.select import is_nonuniform, nonuniform_modes
from .section.band import Cholesky, Numbering
from .section.boundary import numbering
from .section.loads import pressures, spin, turning
from .section.model import build

Array = np.ndarray


def frequency_step(
    tyre: Inflated, place: int, step: DeckStep
) -> tuple[list[HarmonicModes], dict[str, list[Array]]]:
    """Modes by harmonic, and d lambda / d variable by variable and harmonic.

    place: of the step among all of the deck. Raises DeckError, Unstable, NotConverged,
    NotSelfConsistent, InflationFailed.
    """
    procedure = step.procedure
    dynamic_Hz = procedure.number("PROPERTY EVALUATION")
    row = procedure.rows[0] if procedure.rows else DataLine(procedure.line, [])
    shift = float(np.real(row.number(3, 0.0))) * (2 * np.pi) ** 2
    own = tyre.request.own_frequency
    model = turning(tyre.models(dynamic_Hz, step.long_term, own), step)
    equations = numbering(model, step)
    wheel, air = tyre.wheel_and_cavity(model, step)
    vibration = Vibration(
        model,
        tyre.U,
        pressures(model, step),
        equations,
        shift,
        wheel,
        air,
        float(np.real(row.number(1, 0.0))),
    )
    factor = vibration.factor(0)
    solver: HasModes = vibration
    if model.tables:
        solver = SelfConsistent(vibration, model.tables)
    modes = _modes(tyre, step, row, solver, factor)
    if row.text(2):
        modes = [m.below(float(np.real(row.number(2)))) for m in modes]
    rates: dict[str, list[Array]] = {}
    if tyre.request.sensitivities:
        newton = factor.tyre if isinstance(factor, Bordered) else factor
        if dynamic_Hz is not None or shift:
            still = turning(tyre.models(None, step.long_term, False), step)  # Newton's tangent
            plain = Vibration(still, tyre.U, pressures(still, step), equations, 0.0).factor(0)
            newton = plain.tyre if isinstance(plain, Bordered) else plain
        fields, eigenvalues = _asked(modes)
        for variable, tangents in tyre.request.sensitivities.items():
            rates[variable] = _rates(
                tyre, tangents, place, dynamic_Hz, newton, equations, modes, fields, eigenvalues
            )
    return modes, rates


def _modes(
    tyre: Inflated, step: DeckStep, row: DataLine, vibration: HasModes, factor: Cholesky | Bordered
) -> list[HarmonicModes]:
    harmonics = tyre.request.harmonics if step.revolved else [0]
    count = tyre.request.modes_per_harmonic
    uneven = is_nonuniform(tyre, step)
    if harmonics is None:
        lowest = lowest_of_all(vibration, row.integer(0), tyre.check)
        if not uneven:
            return lowest
        harmonics, count = [m.n for m in lowest], max(len(m.eigenvalues) for m in lowest)
    if uneven:
        return nonuniform_modes(tyre, step, vibration, harmonics, count)
    modes = []
    for n in harmonics:
        tyre.check()
        known = factor if n == 0 else None
        modes.append(vibration.modes(n, count, known))
    return modes


def _asked(modes: list[HarmonicModes]) -> tuple[sensitivity.ModeShapes, Array]:
    """The fields and the eigenvalues whose derivatives are asked for."""
    forms = [m.forms() for m in modes]
    n, shapes, owner, eigenvalues = (np.concatenate(x) for x in zip(*forms, strict=True))
    before = np.cumsum([0, *(len(values) for *_, values in forms[:-1])])
    owner += np.repeat(before, [len(own) for _, _, own, _ in forms])
    return sensitivity.ModeShapes(n, shapes, owner), eigenvalues


def _rates(
    tyre: Inflated,
    tangents: list[Tangent],
    place: int,
    dynamic_Hz: float | None,
    factor: Cholesky,
    equations: Numbering,
    modes: list[HarmonicModes],
    fields: sensitivity.ModeShapes,
    eigenvalues: Array,
) -> list[Array]:
    """d lambda / d variable per harmonic, with the deck's numbers carrying its tangent."""
    section, revolve, steps = tyre.deck.read(tangents)
    seeded = replace(tyre, section=section, revolve=revolve)
    step, own = steps[place], tyre.request.own_frequency
    still = turning(build(section, None, step.long_term), step)
    V = sensitivity.state_rate(still, tyre.U, pressures(still, step), equations, factor)
    moving = still
    if dynamic_Hz is not None or own:
        moving = turning(build(section, dynamic_Hz, step.long_term, own), step)
    wheel, air = seeded.wheel_and_cavity(moving, step)
    rim_and_air = None
    if wheel or air:
        rim, flow = [q for m in modes for q in m.rim], [w for m in modes for w in m.air]
        rim_and_air = sensitivity.RimAndAir(wheel, air, rim, flow)
    forms = sensitivity.eigenvalue_rates(
        moving, tyre.U, V, pressures(moving, step), fields, eigenvalues, rim_and_air
    )
    change = SeededTyre(moving, spin(tyre.model, step), seeded.attached())
    each = np.split(forms, np.cumsum([len(m.eigenvalues) for m in modes])[:-1])
    return [
        m.makeup.rates(own_forms, change) if m.makeup else own_forms
        for m, own_forms in zip(modes, each, strict=True)
    ]
