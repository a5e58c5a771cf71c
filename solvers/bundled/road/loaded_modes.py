"""Modes of the pressed tyre: small vibrations about its deflected state, with the patch held.

    K = tangent of the tyre + hold,   M = kron(N^T w N, M_section)

hold: `hold_of_patch`; N (s, k) and w (s,), rad: functions of the angle, weights at Gauss stations
(`Circumference`); M_section: mass per radian. Fields (k, n, 3) have k functions of the angle, n
nodes of the section and the components r, theta, z in the frame of the reference angle, so the mass
does not depend on the angle. ``around.turn(j)`` is exp(i j theta) in these functions, (k,).

The pressed tyre is unchanged by a half turn about the vertical. So each mode is unchanged (parity
1) or changes its sign (parity -1), and the two kinds are computed apart (`HalfTurn`, which states
its masks and images of nodes). A wheel that is free along the load adds one unknown, its shift down
(to theta = 0), to modes of parity 1.

As ABAQUS in a *FREQUENCY step, contact neither opens nor closes, and where there is friction
nothing slides. The contact's own stiffness holds every point of the patch, along the normal and
along the road,

    K = int k diag(1, t, t) dA,   t = 1 with friction, 0 without

so the hold grows steadily with the load, from nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_matrix

from ...errors import Indefinite, RunFailed
from ..modes.harmonics import HarmonicModes
from ..section.mechanics import mass
from ..section.model import Model
from ..section.symmetry import HALF_TURN
from ..solid3d.circumference import Circumference
from ..solid3d.revolved import Revolved
from . import davidson
from .contact import Contact
from .contact_update import ContactUpdate
from .half_turn_symmetry import HalfTurn
from .multifrontal import Elimination, Factor

Array = np.ndarray
SPARE = 3  # modes of each parity in addition to half of the requested number


@dataclass(frozen=True)
class TyreOnRoad:
    """A tyre in the state that the road pressed it to, about which it is linear."""

    tyre: Revolved
    symmetry: HalfTurn  # of the state
    U: Array  # (k, n, 3), m
    forces: Array  # (k, n, 3), N, that hold it there
    check: Callable[[], None]  # raises to stop


@dataclass(frozen=True)
class LoadedModes:
    """The m lowest modes, ascending; the modal mass of the whole tyre is 1."""

    eigenvalues: Array  # omega^2 (m,), 1/s2
    parity: Array  # (m,): 1 if the half turn leaves a mode as it is, -1 if it changes its sign
    shapes: Array  # (m, k, n, 3) fields on half the circumference


def loaded_modes(
    pressed: TyreOnRoad,
    holds: Sequence[csr_matrix],
    unloaded: list[HarmonicModes],
    count: int,
    wheel_kg: float | None = None,
    release_factor: Callable[[], ContactUpdate | None] = lambda: None,
) -> list[LoadedModes]:
    """The ``count`` lowest modes for each stiffness of ``holds`` (k n 3, k n 3), N/m, which holds
    the patch.

    unloaded: modes of the inflated tyre, to start from; wheel_kg: mass of a wheel that is free
    along the load, None: it is held; release_factor: gives away a factor of the stiffness near U on
    fields of parity 1, None: one is formed. Raises RunFailed, and what ``check`` raises to stop.
    """
    tyre, check = pressed.tyre, pressed.check
    tyre.residual(pressed.U)  # sets the state of the tangents

    def lowest(parity: int, wanted: int) -> list[tuple[Array, Array]]:
        symmetry = pressed.symmetry.of_parity(parity)
        own_kg = wheel_kg if parity == 1 else None
        # the factor goes with the search, so that one at a time is in memory
        factor = release_factor() if parity == 1 else None
        search = _Vibrations(tyre, symmetry, holds[0], unloaded, own_kg, check, factor)
        return search.lowest(holds, wanted)

    wanted = {1: count // 2 + SPARE, -1: count // 2 + SPARE}
    by_parity = {parity: lowest(parity, number) for parity, number in wanted.items()}
    while (short := _parity_with_too_few(by_parity, count)) is not None:
        wanted[short] += SPARE
        by_parity[short] = lowest(short, wanted[short])
    result = []
    for keeping, reversing in zip(by_parity[1], by_parity[-1], strict=True):
        values = np.concatenate([keeping[0], reversing[0]])
        order = np.argsort(values, kind="stable")[:count]
        parity = np.repeat([1, -1], [len(keeping[0]), len(reversing[0])])
        shapes = np.concatenate([keeping[1], reversing[1]])
        result.append(LoadedModes(values[order], parity[order], shapes[order]))
    return result


def _parity_with_too_few(by_parity: dict[int, list[tuple[Array, Array]]], count: int) -> int | None:
    """The parity of which more modes are needed, because its next mode may be among the ``count``
    lowest of both for some hold; None if there are enough."""
    for keeping, reversing in zip(by_parity[1], by_parity[-1], strict=True):
        values = np.sort(np.concatenate([keeping[0], reversing[0]]))
        if values[count - 1] > min(keeping[0][-1], reversing[0][-1]):
            return 1 if keeping[0][-1] < reversing[0][-1] else -1
    return None


class _Vibrations:
    """Vibrations of one parity. A vector has the two parts of a field (`HalfTurn`), flattened, and
    last, if the wheel is free, its shift down, m."""

    def __init__(
        self,
        tyre: Revolved,
        symmetry: HalfTurn,
        hold: csr_matrix,
        unloaded: list[HarmonicModes],
        wheel_kg: float | None,
        check: Callable[[], None],
        factor: ContactUpdate | None,
    ):
        self.tyre, self.symmetry, self.check = tyre, symmetry, check
        self.wheel_kg = wheel_kg
        self.factor = factor or factor_with_hold(tyre, symmetry, hold, check)
        self.start = [symmetry.parts(V) * symmetry.mask for V in standing_waves(unloaded, symmetry)]
        turn = symmetry.around.turn(1)[:, None]
        down = np.stack([turn.real, -turn.imag, 0 * turn.real], -1)
        self.down = down * ~symmetry.free  # the rim's nodes (k, n, 3), by 1 m

    def lowest(self, holds: Sequence[csr_matrix], count: int) -> list[tuple[Array, Array]]:
        """For each hold omega^2 (count,) and shapes (count, k, n, 3). Each search starts from the
        basis of the one before."""
        kg = self.wheel_kg or 0.0
        mass = Inertia(self.tyre.model, self.symmetry.around)
        inertia = self._operator(mass, kg / 2)  # half the tyre carries half the wheel
        result: list[tuple[Array, Array]] = []
        basis = None
        for before, hold in pairwise([holds[0], *holds]):
            self.factor.to(self.symmetry.fold(hold))
            stiffness = self._operator(partial(forces_on, self.tyre, hold), 0.0)
            inverse, start = self._inverse(hold)
            if basis is None:
                basis = davidson.basis_of(start, stiffness, inertia)
            else:  # the images K x of the basis change by the change of the hold
                change = self._operator(partial(_times, hold - before), 0.0)
                basis.images[:] += change(basis.vectors)
            values, x = davidson.lowest(stiffness, inertia, inverse, basis, count)
            # the half tyre has half of the modal mass
            result.append((values, np.array([self._field(row) for row in x]) / np.sqrt(2)))
        return result

    def _field(self, vector: Array) -> Array:
        """The field (k, n, 3) of a vector."""
        size = self.symmetry.mask.size
        field = self.symmetry.spread(vector[:size].reshape(self.symmetry.mask.shape))
        return field if self.wheel_kg is None else field + vector[size] * self.down

    def _forces(self, F: Array) -> Array:
        """The vector of nodal forces F (k, n, 3): the transpose of `_field`."""
        forces = self.symmetry.gather(F).ravel()
        return forces if self.wheel_kg is None else np.append(forces, (F * self.down).sum())

    def _operator(self, image: Callable[[Array], Array], of_shift: float) -> davidson.Operator:
        """An operator on blocks (b, size) of vectors from one on fields. of_shift: its diagonal
        entry for the wheel's shift that fields do not have."""

        def apply(block: Array) -> Array:
            self.check()
            images = np.array([self._forces(image(self._field(x))) for x in block])
            if self.wheel_kg is not None:
                images[:, -1] += of_shift * block[:, -1]
            return images

        return apply

    def _inverse(self, hold: csr_matrix) -> tuple[davidson.Operator, Array]:
        """An approximate K^-1 (`ContactUpdate`), and vectors to start from."""
        shape = self.symmetry.mask.shape
        start = np.array([V.ravel() for V in self.start])

        def inner(block: Array) -> Array:
            return self.factor.solve(block.reshape(-1, *shape)).reshape(len(block), -1)

        if self.wheel_kg is None:
            return inner, start
        # the wheel is eliminated last: the tyre's vector per unit of its shift is -follows, and
        # ``left`` is the Schur complement, the stiffness of the wheel on the tyre
        border = self._forces(forces_on(self.tyre, hold, self.down))
        follows = inner(border[None, :-1])[0]
        left = border[-1] - border[:-1] @ follows

        def bordered(block: Array) -> Array:
            y = inner(block[:, :-1])
            shift = (block[:, -1] - block[:, :-1] @ follows) / left
            return np.column_stack([y - np.outer(shift, follows), shift])

        return bordered, np.vstack([np.pad(start, ((0, 0), (0, 1))), np.append(-follows, 1.0)])


