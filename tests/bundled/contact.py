"""Rings and tyres round half the circumference, for the tests of the tyre on the road.

A soft ring on a hub, pressed on the road: what holds it there, and its modes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix
from tyrecal_solvers.bundled.modes.harmonics import HarmonicModes, Vibration
from tyrecal_solvers.bundled.road.contact import FlatRoad, flat_road
from tyrecal_solvers.bundled.road.contact_newton import ContactNewton, PressedState
from tyrecal_solvers.bundled.road.half_turn_symmetry import HalfTurn
from tyrecal_solvers.bundled.road.loaded_modes import (
    LoadedModes,
    TyreOnRoad,
    hold_of_patch,
    loaded_modes,
)
from tyrecal_solvers.bundled.road.tread import tread_of
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure
from tyrecal_solvers.bundled.solid3d.circumference import HalfCircle, half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import RunFailed

from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from . import support
from .support import Rubber

Array = np.ndarray


ANGLES = [4.0, 4.0, 4.0, 5.0, 8.0, 15.0, 40.0, 100.0]  # degrees, half the tyre


@dataclass(frozen=True)
class Round:
    """A section with the surface TREAD, its loads and inflated state U (n, 3); free (n, 3)."""

    model: Model
    free: Array
    loads: list[Pressure]
    U: Array

    def tyre(self, around: HalfCircle) -> Revolved:
        return Revolved(self.model, self.loads, around)

    def symmetry(self, around: HalfCircle, parity: int = 1) -> HalfTurn:
        return HalfTurn(self.model.mesh, self.free, around, parity)

    def road(
        self, around: HalfCircle, stiffness: float, friction: float = 0.0, slip: float = 1e-5
    ) -> FlatRoad:
        mesh = self.model.mesh
        tread = tread_of(mesh.X, mesh.faces["TREAD"].connectivity, around)
        return flat_road(mesh.X, tread, stiffness, friction, slip, self.everywhere(around))

    def everywhere(self, around: HalfCircle) -> Array:
        """The inflated state all round (k, n, 3)."""
        return np.multiply.outer(around.turn(0).real, self.U)

    def press(
        self,
        lengths: Array,
        stiffness: float,
        friction: float = 0.0,
        slip: float = 1e-5,
        check: Callable[[], None] = lambda: None,
    ) -> ContactNewton:
        around = half_circle(lengths)
        road = self.road(around, stiffness, friction, slip)
        return ContactNewton(
            self.tyre(around), self.symmetry(around), road, self.everywhere(around), check
        )


def ring(
    radii: Array | Sequence[float],
    half_width: float,
    columns: int,
    rubber: Rubber,
    pressure: float = 0.0,
    plane: bool = False,
    quadratic: bool = True,
) -> Round:
    """A rubber ring on a rigid hub, elements between ``radii`` and of ``columns`` (even) across;
    ``plane``: no displacement along the axle."""
    across = np.linspace(-half_width, half_width, columns + 1)
    return _round(radii, across, rubber, pressure, plane, quadratic, lambda r, z: (r, z))


def ball(
    radii: Array | Sequence[float], latitudes: Array | Sequence[float], rubber: Rubber
) -> Round:
    """A rubber ball about a point of the axle, on a rigid core; latitudes (rad) >= 0."""
    across = np.concatenate([-np.asarray(latitudes)[:0:-1], latitudes])
    polar = lambda r, angle: (r * np.cos(angle), r * np.sin(angle))
    return _round(radii, across, rubber, 0.0, False, True, polar)


def _round(
    radii: Array | Sequence[float],
    across: Array,
    rubber: Rubber,
    pressure: float,
    plane: bool,
    quadratic: bool,
    place: Callable[[Array, Array], tuple[Array, Array]],
) -> Round:
    rows, columns = len(radii) - 1, len(across) - 1
    b = support.block((0.0, rows, rows), (0.0, columns, columns), quadratic)
    first = np.interp(b.X[:, 0], np.arange(rows + 1), radii)
    second = np.interp(b.X[:, 1], np.arange(columns + 1), across)
    X = np.stack(place(first, second), -1)
    text = support.deck(X, b.solids, rubber, (), b.inner)
    outer = [len(b.solids) - columns + i + 1 for i in range(columns)]
    m = support.model_of(with_tread(text, outer))
    held = support.held(m, list(np.flatnonzero(b.where(0, 0.0))), plane)
    loads = support.cavity(m, pressure) if pressure else []
    U = support.inflate(m, held, loads) if pressure else np.zeros((len(X), 3))
    return Round(m, ~held, loads, U)


def with_tread(text: str, elements: Sequence[int], face: str = "S2") -> str:
    return text + "\n".join(["*SURFACE, NAME=TREAD", *(f"{e}, {face}" for e in elements), ""])


def graded(first: float, ratio: float, total: float, largest: float = np.inf) -> Array:
    """Lengths from ``first`` on, each ``ratio`` times the one before, that fill ``total``."""
    lengths = [first]
    while sum(lengths) < total:
        lengths.append(min(lengths[-1] * ratio, largest))
    excess = sum(lengths) - total
    shares = np.array(lengths) - first  # the first ones keep theirs
    return np.array(lengths) - excess * shares / shares.sum()


def coarse_case(**road: object) -> LoadedCase:
    """The main case on a coarse mesh and few elements round the tyre."""
    loaded = load_case(CASES / "p235_75r17.yaml")
    case = loaded.case
    level = case.mesh.levels["default"].model_copy(
        update={
            "elements": {"crown": 3, "upper_sidewall": 2, "lower_sidewall": 2, "bead": 1},
            "rows": [1, 1, 1, 1],
            "grading": None,
        }
    )
    return replace(
        loaded,
        case=case.model_copy(
            update={
                "mesh": case.mesh.model_copy(update={"levels": {"default": level}}),
                "road": case.road.model_copy(update={"element_angles_deg": ANGLES, **road}),
            }
        ),
    )


class Late:
    """A clock that stops the work at the n-th look."""

    def __init__(self, looks: int):
        self.left = looks

    def __call__(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise RunFailed("timed_out", "the time limit passed")


GRADED = np.radians([3.0] * 6 + [12.0, 30.0, 60.0, 60.0])  # elements of the solid ring


def solid_ring() -> Round:
    """A rubber ring on a hub."""
    return ring((0.05, 0.08, 0.1), 0.02, 2, support.Rubber())


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
