"""Small matrices of the inflated tyre on the motions of its rim and its modes with the rim held: a
fixed-interface reduction after Craig and Bampton.

    x = (rim, q),   u = T rim + V q,   M = [T^H M T  T^H M V]   K = [0    0   ]   u of a patch = R x
                                           [V^H M T     1   ]       [0  Lambda]

T: rigid motions of rim and tyre, which are the static shapes as K T = 0; V: modes of the reduced
problems of `response`, above the highest frequency what is left there of the static response. A
harmonic n >= 1 has two real coordinates for each mode, of cos and sin. ``loss`` is the imaginary
part of K. The rim's coordinates are motions along Theta = 0, along 90 degrees and along the axle,
and turns about them, at the middle of the wheel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .response import Response

Array = np.ndarray
MOVE_RIM_UP_TO = 4.0
RIM_AXES = 0.0, np.pi / 2  # angles of the axes across the axle
RIM_PLACES = {0: (2, 5), 1: (0, 3)}  # places of the first coordinate of each motion of a harmonic


@dataclass(frozen=True)
class Superelement:
    """Matrices (d, d), d coordinates, in N/m and kg, and motions (p, d) of p points of tread."""

    stiffness: Array
    mass: Array
    loss: Array
    tread: Array


def superelement(
    response: Response, count: int, points: Sequence[tuple[float, int]]
) -> Superelement:
    """Matrices with at most ``count`` coordinates of modes: the lowest, of the harmonics 0 and 1,
    which alone move the rim, up to `MOVE_RIM_UP_TO` times the frequency. points: angle (rad) and
    component of each."""
    blocks = [_Block(response, k, points) for k in range(len(response.harmonics))]
    lowest = sorted(
        (value / (1.0 if block.n > 1 else MOVE_RIM_UP_TO**2), block.n, k)
        for block in blocks
        for k, value in enumerate(block.eigenvalues)
    )
    kept: dict[int, list[int]] = {block.n: [] for block in blocks}
    left = count
    for _, n, k in lowest:
        left -= 2 if n else 1
        if left < 0:
            break
        kept[n].append(k)
    parts = [block.of(sorted(kept[block.n])) for block in blocks if kept[block.n]]
    size = 6 + sum(len(part.stiffness) for part in parts)
    K, M, loss = (np.zeros((size, size)) for _ in range(3))
    tread = np.zeros((len(points), size))
    first = 6
    for part in parts:
        own = slice(first, first + len(part.stiffness))
        K[own, own], loss[own, own] = part.stiffness, part.loss
        M[own, own] = np.eye(len(part.stiffness))
        M[:6, own], M[own, :6] = part.coupling, part.coupling.T
        tread[:, own] = part.tread
        first = own.stop
    for block in blocks[:2]:
        M[:6, :6] += block.rim_mass
        tread[:, :6] += block.rim_tread
    return Superelement(K, M, loss, tread)


@dataclass(frozen=True)
class _ModeMatrices:
    stiffness: Array
    loss: Array
    coupling: Array
    tread: Array


class _Block:
    """A harmonic in real coordinates."""

    def __init__(self, response: Response, k: int, points: Sequence[tuple[float, int]]):
        reduced = response.harmonics[k]
        self.n, self._circle = reduced.n, np.pi if reduced.n else 2 * np.pi
        stiffness, loss = response.at_middle(reduced)
        self.eigenvalues, turn = np.linalg.eigh(stiffness)
        self._loss = turn.conj().T @ loss @ turn
        self._moved, share = reduced.moved @ turn, response.patch.share(reduced.n)
        motion = reduced.forces.conj().T @ turn  # of the patch (3, m)
        self._tread = np.array(
            [share * np.exp(1j * self.n * angle) * motion[way] for angle, way in points]
        )
        # rim: amplitude exp(-i angle of the axis) of each motion, by its coordinates
        self._turns = np.zeros((6, len(reduced.moved)), complex)
        for motion_place, place in enumerate(RIM_PLACES.get(self.n, ())):
            for axis, angle in enumerate(RIM_AXES if self.n else RIM_AXES[:1]):
                self._turns[place + axis, motion_place] = np.exp(1j * angle)
        mass = self._turns @ reduced.rigid_mass @ self._turns.conj().T
        self.rim_mass = self._circle * mass.real
        rigid = [
            share * np.exp(-1j * self.n * angle) * reduced.rigid[:, way] for angle, way in points
        ]
        self.rim_tread = (np.array(rigid) @ self._turns.T).real

    def of(self, chosen: list[int]) -> _ModeMatrices:
        """Matrices of some of the modes, in coordinates of unit modal mass."""
        root, pick = np.sqrt(self._circle), np.ix_(chosen, chosen)
        loss, values = self._loss[pick], self.eigenvalues[chosen]
        coupling = root * self._turns @ self._moved[:, chosen]
        tread = self._tread[:, chosen] / root
        if not self.n:
            return _ModeMatrices(np.diag(values), loss.real, coupling.real, tread.real)
        real = np.block([[loss.real, -loss.imag], [loss.imag, loss.real]])
        return _ModeMatrices(np.diag(np.tile(values, 2)), real, _pair(coupling), _pair(tread))


def _pair(rows: Array) -> Array:
    """Re(rows (a + i b)) as a real matrix on (a, b)."""
    return np.hstack([rows.real, -rows.imag])
