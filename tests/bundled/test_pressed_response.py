"""Response of a pressed ring, its rim and patch held: the direct solution, reciprocity, what hub
and road bear, small matrices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from tyrecal_solvers.bundled.modes.response import TreadPatch
from tyrecal_solvers.bundled.road.loaded_modes import Inertia, forces_on, hold_of_patch
from tyrecal_solvers.bundled.road.pressed_response import PressedResponse
from tyrecal_solvers.bundled.road.rim_stiffness import MOTION_PARITY, rigid
from tyrecal_solvers.bundled.section.symmetry import HALF_TURN
from tyrecal_solvers.bundled.solid3d.circumference import half_circle
from tyrecal_solvers.bundled.solid3d.revolved import Revolved
from tyrecal_solvers.errors import Refused

from . import support
from .contact import Round, State, held, no_hold, pressed_tyre, ring, start
from .test_response import ETA, Solved, _combined, direct

pytestmark = [pytest.mark.numbers, pytest.mark.slow]
Array = np.ndarray
HIGHEST_HZ = 240.0
LENGTHS = np.radians([10.0, 10.0, 40.0, 40.0, 40.0, 40.0])
RADIAL, TANGENTIAL, LATERAL = range(3)
# above the road, on either side of the hub, across the angle 180, and where the road is
POINTS = [(1.0, RADIAL), (4.5, TANGENTIAL), (2.0, LATERAL), (np.pi, RADIAL), (0.1, LATERAL)]


@dataclass(frozen=True, eq=False)
class Pressed:
    """A ring with losses on the road, and its response."""

    ring: Round
    state: State
    tyre: Revolved
    patch: TreadPatch
    response: PressedResponse


@pytest.fixture(scope="module")
def pressed() -> Pressed:
    rubber = support.Rubber(C10=2e5, D1=2.5e-7, loss=ETA)
    work = ring((0.08, 0.1), 0.02, 2, rubber)
    return responding(work, on_road(work))


@pytest.fixture(scope="module")
def hertz() -> Array:
    return np.array([0.0, 60.0, 110.0, 170.0, HIGHEST_HZ])


def on_road(work: Round) -> State:
    """The ring on the road with 6 N."""
    stand = work.press(LENGTHS, 1e9, 0.5)
    state = stand.to(6.0)
    U = stand.symmetry.spread(state.parts)
    return State(stand.tyre.around, U, state, hold_of_patch(state.contact))


def responding(work: Round, state: State) -> Pressed:
    outer = np.flatnonzero(abs(work.model.mesh.X[:, 0] - 0.1) < 1e-9)
    patch = TreadPatch(0.03, 0.1, outer, np.full(len(outer), 1 / len(outer)))
    held = pressed_tyre(work, state.U, state.around)
    response = PressedResponse(held, state.hold, start(work), patch, POINTS * 2, HIGHEST_HZ)
    return Pressed(work, state, held.tyre, patch, response)


class Equations:
    """All equations of one parity, of the whole tyre: K, L of a loss factor of 1, M; motions of the
    points; forces on the rim and the road by shifts down, along and across that have the parity."""

    def __init__(self, pressed: Pressed, parity: int):
        tyre, state, work = pressed.tyre, pressed.state, pressed.ring
        lossy = Revolved(
            replace(work.model, parts=[p for k in (0, 1) for p in work.model.material_parts(0, k)]),
            [],
            state.around,
        )
        lossy.residual(state.U)
        symmetry = work.symmetry(state.around, parity)
        free = np.flatnonzero(symmetry.mask)
        fields = []
        for place in free:
            parts = np.zeros(symmetry.mask.size)
            parts[place] = 1.0
            fields.append(symmetry.spread(parts.reshape(symmetry.mask.shape)))
        self.points = np.array([at_points(pressed, V, parity) for V in fields])
        self.own = np.flatnonzero(parity == MOTION_PARITY[:3])
        shifts = [unit_shifts(pressed)[i] for i in self.own]
        on_road = [held(state, V) for V in shifts]
        self.on_road = 2 * np.array([[(V * F).sum() for F in on_road] for V in fields])
        stiffness = lambda V: forces_on(tyre, state.hold, V)
        self.matrices, self.on_rim = [], []
        for image in (stiffness, lossy.product, Inertia(work.model, state.around)):
            images = [image(V) for V in fields]
            self.matrices.append(2 * np.array([symmetry.gather(F).ravel()[free] for F in images]))
            rim = [V * ~work.free for V in shifts]
            self.on_rim.append(2 * np.array([[(V * F).sum() for V in rim] for F in images]))

    def solve(self, hertz: float, eta: float) -> tuple[Array, Array, Array]:
        """Motions of the points (p, p), forces on the rim and the road (own, p)."""
        at = np.array([1.0, 1j * eta, -((2 * np.pi * hertz) ** 2)])
        u = np.linalg.solve(np.tensordot(at, self.matrices, 1), self.points + 0j)
        return self.points.T @ u, -np.tensordot(at, self.on_rim, 1).T @ u, self.on_road.T @ u


def unit_shifts(pressed: Pressed) -> list[Array]:
    X = np.real(pressed.ring.model.mesh.X)
    return [rigid(X, pressed.state.around, axis, np.zeros((3, 3))) for axis in np.eye(3)]


@pytest.fixture(scope="module")
def equations(pressed: Pressed) -> list[Equations]:
    return [Equations(pressed, parity) for parity in (1, -1)]


def at_points(pressed: Pressed, V: Array, parity: int) -> Array:
    """Mean motions of the patches by a field of a parity, on the whole circle."""
    around, patch = pressed.state.around, pressed.patch
    other = pressed.ring.symmetry(around).other
    x, w = np.polynomial.legendre.leggauss(8)
    means = []
    for angle, way in POINTS:
        total = 0.0
        for place, weight in zip(angle + patch.half_angle * x, w / 2, strict=True):
            turn = place % (2 * np.pi)
            there = turn > np.pi
            at = around.at(np.array([2 * np.pi - turn if there else turn]))[0]
            values = np.einsum("k,kn->n", at, V[..., way])
            values = parity * HALF_TURN[way] * values[other] if there else values
            total += weight * float(patch.weights @ values[patch.nodes])
        means.append(total)
    return np.array(means)


def test_direct_solution(pressed: Pressed, equations: list[Equations], hertz: Array) -> None:
    """Motions and forces on the hub within 0.2 % of the largest; reciprocity to 1e-9."""
    result = pressed.response.result(hertz, len(POINTS), 0)
    moved, hub = np.moveaxis(result.receptance, -1, 0), np.moveaxis(result.hub, -1, 0)
    motion, on_rim = np.zeros_like(moved), np.zeros_like(hub[:, :3])
    for k, f in enumerate(hertz):
        for each in equations:
            own, forces, _ = each.solve(f, ETA)
            motion[k] += own
            on_rim[k, each.own] = forces
    assert np.abs(moved - motion).max() < 2e-3 * np.abs(motion).max()
    assert np.abs(hub[:, :3] - on_rim).max() < 2e-3 * np.abs(on_rim).max()
    np.testing.assert_allclose(moved, moved.swapaxes(1, 2), rtol=0, atol=1e-9 * abs(moved).max())
    assert (np.diagonal(moved, axis1=1, axis2=2).imag < 0).all()


def test_statically_hub_and_road_bear_what_is_applied(
    pressed: Pressed, equations: list[Equations]
) -> None:
    """Without losses, to 1e-9 of the force."""
    shifts = unit_shifts(pressed)
    borne, applied, bears = *np.zeros((2, 3, len(POINTS))), []
    for parity, each, part in zip((1, -1), equations, pressed.response.reduced, strict=True):
        _, hub = part.at(0.0, [0.0] * len(part.lossy))
        _, _, on_road = each.solve(0.0, 0.0)
        borne[each.own] = hub[: len(each.own), : len(POINTS)].real + on_road.real
        applied[each.own] = [at_points(pressed, shifts[i], parity) for i in each.own]
        bears.append(np.abs(on_road).max())
    np.testing.assert_allclose(borne, applied, rtol=0, atol=1e-9)
    assert max(bears) > 0.05  # the road


def test_small_matrices(pressed: Pressed, hertz: Array) -> None:
    """Their frequencies are the modes', their forces on the hub those of all, to 0.5 dB."""
    count = 36
    small = pressed.response.superelement(count, len(POINTS))
    assert len(small.mass) <= 6 + count
    own = np.linalg.eigvalsh(small.stiffness[6:, 6:])
    limit = (2 * np.pi * HIGHEST_HZ) ** 2
    b = [len(part.places) for part in pressed.response.reduced]
    modes = np.concatenate(
        [
            np.linalg.eigvalsh(part.stiffness[n:, n:])
            for n, part in zip(b, pressed.response.reduced, strict=True)
        ]
    )
    inside = modes[modes < limit]
    assert len(inside) > 4
    assert max(np.abs(own / value - 1).min() for value in inside) < 1e-9
    full = np.moveaxis(pressed.response.result(hertz, len(POINTS), 0).hub, -1, 0)
    for k, f in enumerate(hertz):
        Z = small.stiffness + 1j * small.loss - (2 * np.pi * f) ** 2 * small.mass
        q = np.linalg.solve(Z[6:, 6:], small.tread[:, 6:].T)
        hub = small.tread[:, :6].T - Z[:6, 6:] @ q
        large = np.abs(full[k]) > 1e-3 * np.abs(full).max((0, 2))[:, None]
        assert np.abs(20 * np.log10(np.abs(hub[large] / full[k][large]))).max() < 0.5
    with pytest.raises(Refused, match=r"matrices need at least \d+ coordinates of modes, got 2"):
        pressed.response.superelement(2, 0)


