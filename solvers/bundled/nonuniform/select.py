"""Modes of a tyre that is not the same all round, or that turns: which of these a deck asks for."""

from __future__ import annotations

import numpy as np

from ..deck.keywords import DeckError
from ..deck.steps import DeckStep
from ..modes.harmonics import HarmonicModes, HasModes, Vibration
from ..modes.inflated import Inflated
from ..section.loads import agreed_spin, pressures
from ..section.model import build
from .coupled import attached_modes
from .rotation import waves
from .splice import SpliceSector, sector_modes


def is_nonuniform(tyre: Inflated, step: DeckStep) -> bool:
    """Whether the tyre is not the same all round, or turns."""
    return bool(_turns(step) or tyre.sector or tyre.attached())


def nonuniform_modes(
    tyre: Inflated, step: DeckStep, vibration: HasModes, harmonics: list[int], count: int
) -> list[HarmonicModes]:
    """The ``count`` lowest modes of each harmonic. Raises DeckError, RunFailed."""
    line = step.procedure.line
    attached, turns = tyre.attached(), _turns(step)
    if bool(attached) + turns + bool(tyre.sector) > 1:
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
        spin = agreed_spin(tyre.model, step)
        modes = []
        for n in harmonics:
            tyre.check()
            modes.append(waves(vibration, spin, n, count))
        return modes
    if attached:
        if not vibration.numbering.free[attached.rows, attached.components].all():
            raise DeckError(line, "masses and springs on nodes that are held do nothing")
        return attached_modes(vibration, attached, harmonics, count, tyre.check)
    return _sector_modes(tyre, step, vibration, harmonics, count)


def _sector_modes(
    tyre: Inflated, step: DeckStep, vibration: Vibration, harmonics: list[int], count: int
) -> list[HarmonicModes]:
    """With a sector of other stuff, at the static moduli."""
    line = step.procedure.line
    if step.procedure.number("PROPERTY EVALUATION") is not None or vibration.shift:
        raise DeckError(line, "a sector of other stuff is honoured at the static moduli")
    if tyre.request.sensitivities:
        raise DeckError(line, "a tyre with a sector of other stuff has no exact derivatives")
    assert tyre.request.sector
    model, other = (build(k, None, step.long_term) for k in (tyre.section, tyre.sector))
    if model.mesh is not other.mesh:
        raise DeckError(line, "the sector's section job must have the same mesh")
    sector = SpliceSector(np.radians(float(tyre.request.sector["width_deg"])), other)
    return sector_modes(
        vibration, tyre.U, pressures(model, step), model, sector, harmonics, count, tyre.check
    )


def _turns(step: DeckStep) -> bool:
    return step.procedure.name == "COMPLEX FREQUENCY"