def factor_with_hold(
    tyre: Revolved, symmetry: HalfTurn, hold: csr_matrix, check: Callable[[], None]
) -> ContactUpdate:
    """The factor of the tyre's tangent with a hold, on the fields of a symmetry. Raises RunFailed
    where the tyre is not stable, and what ``check`` raises to stop."""
    tangents = tyre.tangents(np.float32)
    order = Elimination(tangents, symmetry)
    check()
    try:
        return ContactUpdate(Factor(order, tangents, symmetry.fold(hold)))
    except Indefinite:
        raise RunFailed("unstable", davidson.NOT_STABLE) from None


def forces_on(tyre: Revolved, hold: csr_matrix, V: Array) -> Array:
    """Forces (k, n, 3) of the tyre's tangent and the hold on the field V, N for V in m."""
    return tyre.product(V) + _times(hold, V)


def _times(hold: csr_matrix, V: Array) -> Array:
    """Forces (k, n, 3) of a hold on the field V (k, n, 3)."""
    return (hold @ V.ravel()).reshape(V.shape)


class Inertia:
    """Operator: mass of half the tyre times a field (k, n, 3)."""

    def __init__(self, model: Model, around: Circumference):
        self._around = around.N.T @ (around.weights[:, None] * around.N)
        self._section = mass(model)

    def __call__(self, V: Array) -> Array:
        k, n, _ = V.shape
        by_angle = (self._around @ V.reshape(k, -1)).reshape(k, n, 3)
        flat = by_angle.transpose(1, 0, 2).reshape(n, -1)
        return np.ascontiguousarray((self._section @ flat).reshape(n, k, 3).swapaxes(0, 1))


def standing_waves(unloaded: list[HarmonicModes], symmetry: HalfTurn) -> list[Array]:
    """Standing waves of the inflated tyre's modes with the parity of ``symmetry``, (k, n, 3)."""
    waves = []
    for modes in unloaded:
        turn = symmetry.around.turn(modes.n)[:, None, None]
        for shape in modes.shapes:
            for phase in (1.0, 1j) if modes.n else (1.0,):
                # at theta and at -theta
                ahead, behind = (phase * shape * turn).real, (phase * shape * turn.conj()).real
                image = np.empty_like(behind)
                image[:, symmetry.other] = HALF_TURN * behind
                wave = ahead + symmetry.parity * image
                if abs(wave).max() > 1e-6 * abs(ahead).max():
                    waves.append(wave)
    return waves


def hold_of_patch(contact: Contact) -> csr_matrix:
    """The stiffness of fields (k n 3, k n 3) that holds the patch, N/m."""
    road, points = contact.road, contact.points
    kinds = np.diag([1.0, 1.0, 1.0] if road.friction > 0 else [1.0, 0.0, 0.0])
    return points.matrix(road.stiffness * points.area[..., None, None] * kinds)
