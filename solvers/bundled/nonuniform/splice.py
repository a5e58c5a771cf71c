"""A tyre with one sector of another material: a splice.

The section's constants at the angle Theta are C + chi(Theta) (C' - C), chi = 1 in the sector, 0
elsewhere, by its Fourier series up to twice the highest harmonic N of the displacements, which is
all that products of two of them see. On 2 N + 1 nodes round the tyre displacements are exact
trigonometric polynomials, and sums over the stations exact integrals.

A tyre that is its own half turn about the vertical (`symmetry`) remains so with the sector about
Theta = 0: fields that half a turn keeps and those that it reverses,

    u(Theta, z) = +- S u(-Theta, -z),    S = diag(1, -1, -1),

one of each doublet in either, vibrate apart, and the elements of z >= 0 tell all of them.

The state under pressure is found again, because a stiffer sector also takes up other forces; then
Ritz's method on the axisymmetric tyre's modes and on the responses K^-1 r to what is left of each,
r = (K~ - lambda M~) u, K~ and M~ with the sector, K axisymmetric, per harmonic (Davidson, J. Comp.
Physics 17, 1975).
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...errors import Inverted
from ..modes.harmonics import HarmonicModes, Vibration
from ..section.inflation import stopped
from ..section.mechanics import mass
from ..section.model import Model
from ..section.parts.elastic import Elastic
from ..section.parts.part import TyrePart
from ..section.symmetry import HALF_TURN, MirrorHalf, Whole
from ..solid3d.circumference import Circumference
from ..solid3d.gmres import gmres
from ..solid3d.revolved import Revolved
from .coupled import split, tell

Array = np.ndarray
# harmonics beyond the highest wanted whose modes may lie close to wanted ones
SPARE_START_HARMONICS = 2
EXTRA_SHAPE_HARMONICS = 6  # harmonics of the displacements beyond the highest wanted
SPLICE_FORCE_RTOL = 1e-9  # out-of-balance force over the rim's
MAX_SPLICE_ITERATIONS = 20  # of Newton's method, and of the linear solver in each
SPLICE_LINEAR_RTOL = 1e-4  # of each step of Newton's method
MIN_GRAM = 1e-11  # of the basis' Gram matrix
RESPONSE_ROUNDS = 2  # of responses
SPARE_MODES_KEPT = 2  # modes beyond those wanted that responses are added for
NEGLIGIBLE_PART = 1e-8  # square of a field's part that half a turn keeps, over the field's


@dataclass(frozen=True)
class SpliceSector:
    """A sector about Theta = 0."""

    width: float  # rad
    model: Model  # the section as it is there

    def share(self, angles: Array, highest: int) -> Array:
        """chi at angles (k,), harmonics up to ``highest``."""
        h = np.arange(1, highest + 1)
        wave = 2 * np.sin(h * self.width / 2) / (np.pi * h)
        return self.width / (2 * np.pi) + np.cos(np.outer(angles, h)) @ wave


def full_circle(highest: int) -> Circumference:
    """Trigonometric polynomials up to a harmonic by their values at 2 N + 1 angles."""
    k, s = 2 * highest + 1, 4 * highest + 1
    angles, stations = _angles(k), _angles(s)
    away = stations[:, None] - angles
    n = np.arange(1, highest + 1)
    N = (1 + 2 * np.cos(away[..., None] * n).sum(-1)) / k
    slope = -2 * (n * np.sin(away[..., None] * n)).sum(-1) / k
    weights = np.full(s, 2 * np.pi / s)
    return Circumference(angles, N, slope, weights)


def blended(model: Model, other: Model, share: Array) -> Model:
    """``model`` with constants per Gauss point and station (p, s): ``share`` (s,) of ``other``."""
    parts: list[TyrePart] = []
    for part, its in zip(model.parts, other.parts, strict=True):
        assert isinstance(part, Elastic) and isinstance(its, Elastic)
        parts.append(replace(part, law=part.law.blended(its.law, share)))
    return replace(model, parts=parts)


class FullCircle:
    """Fields (k, nodes, 3) by their values round the tyre; ``free`` (nodes, 3).

    turn: 1 of those that half a turn keeps, -1 of those that it reverses; 0: of all, where it does
    not keep the tyre.
    """

    def __init__(self, vibration: Vibration, tyre: Revolved, sector: SpliceSector, highest: int):
        symmetry: Whole = tyre.model.mesh.symmetry
        self._other = symmetry.other if isinstance(symmetry, MirrorHalf) else None
        self.turn = 0.0 if self._other is None else 1.0
        self.vibration, self.tyre, self.highest = vibration, tyre, highest
        self.factors = [vibration.factor(n) for n in range(highest + 1)]
        self.free = vibration.numbering.free
        around = tyre.around
        share = sector.share(_angles(len(around.weights)), 2 * highest)
        # int N^T N chi dTheta (k, k), rad, of the functions N round the tyre
        self._waves = around.N.T @ ((around.weights * share)[:, None] * around.N)
        self._each = 2 * np.pi / len(around.angles)  # rad; int N^T N dTheta is this times 1
        self._more = mass(sector.model) - vibration.mass  # of the sector, per radian

    def turning(self, turn: float) -> FullCircle:
        """A copy for the fields that half a turn multiplies by ``turn``."""
        other = copy.copy(self)
        other.turn = turn
        return other

    def turned(self, field: Array) -> Array:
        """S u(-Theta, -z)."""
        back = np.roll(field[::-1], 1, axis=0)
        return np.asarray(back[:, self._other] * HALF_TURN)

    def part(self, field: Array) -> Array:
        """Projection of a field (k, nodes, 3) on the fields of this symmetry."""
        return (field + self.turn * self.turned(field)) / 2 if self.turn else field

    def whole(self, sums: Array) -> Array:
        """Forces (k, nodes, 3) of all elements from those of the elements that are there."""
        return sums + self.turn * self.turned(sums) if self.turn else sums

    def field(self, n: int, shape: Array) -> Array:
        """Re[shape exp(i n Theta)] (k, nodes, 3) of a shape (nodes, 3)."""
        turned = np.exp(1j * n * self.tyre.around.angles)[:, None, None] * shape
        return np.asarray(turned.real)

    def wave(self, field: Array, n: int) -> Array:
        """The amplitude (nodes, 3) of harmonic n in a field."""
        return np.asarray(np.fft.rfft(field, axis=0)[n] / len(field) * (2 if n else 1))

    def forces(self, field: Array) -> Array:
        """K~ u (k, nodes, 3), N, of a field u."""
        return self.whole(self.tyre.product(field)) * self.free

    def out_of_balance(self, state: Array) -> Array:
        """Forces (k, nodes, 3) inside the tyre less the pressure's, N, those at the rim among them.
        Raises Inverted."""
        return self.whole(self.tyre.residual(state))

    def inertia(self, field: Array) -> Array:
        """M~ u (k, nodes, 3), kg m, of a field u."""
        flat = field.swapaxes(0, 1).reshape(self.free.shape[0], -1)
        shape = self.free.shape[0], len(field), 3
        image = (self._each * (self.vibration.mass @ flat)).reshape(shape)
        if self._more.count_nonzero():
            image = image + np.einsum(
                "kj,njc->nkc", self._waves, (self._more @ flat).reshape(shape)
            )
        return self.whole(image.swapaxes(0, 1)) * self.free

    def response(self, force: Array) -> Array:
        """K^-1 of the plain tyre times forces (k, nodes, 3), N, in m, harmonic by harmonic. Waves
        of a field that half a turn reverses are those of a kept one times -i."""
        numbering, phase = self.vibration.numbering, 1j if self.turn < 0 else 1.0
        waves = np.fft.rfft(force, axis=0) * len(force) / (2 * np.pi) * phase  # N per radian
        for n, factor in enumerate(self.factors):
            right = numbering.gather(waves[n])
            waves[n] = numbering.spread(factor.solve(right if n else right.real))
        return np.fft.irfft(waves / phase, len(force), axis=0)


def _angles(k: int) -> Array:
    return 2 * np.pi * np.arange(k) / k


def sector_modes(
    vibration: Vibration,
    U: Array,
    loads: Sequence[TyrePart],
    model: Model,
    sector: SpliceSector,
    harmonics: list[int],
    count: int,
    check: Callable[[], None] = lambda: None,
    beyond: int = EXTRA_SHAPE_HARMONICS,
) -> list[HarmonicModes]:
    """The ``count`` lowest modes of each harmonic of a tyre with a sector of another material.

    U: the plain tyre's state under ``loads``; model: the plain one; ``beyond``: harmonics of the
    displacements above the highest wanted. Raises RunFailed.
    """
    top = max(harmonics) + beyond
    around = full_circle(top)
    share = sector.share(_angles(len(around.weights)), 2 * top)
    tyre = Revolved(blended(model, sector.model, share), loads, around)
    fields = FullCircle(vibration, tyre, sector, top)
    equilibrium(fields, U, check)
    near = range(min(max(harmonics) + SPARE_START_HARMONICS, top) + 1)
    plain = {
        (n, k): [fields.field(n, c * shape) for c in ((1.0, 1j) if n else (1.0,))]
        for n in near
        for k, shape in enumerate(vibration.modes(n, count).shapes)
    }
    seats = [(n, k) for n in harmonics for k in range(count)]
    apart = [
        _modes_of(fields.turning(turn), plain, seats, check)
        for turn in ((1.0, -1.0) if fields.turn else (0.0,))
    ]
    values = np.concatenate([each.eigenvalues for each in apart])
    order = np.argsort(values, kind="stable")
    held = {key: np.concatenate([each.held[key] for each in apart])[order] for key in plain}
    by_harmonic = tell(held, harmonics, count)
    shape_of = [partial(each.shape, j) for each in apart for j in range(len(each.eigenvalues))]
    result = []
    for n in harmonics:
        size = np.sqrt(np.pi if n else 2 * np.pi)  # from the whole circle's unit mass
        shapes = np.array([size * fields.wave(shape_of[j](), n) for j in order[by_harmonic[n]]])
        result.append(split(n, values[order[by_harmonic[n]]], shapes))
    return result


@dataclass(frozen=True)
class _Apart:
    """Modes of one of the two kinds of fields, kept or reversed by half a turn."""

    eigenvalues: Array  # (m,) lambda = omega^2, 1/s2
    held: dict[tuple[int, int], Array]  # (m,) how much of the plain mode (n, k) is in each
    shape: Callable[[int], Array]  # the field (k, nodes, 3) of a mode, by its place


def _modes_of(
    fields: FullCircle,
    plain: dict[tuple[int, int], list[Array]],
    seats: list[tuple[int, int]],
    check: Callable[[], None],
) -> _Apart:
    """plain: fields of the plain tyre's modes (n, k); seats: those that are wanted."""
    start: list[Array] = []
    places = {}
    for key, whole in plain.items():
        parts = [part for part in map(fields.part, whole) if _counts(part, whole[0])]
        places[key] = list(range(len(start), len(start) + len(parts)))
        start += parts
    wanted = sum(len(places[seat]) for seat in seats) + SPARE_MODES_KEPT
    values, modes, first = ritz_davidson(fields, start, wanted, check)
    held = {key: (first[own] ** 2).sum(0) for key, own in places.items()}
    return _Apart(values, held, modes)


