"""Modes of the pressed tyre: small vibrations about its deflected state, the patch held.

    K = tangent of the tyre + hold,   M = (N^T w N round the circumference) x (the section's mass)

Displacements are components in the frame of the reference angle, so the mass does not depend on
it. The pressed tyre keeps the half turn about the vertical, which every mode keeps or reverses.
A wheel that is free along the load adds one unknown, its shift down, to modes that keep it.
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
from .contact_update import ContactUpdate
from .half_turn_symmetry import HalfTurn
from .multifrontal import Elimination, Factor

Array = np.ndarray
SPARE = 3  # modes of each kind beyond half of the wanted ones


@dataclass(frozen=True)
class LoadedModes:
    """Modes m, ascending; the whole tyre has modal mass 1."""

    eigenvalues: Array  # omega^2 (m,), 1/s2
    parity: Array  # (m,): 1 for modes that keep the half turn, -1 for those that it reverses
    shapes: Array  # (m, k, n, 3) on half the tyre


def loaded_modes(
    tyre: Revolved,
    pressed: HalfTurn,
    U: Array,
    holds: Sequence[csr_matrix],
    unloaded: list[HarmonicModes],
    count: int,
    check: Callable[[], None],
    wheel_kg: float | None = None,
) -> list[LoadedModes]:
    """The ``count`` lowest modes about U (k, n, 3) with each of ``holds`` (k n 3, k n 3), what
    holds the patch, N/m.

    pressed: what U keeps; unloaded: the inflated tyre's modes, to start from; wheel_kg: of a wheel
    that is free along the load, None: it is held. Raises RunFailed; what ``check`` raises to stop.
    """
    tyre.residual(U)

    def kind(parity: int, wanted: int) -> list[tuple[Array, Array]]:
        symmetry = HalfTurn(tyre.model.mesh, pressed.free, pressed.around, parity)
        its = _Kind(tyre, symmetry, holds[0], unloaded, wheel_kg if parity == 1 else None, check)
        return its.lowest(holds, wanted)

    wanted = {1: count // 2 + SPARE, -1: count // 2 + SPARE}
    kinds = {parity: kind(parity, number) for parity, number in wanted.items()}
    while (short := _short(kinds, count)) is not None:
        wanted[short] += SPARE
        kinds[short] = kind(short, wanted[short])
    result = []
    for keeping, reversing in zip(kinds[1], kinds[-1], strict=True):
        values = np.concatenate([keeping[0], reversing[0]])
        order = np.argsort(values, kind="stable")[:count]
        parity = np.repeat([1, -1], [len(keeping[0]), len(reversing[0])])
        shapes = np.concatenate([keeping[1], reversing[1]])
        result.append(LoadedModes(values[order], parity[order], shapes[order]))
    return result


def _short(kinds: dict[int, list[tuple[Array, Array]]], count: int) -> int | None:
    """The kind of which more must be known, for modes of its beyond the last may be among the
    ``count`` lowest of a hold; None where all are."""
    for keeping, reversing in zip(kinds[1], kinds[-1], strict=True):
        values = np.sort(np.concatenate([keeping[0], reversing[0]]))
        if values[count - 1] > min(keeping[0][-1], reversing[0][-1]):
            return 1 if keeping[0][-1] < reversing[0][-1] else -1
    return None


class _Kind:
    """Vibrations that keep the half turn, or are reversed by it, as vectors: the two parts, and
    where the wheel is free its shift."""

    def __init__(
        self,
        tyre: Revolved,
        symmetry: HalfTurn,
        hold: csr_matrix,
        unloaded: list[HarmonicModes],
        wheel_kg: float | None,
        check: Callable[[], None],
    ):
        self.tyre, self.symmetry, self.check = tyre, symmetry, check
        self.wheel_kg = wheel_kg
        tangents = tyre.tangents(np.float32)
        order = Elimination(tangents, symmetry)
        check()
        try:
            self.factor = ContactUpdate(Factor(order, tangents, self.symmetry.fold(hold)))
        except Indefinite:
            raise RunFailed("unstable", davidson.NOT_STABLE) from None
        self.start = [symmetry.parts(V) * symmetry.mask for V in standing_waves(unloaded, symmetry)]
        turn = symmetry.around.turn(1)[:, None]
        down = np.stack([turn.real, -turn.imag, 0 * turn.real], -1)
        self.down = down * ~symmetry.free  # the rim's nodes (k, n, 3), by 1 m

    def lowest(self, holds: Sequence[csr_matrix], count: int) -> list[tuple[Array, Array]]:
        """For each hold omega^2 (count,) and shapes (count, k, n, 3); each search starts from the
        result of the one before."""
        kg = self.wheel_kg or 0.0
        inertia = self._each(Inertia(self.tyre.model, self.symmetry.around), kg / 2)
        result: list[tuple[Array, Array]] = []
        basis = None
        for before, hold in pairwise([holds[0], *holds]):
            self.factor.to(self.symmetry.fold(hold))
            stiffness = self._each(partial(self._forces_of, hold), 0.0)
            inverse, start = self._inverse(hold)
            if basis is None:
                basis = davidson.basis_of(start, stiffness, inertia)
            else:
                images = self._each(partial(_times, hold - before), 0.0)(basis.vectors)
                basis = davidson.Basis(basis.vectors, basis.images + images)
            values, x, basis = davidson.lowest(stiffness, inertia, inverse, basis, count)
            # the half tyre has half of the modal mass
            result.append((values, np.array([self._field(row) for row in x]) / np.sqrt(2)))
        return result

    def _forces_of(self, hold: csr_matrix, V: Array) -> Array:
        """The tyre's and the hold's (k, n, 3), N/m."""
        return self.tyre.product(V) + _times(hold, V)

    def _field(self, vector: Array) -> Array:
        size = self.symmetry.mask.size
        field = self.symmetry.spread(vector[:size].reshape(self.symmetry.mask.shape))
        return field if self.wheel_kg is None else field + vector[size] * self.down

    def _forces(self, F: Array) -> Array:
        """The transpose of `_field`."""
        forces = self.symmetry.gather(F).ravel()
        return forces if self.wheel_kg is None else np.append(forces, (F * self.down).sum())

    def _each(self, image: Callable[[Array], Array], of_shift: float) -> davidson.Operator:
        """An operator on blocks from one on fields, and what the wheel's shift has by itself."""

        def apply(block: Array) -> Array:
            self.check()
            images = np.array([self._forces(image(self._field(x))) for x in block])
            if self.wheel_kg is not None:
                images[:, -1] += of_shift * block[:, -1]
            return images

        return apply

    def _inverse(self, hold: csr_matrix) -> tuple[davidson.Operator, Array]:
        """About K^-1, and vectors to start from."""
        shape = self.symmetry.mask.shape
        start = np.array([V.ravel() for V in self.start])

        def inner(block: Array) -> Array:
            return self.factor.solve(block.reshape(-1, *shape)).reshape(len(block), -1)

        if self.wheel_kg is None:
            return inner, start
        # the wheel eliminated last: what follows its shift, and the stiffness that is left
        border = self._forces(self._forces_of(hold, self.down))
        follows = inner(border[None, :-1])[0]
        left = border[-1] - border[:-1] @ follows

        def bordered(block: Array) -> Array:
            y = inner(block[:, :-1])
            shift = (block[:, -1] - block[:, :-1] @ follows) / left
            return np.column_stack([y - np.outer(shift, follows), shift])

        return bordered, np.vstack([np.pad(start, ((0, 0), (0, 1))), np.append(-follows, 1.0)])


