"""The loads of a step on the model: pressure, and the forces of a tyre that turns.

The centrifugal force has the potential -Omega^2 M x^2 / 2, x being the place in the wheel's plane,
from the axle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...language.text import DeckError
from ..deck.steps import DeckStep
from .boundary import check_open_ends
from .model import Model
from .parts.part import IN_PLANE, AtStations, Tangents, TyrePart, of_each_component
from .parts.pressure import Pressure

Array = np.ndarray


@dataclass(frozen=True)
class Spin(TyrePart):
    """The force on the mass of one other part."""

    connectivity: Array  # (e, a)
    coupled_mass: Array  # (e, a, a): the other part's mass, kg per radian
    R: Array  # (e, a): radius of its nodes, m
    spin2: complex | float  # square of the spin about the axle, rad2/s2

    def _place(self, U: Array) -> Array:
        """Deformed position (e, a, 3) in the plane of the wheel."""
        x = U[self.connectivity] @ IN_PLANE + np.zeros(1, self.R.dtype)
        x[..., 0] += self.R
        return x

    def energy(self, U: Array) -> Any:
        x = self._place(U)
        return -self.spin2 * np.einsum("eai,eab,ebi->", x, self.coupled_mass, x) / 2

    def force(self, U: Array) -> Array:
        force = -self.spin2 * self.coupled_mass @ self._place(U)
        return np.asarray(force.reshape(len(force), -1))

    def tangents(self, U: Array, harmonics: bool) -> Tangents:
        return of_each_component(-self.spin2 * self.coupled_mass, IN_PLANE), None, None

    def at_stations(self, nodes: int) -> AtStations:
        raise NotImplementedError("a turning tyre is honoured off the road and all round alike")


def spinning(parts: list[TyrePart], X: Array, spin2: complex | float) -> list[Spin]:
    """The centrifugal forces of parts that have mass; X (n, 2): R, Z of all nodes."""
    massive = [(p.connectivity, p.mass) for p in parts if p.mass is not None]
    return [Spin(c, mass, X[c, 0], spin2) for c, mass in massive]


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
