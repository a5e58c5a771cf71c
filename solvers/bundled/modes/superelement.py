"""Small matrices of the inflated tyre on the motions of its rim and its modes with the rim held: a
fixed-interface reduction after Craig and Bampton.

    x = (rim, q),   u = T rim + V q,   M = [T^H M T  T^H M V]   K = [0    0   ]   u of a patch = R x
                                           [V^H M T     1   ]       [0  Lambda]

T: rigid motions of rim and tyre, which are the static shapes as K T = 0; V: modes of the reduced
problems of `response`, and of harmonics that move the rim also what holds the static response of
the modes that are left out; Lambda: their eigenvalues; R: ``tread``. A harmonic n >= 1 has two real
coordinates for each shape, of cos and sin. ``loss`` is the imaginary part of K. The rim's
coordinates are motions along Theta = 0, along 90 degrees and along the axle, and turns about them,
at the middle of the wheel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import Refused
from .response import Response

Array = np.ndarray
MOVE_RIM_UP_TO = 2.5  # times the highest frequency: modes that are kept of harmonics 0 and 1
ADDS_NOTHING = 1e-3  # singular value, over the largest, below which a static response adds nothing
RIM_AXES = 0.0, np.pi / 2  # angles of the axes across the axle
# places of the first coordinate of each motion of a harmonic: axial, spin; radial, tilt (`wheel`)
RIM_PLACES = {0: (2, 5), 1: (0, 3)}


@dataclass(frozen=True)
class Superelement:
    """Matrices (d, d), d coordinates: the rim's six, then modes; in N/m and kg, of turns N m and kg
    m2, of modes 1/s2 and 1. Motions (p, d) of p points of tread per unit of each coordinate."""

    stiffness: Array
    mass: Array
    loss: Array
    tread: Array


def superelement(
    response: Response, count: int, points: Sequence[tuple[float, int]]
) -> Superelement:
    """Matrices with at most ``count`` coordinates of modes: of the harmonics 0 and 1, which alone
    move the rim, up to `MOVE_RIM_UP_TO` times the highest frequency with the static response of the
    rest, then the lowest of the others. points: angle (rad) and component (0, 1, 2: r, theta, z) of
    each. Raises Refused if the rim needs more."""
    limit = (2 * np.pi * response.highest_Hz) ** 2
    blocks = [_Block(response, k, points) for k in range(len(response.harmonics))]  # 0, 1, ...
    parts = [block.with_static_shapes(limit) for block in blocks[:2]]
    left = count - sum(len(part.stiffness) for part in parts)
    if left < 0:
        raise Refused(f"matrices need at least {count - left} coordinates of modes, got {count}")
    values = [(value, block) for block in blocks[2:] for value in block.eigenvalues]
    lowest = sorted(values, key=lambda each: each[0])[: left // 2]
    for block in blocks[2:]:
        if kept := sum(each is block for _, each in lowest):
            shapes = np.eye(len(block.eigenvalues))[:, :kept]
            parts.append(block.of(block.eigenvalues[:kept], shapes))
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
    """A harmonic's blocks of the matrices, in c real coordinates of unit modal mass."""

    stiffness: Array  # Lambda (c, c), 1/s2
    loss: Array  # (c, c), 1/s2
    coupling: Array  # T^H M V (6, c)
    tread: Array  # motions (p, c) of the points of tread


class _Block:
    """The k-th of the response's harmonics in real coordinates; a field is Re[a exp(i n Theta)],
    with an amplitude a."""

    def __init__(self, response: Response, k: int, points: Sequence[tuple[float, int]]):
        reduced = response.harmonics[k]
        # the integral of cos^2 n Theta round the tyre: matrices of `reduced` are per radian
        self.n, self._circle = reduced.n, np.pi if reduced.n else 2 * np.pi
        stiffness, loss = response.at_middle(reduced)  # of the band of frequencies
        self.eigenvalues, turn = np.linalg.eigh(stiffness)
        self._loss = turn.conj().T @ loss @ turn
        # share: the mean of cos n Theta over a patch about Theta = 0
        self._moved, share = reduced.moved @ turn, response.patch.share(reduced.n)
        self._motion = reduced.forces.conj().T @ turn  # of the patch per mode (3, m), m modes
        self._tread = np.array(
            [share * np.exp(1j * self.n * angle) * self._motion[way] for angle, way in points]
        )
        # the rim's motion along an axis has the amplitude exp(-i angle); here its conjugate
        self._turns = np.zeros((6, len(reduced.moved)), complex)  # by axis and motion
        for motion_place, place in enumerate(RIM_PLACES.get(self.n, ())):
            for axis, angle in enumerate(RIM_AXES if self.n else RIM_AXES[:1]):
                self._turns[place + axis, motion_place] = np.exp(1j * angle)
        mass = self._turns @ reduced.rigid_mass @ self._turns.conj().T
        self.rim_mass = self._circle * mass.real
        rigid = [
            share * np.exp(-1j * self.n * angle) * reduced.rigid[:, way] for angle, way in points
        ]
        self.rim_tread = (np.array(rigid) @ self._turns.T).real

    def of(self, values: Array, shapes: Array) -> _ModeMatrices:
        """Matrices of shapes (m, s), s shapes of unit modal mass, and their eigenvalues (s,)."""
        loss = shapes.conj().T @ self._loss @ shapes
        root = np.sqrt(self._circle)
        coupling, tread = root * self._turns @ self._moved @ shapes, self._tread @ shapes / root
        if not self.n:
            return _ModeMatrices(np.diag(values), loss.real, coupling.real, tread.real)
        real = np.block([[loss.real, -loss.imag], [loss.imag, loss.real]])
        return _ModeMatrices(np.diag(np.tile(values, 2)), real, _pair(coupling), _pair(tread))

    def with_static_shapes(self, limit: float) -> _ModeMatrices:
        """Matrices of the modes up to `MOVE_RIM_UP_TO` times the frequency of an eigenvalue, and of
        what holds the static response of the rest to forces on the patch and to losses of the modes
        up to ``limit``."""
        every = self.eigenvalues
        chosen, rest = np.split(np.arange(len(every)), [(every < MOVE_RIM_UP_TO**2 * limit).sum()])
        shapes = np.eye(len(every), dtype=complex)[:, chosen]
        if not len(rest):
            return self.of(every, shapes)
        band = np.flatnonzero(every < limit)
        forces = np.hstack([self._motion[:, rest].conj().T, self._loss[np.ix_(rest, band)]])
        static = forces / every[rest, None]
        size = np.linalg.norm(static, axis=0)
        basis, singular, _ = np.linalg.svd(static[:, size > 0] / size[size > 0], False)
        basis = basis[:, singular > ADDS_NOTHING * singular.max(initial=0.0)]
        own, turn = np.linalg.eigh(basis.conj().T @ (every[rest, None] * basis))
        more = np.zeros((len(every), len(own)), complex)
        more[rest] = basis @ turn
        return self.of(np.concatenate([every[chosen], own]), np.hstack([shapes, more]))


def _pair(rows: Array) -> Array:
    """Re(rows (a + i b)) as a real matrix on (a, b)."""
    return np.hstack([rows.real, -rows.imag])