def _counts(part: Array, whole: Array) -> bool:
    return float((part * part).sum()) > NEGLIGIBLE_PART * float((whole * whole).sum())


def equilibrium(fields: FullCircle, U: Array, check: Callable[[], None]) -> None:
    """Newton's method from the plain tyre's state. Raises NoEquilibrium."""
    state = np.repeat(U[None], len(fields.tyre.around.angles), 0)
    shape = state.shape
    product = lambda x: fields.forces(x.reshape(shape)).ravel()
    response = lambda x: fields.response(x.reshape(shape)).ravel()
    scale = 0.0
    for _ in range(MAX_SPLICE_ITERATIONS):
        check()
        try:
            whole = fields.out_of_balance(state)
        except Inverted as error:
            raise stopped(0.0, 0.0, f"with the splice {error}") from None
        force = (whole * fields.free).ravel()
        scale = scale or float(np.linalg.norm(whole))  # of what the rim bears
        if np.linalg.norm(force) <= SPLICE_FORCE_RTOL * scale:
            return
        step, _, _ = gmres(product, response, -force, SPLICE_LINEAR_RTOL, MAX_SPLICE_ITERATIONS)
        state = state + step.reshape(shape)
    raise stopped(0.0, 0.0, "Newton's method did not converge with the splice")


