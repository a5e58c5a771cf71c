"""The loads of a step on the model: pressure, and the forces of a tyre that turns."""

from __future__ import annotations

import numpy as np

from ...language.text import DeckError
from ..deck.steps import DeckStep
from .boundary import check_open_ends
from .model import Model
from .parts.part import TyrePart
from .parts.pressure import Pressure
from .parts.spin import spinning


def pressures(model: Model, step: DeckStep) -> list[Pressure]:
    """The pressure on each surface. Raises DeckError."""
    for surface in step.pressures:
        if surface not in model.mesh.edges:
            raise DeckError(step.procedure.place, f"surface {surface} of the step is not defined")
    check_open_ends(model.mesh, step)
    return [Pressure(model.mesh.faces[s], value) for s, value in step.pressures.items()]


def loads(model: Model, step: DeckStep) -> list[TyrePart]:
    """All that acts on the tyre: pressures, and the forces of its spin. Raises DeckError."""
    spin2 = _uniform(model, step, step.centrifugal, "CENTRIF")
    spins = spinning(model.parts, model.mesh.X, spin2) if spin2 else []
    return [*pressures(model, step), *spins]


def spin(model: Model, step: DeckStep) -> complex | float:
    """Omega, rad/s, of the step's Coriolis load, 0 where there is none. Raises DeckError."""
    return _uniform(model, step, step.spin, "ROTDYNF")


def agreed_spin(model: Model, step: DeckStep) -> float:
    """Omega, rad/s, on which the step's loads agree. Raises DeckError."""
    place, omega = step.procedure.place, float(np.real(spin(model, step)))
    spin2 = float(np.real(_uniform(model, step, step.centrifugal, "CENTRIF")))
    if not omega:
        raise DeckError(place, "*COMPLEX FREQUENCY is honoured of a turning tyre: no ROTDYNF")
    if not abs(spin2 - omega**2) <= 1e-9 * omega**2:
        raise DeckError(place, f"CENTRIF {spin2:g} is not the square of ROTDYNF {omega:g}")
    return omega


def _uniform(
    model: Model, step: DeckStep, sets: dict[str, complex | float], load: str
) -> complex | float:
    """The magnitude of a load that all of the tyre bears, 0 where there is none. Raises
    DeckError."""
    if not sets:
        return 0.0
    place, elements = step.procedure.place, model.mesh.element_sets
    unknown = [name for name in sets if name not in elements]
    if unknown:
        raise DeckError(place, f"element set {unknown[0]} of the step's *DLOAD is not defined")
    loaded = {number for name in sets for number in elements[name]}
    massive = {
        tuple(row) for p in model.parts if p.mass is not None for row in p.connectivity.tolist()
    }
    for number in set(model.mesh.place) - loaded:
        kind, row = model.mesh.place[number]
        if tuple(model.mesh.connectivity[kind][row].tolist()) in massive:
            raise DeckError(place, f"element {number} has mass, but is left out of the load {load}")
    if len(set(sets.values())) > 1:
        raise DeckError(place, f"the load {load} must be one for all elements of the tyre")
    return next(iter(sets.values()))