def test_without_a_road_the_hub_bears_what_the_harmonics_give() -> None:
    """Forces and moments on the hub as by the harmonics 0 and 1 of the unloaded tyre."""
    work = ring((0.08, 0.1), 0.02, 2, support.Rubber(C10=2e5, D1=2.5e-7, loss=ETA))
    around = half_circle(LENGTHS)
    hold = no_hold(work, around)
    free = State(around, work.everywhere(around), None, hold)  # type: ignore[arg-type]
    pressed = responding(work, free)
    solved = Solved(work.model, work.U, [], ~work.free, pressed.patch, None)  # type: ignore[arg-type]
    hertz = np.array([0.0, 60.0, 170.0])
    hub = pressed.response.result(hertz, len(POINTS), 0).hub
    X = np.real(work.model.mesh.X)
    r, t, z, one, o = X[:, 0], 0 * X[:, 0], X[:, 1], np.ones(len(X)), np.zeros(len(X))
    motions = [[[o, o, one], [-t, r, o]], [[one, 1j * one, o], [1j * z, -z, t - 1j * r]]]
    exact = np.zeros_like(hub)
    for k, f in enumerate(hertz):
        for n in (0, 1):
            _, reactions = direct(solved, n, f)
            for i, motion in enumerate(motions[n]):
                T = np.array(motion).T.ravel()
                on_hub = -(T.conj() @ reactions) * pressed.patch.share(n)
                for e, (angle, way) in enumerate(POINTS):
                    rows = [3 * i + 2] if n == 0 else [3 * i, 3 * i + 1]
                    for row, axis in zip(rows, (0.0, np.pi / 2), strict=False):
                        exact[row, e, k] = _combined(on_hub[:, way], n * (axis - angle))
    for rows in (slice(3), slice(3, 6)):
        assert np.abs(hub[rows] - exact[rows]).max() < 2e-3 * np.abs(exact[rows]).max()
