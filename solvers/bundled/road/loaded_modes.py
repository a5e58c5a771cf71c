"""Modes of the pressed tyre: small vibrations about its deflected state, the patch held.

    K = tangent of the tyre + hold,   M = (N^T w N round the circumference) x (the section's mass)

Displacements are components in the frame of the reference angle, so the mass does not depend on
it. The pressed tyre keeps the half turn about the vertical, which every mode keeps or reverses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...errors import Indefinite, RunFailed
from ..modes.harmonics import HarmonicModes
from ..section.mechanics import mass
from ..section.model import Model
from ..section.symmetry import HALF_TURN
from ..solid3d.circumference import Circumference
from ..solid3d.revolved import Revolved
from . import davidson
from .block_cholesky import Elimination, Factor
from .contact import Contact
from .half_turn_symmetry import HalfTurn

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
    hold: Contact,
    unloaded: list[HarmonicModes],
    count: int,
    check: Callable[[], None],
) -> LoadedModes:
    """The ``count`` lowest modes about U (k, n, 3).

    pressed: what U keeps; hold: what holds the patch; unloaded: the inflated tyre's modes, to start
    from.
    Raises RunFailed; what ``check`` raises to stop.
    """
    tyre.residual(U)
    symmetries = [
        HalfTurn(tyre.model.mesh, pressed.free, pressed.around, parity) for parity in (1, -1)
    ]
    wanted = [count // 2 + SPARE] * 2
    kinds = [
        _one_parity(tyre, symmetry, hold, unloaded, wanted[0], check) for symmetry in symmetries
    ]
    while True:
        complete = min(values[-1] for values, _ in kinds)  # all below it have been found
        values = np.concatenate([each for each, _ in kinds])
        order = np.argsort(values, kind="stable")[:count]
        if values[order[-1]] <= complete:
            break
        short = int(np.argmin([each[-1] for each, _ in kinds]))
        wanted[short] += SPARE
        kinds[short] = _one_parity(tyre, symmetries[short], hold, unloaded, wanted[short], check)
    parity = np.repeat(
        [symmetry.parity for symmetry in symmetries], [len(each) for each, _ in kinds]
    )
    shapes = np.concatenate([each for _, each in kinds])
    return LoadedModes(values[order], parity[order], shapes[order])


def _one_parity(
    tyre: Revolved,
    symmetry: HalfTurn,
    hold: Contact,
    unloaded: list[HarmonicModes],
    count: int,
    check: Callable[[], None],
) -> tuple[Array, Array]:
    """omega^2 (count,) and shapes (count, k, n, 3) of the modes that keep or reverse the turn."""
    tangents = tyre.tangents(np.float32)
    shape = symmetry.mask.shape
    order = Elimination([t[0] for t in tangents], symmetry)
    check()
    try:
        factor = Factor(order, tangents, hold.stiffness(*symmetry.shape[:2], positive=True))
    except Indefinite:
        raise RunFailed("unstable", davidson.NOT_STABLE) from None
    del tangents
    weigh = Inertia(tyre.model, tyre.around)

    def each(image: Callable[[Array], Array]) -> davidson.Operator:
        def apply(block: Array) -> Array:
            check()
            fields = (symmetry.spread(parts) for parts in block.reshape(-1, *shape))
            return np.array([symmetry.gather(image(V)).ravel() for V in fields])

        return apply

    def inverse(block: Array) -> Array:
        return factor.solve(block.reshape(-1, *shape)).reshape(len(block), -1)

    waves = standing_waves(unloaded, symmetry)
    start = np.array([(symmetry.parts(V) * symmetry.mask).ravel() for V in waves])
    stiffness = each(lambda V: tyre.product(V) + hold.product(V))
    values, x = davidson.lowest(stiffness, each(weigh), inverse, start, count)
    shapes = [symmetry.spread(parts) for parts in x.reshape(-1, *shape)]
    return values, np.array(shapes) / np.sqrt(2)  # the half tyre has half of the modal mass


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
    """What the modes of the inflated tyre have of the fold's parity, fields (k, n, 3)."""
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
