"""A soft ring on a hub, pressed on the road: what holds it there, and its modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from tyrecal_solvers.bundled.modes.harmonics import HarmonicModes, Vibration
from tyrecal_solvers.bundled.road.contact_newton import PressedState
from tyrecal_solvers.bundled.road.loaded_modes import (
    LoadedModes,
    TyreOnRoad,
    hold_of_patch,
    loaded_modes,
)
from tyrecal_solvers.bundled.solid3d.circumference import HalfCircle

from . import support
from .contact import Round, ring

Array = np.ndarray
LENGTHS = np.radians([5.0] * 4 + [20.0] * 8)
ETA = 0.2  # loss factor


def soft_ring() -> Round:
    """A soft ring on a hub."""
    return ring((0.08, 0.09, 0.1), 0.02, 2, support.Rubber(C10=2e5, D1=2.5e-7, loss=ETA))


def harmonic(work: Round, n: int, count: int = 2) -> HarmonicModes:
    equations = support.numbering(work.model, ~work.free)
    return Vibration(work.model, work.U, work.loads, equations, 0.0).modes(n, count)


def start(work: Round) -> list[HarmonicModes]:
    return [harmonic(work, n, 4) for n in range(5)]


def modes(work: Round, U: Array, held: csr_matrix, around: HalfCircle, count: int) -> LoadedModes:
    (result,) = loaded_modes(pressed_tyre(work, U, around), [held], start(work), count)
    return result


def pressed_tyre(
    work: Round, U: Array, around: HalfCircle, check: Callable[[], None] = lambda: None
) -> TyreOnRoad:
    tyre = work.tyre(around)
    return TyreOnRoad(tyre, work.symmetry(around), U, tyre.residual(U), check)


def no_hold(work: Round, around: HalfCircle) -> csr_matrix:
    size = around.N.shape[1] * work.U.size
    return csr_matrix((size, size))


@dataclass
class State:
    """A pressed ring and what holds it."""

    around: HalfCircle
    U: Array
    pressed: PressedState
    hold: csr_matrix


def press(work: Round, load: float, friction: float = 0.5, stiffness: float = 1e9) -> State:
    stand = work.press(LENGTHS, stiffness, friction)
    state = stand.to(load)
    U = stand.symmetry.spread(state.parts)
    return State(stand.tyre.around, U, state, hold_of_patch(state.contact))


def shifted(work: Round, around: HalfCircle, component: int) -> Array:
    """The field (k, n, 3) of a unit shift of all down, along or across the road."""
    c, s = np.cos(around.angles)[:, None], np.sin(around.angles)[:, None]
    field = np.zeros((len(around.angles), len(work.U), 3))
    if component == 2:
        field[..., 2] = 1.0
    else:
        field[..., 0], field[..., 1] = ((c, -s), (s, c))[component]
    return field


def held(state: State, V: Array) -> Array:
    return np.asarray((state.hold @ V.ravel()).reshape(V.shape))