def _times(hold: csr_matrix, V: Array) -> Array:
    """A hold's forces on the field V (k, n, 3), of its shape."""
    return (hold @ V.ravel()).reshape(V.shape)


class Inertia:
    """Mass times a field (k, n, 3) of half the tyre."""

    def __init__(self, model: Model, around: Circumference):
        self._around = around.N.T @ (around.weights[:, None] * around.N)
        self._section = mass(model)

    def __call__(self, V: Array) -> Array:
        k, n, _ = V.shape
        by_angle = (self._around @ V.reshape(k, -1)).reshape(k, n, 3)
        flat = by_angle.transpose(1, 0, 2).reshape(n, -1)
        return np.ascontiguousarray((self._section @ flat).reshape(n, k, 3).swapaxes(0, 1))


def standing_waves(unloaded: list[HarmonicModes], symmetry: HalfTurn) -> list[Array]:
    """Components of the inflated tyre's modes that have the fold's parity, fields (k, n, 3)."""
    waves = []
    for modes in unloaded:
        turn = symmetry.around.turn(modes.n)[:, None, None]
        for shape in modes.shapes:
            for phase in (1.0, 1j) if modes.n else (1.0,):
                ahead, behind = (phase * shape * turn).real, (phase * shape * turn.conj()).real
                image = np.empty_like(behind)
                image[:, symmetry.other] = HALF_TURN * behind
                wave = ahead + symmetry.parity * image
                if abs(wave).max() > 1e-6 * abs(ahead).max():
                    waves.append(wave)
    return waves