def ritz_davidson(
    fields: FullCircle, start: list[Array], wanted: int, check: Callable[[], None]
) -> tuple[Array, Callable[[int], Array], Array]:
    """Eigenvalues (m,) rising, the fields of the modes, M~-normalised, by their place, and
    (len(start), m): how much of each of the ``start`` fields they hold."""
    shape, new, used = start[0].shape, start, 0
    room = np.empty((3, len(start) + RESPONSE_ROUNDS * wanted, start[0].size))
    for left in reversed(range(RESPONSE_ROUNDS + 1)):
        for field in new:
            check()
            inertia = fields.inertia(field)
            size = np.sqrt((field * inertia).sum())
            field = field / size
            for row, values in zip(
                room[:, used], (field, fields.forces(field), inertia / size), strict=True
            ):
                row[:] = values.ravel()
            used += 1
        V, KV, MV = room[:, :used]
        K, M = V @ KV.T, V @ MV.T
        gram, turn = np.linalg.eigh((M + M.T) / 2)
        turn = turn[:, gram > MIN_GRAM] / np.sqrt(gram[gram > MIN_GRAM])
        values, inner = np.linalg.eigh(turn.T @ ((K + K.T) / 2) @ turn)
        x = turn @ inner
        if left:
            lowest = x[:, :wanted].T
            rest = lowest @ KV - values[:wanted, None] * (lowest @ MV)
            new = [fields.response(force.reshape(shape)) for force in rest]
    return values, lambda j: (x[:, j] @ V).reshape(shape), M[: len(start)] @ x
