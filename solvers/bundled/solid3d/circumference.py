"""Functions of the angle alone, which carry the section round the circumference.

Near the patch finite elements of three nodes, of the span {1, cos, sin} as in cylindrical bricks;
up to the top (theta = pi) more of them, or from the last element's end on waves,

    even about patch and top: cos j x,   odd: sin j x,   x = pi - theta

A circle and every shift and small turn of a rigid body are exact in both (displacements are
components in the frame of the reference angle).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, takewhile

import numpy as np

Array = np.ndarray
MAX_NEAR_LENGTH = np.radians(10.0)  # of elements near the patch
FARTHEST_ELEMENT = np.radians(45.0)  # end of an element from the patch's middle, the last apart
# highest harmonic that elements hold, times their length, rad: 7.5 elements to a wave
WAVE_BY_ELEMENTS = 2 * np.pi / 7.5
MORE_WAVES = 5  # than a mode's own, for a pressed tyre mixes them
MIN_WAVES = 4 + MORE_WAVES  # functions of the angle
SPARE_WAVE_POINTS = 8  # Gauss points of the waves beyond those that their products need


@dataclass(frozen=True)
class Circumference:
    """The tyre's way round, or half of it."""

    angles: Array  # of the nodes, at each of which its own function is 1 and the others 0, rad
    N: Array  # (s, k): functions at Gauss stations
    slope: Array  # (s, k): their derivatives by the angle
    weights: Array  # (s,), rad

    @cached_property
    def shares(self) -> Array:
        """Integrals (k,) of the functions, rad."""
        return np.asarray(self.weights @ self.N)


@dataclass(frozen=True)
class Piece:
    """An element, or the waves: its stations, and what is not zero there of the functions of an
    even, or of an odd field."""

    stations: slice
    functions: slice


@dataclass(frozen=True)
class HalfCircle(Circumference):
    """Functions and stations from the road's side (angle 0) to the top (pi).

    A field's coefficients (k, ...) are its values at the nodes, then those of its even and of its
    odd waves: a field that is even about the patch has the rows ``even`` of them alone, an odd one
    ``odd``, equally many, in the order of the pieces.
    """

    ends: Array  # of the elements, from 0 on, rad
    waves: Array  # (2, j, w): w even and w odd functions as sums of j waves, cos j x or sin j x
    stations: Array  # (s,), rad
    pieces: tuple[Piece, ...]
    even: Array  # (f,) rows of the coefficients that an even field has
    odd: Array  # (f,) rows of the coefficients that an odd field has

    def at(self, angles: Array) -> Array:
        """Values of the functions (k) at ``angles``, rad: (angles, k)."""
        return _functions(self.ends, self.waves, angles)[0]

    def turn(self, n: int) -> Array:
        """Coefficients (k,) of exp(i n theta): its values at the nodes, and the nearest waves."""
        result = np.zeros(self.N.shape[1], complex)
        result[: len(self.angles)] = np.exp(1j * n * self.angles)
        if self.waves.size:
            far, join = self.pieces[-1], np.exp(1j * n * self.ends[-1])
            w, wave = self.weights[far.stations], np.exp(1j * n * self.stations[far.stations])
            for rows, unit in ((self.even, 1.0), (self.odd, 1j)):
                first, *others = rows[far.functions]
                part = lambda z, unit=unit: (z / unit).real
                left = part(wave) - part(join) * self.N[far.stations, first]
                result[first] = unit * part(join)
                result[others] = unit * (self.N[far.stations][:, others].T @ (w * left))
        return result


def points(length: float) -> int:
    """Gauss points of an element of ``length``, rad: two would leave some motions without
    stiffness, and long elements must see the resultant of a uniform pressure vanish."""
    return 3 + int(length / 0.2)


def half_circle(lengths: Array, highest: int = 0) -> HalfCircle:
    """Elements of ``lengths`` (rad) from angle 0 on: to pi, or as far as they go and waves up to
    the ``highest`` beyond."""
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    counts = [points(length) for length in lengths]
    angles = np.empty(2 * len(lengths) + 1)
    angles[::2], angles[1::2] = ends, (ends[:-1] + ends[1:]) / 2
    waves, limits = np.zeros((2, 0, 0)), ends
    if highest:
        angles, limits = angles[:-1], np.append(ends, np.pi)
        # products of two waves turn 2 highest times as fast as the tyre
        counts.append(SPARE_WAVE_POINTS + int(highest * (np.pi - ends[-1])))
        waves = _waves(ends[-1], highest)
    nodes, far = len(angles), waves.shape[2]
    gauss = [np.polynomial.legendre.leggauss(count) for count in counts]
    half, middle = np.diff(limits) / 2, (limits[:-1] + limits[1:]) / 2
    stations = np.concatenate([m + h * x for m, h, (x, _) in zip(middle, half, gauss, strict=True)])
    weights = np.concatenate([h * w for h, (_, w) in zip(half, gauss, strict=True)])
    edges = np.concatenate([[0], np.cumsum(counts)])
    first = 2 * np.arange(len(counts))
    last = np.where(first == nodes, first + far, first + 3)
    pieces = tuple(
        Piece(slice(a, b), slice(c, d))
        for a, b, c, d in np.stack([edges[:-1], edges[1:], first, last], 1).tolist()
    )
    even = np.arange(nodes + far)
    odd = np.concatenate([even[:nodes], even[nodes:] + far])
    N, slope = _functions(ends, waves, stations)
    return HalfCircle(angles, N, slope, weights, ends, waves, stations, pieces, even, odd)


def waves_beyond(lengths: Array) -> HalfCircle:
    """Elements near the patch, one more, then waves, in place of elements from 0 to pi."""
    short = list(takewhile(lambda length: length <= MAX_NEAR_LENGTH, lengths))
    near = [
        length
        for length, end in zip(short, np.cumsum(short), strict=True)
        if end < 1.001 * FARTHEST_ELEMENT
    ]
    if not near:
        return half_circle(lengths)
    holds = WAVE_BY_ELEMENTS / float(max(lengths))
    return half_circle(np.array([*near, near[-1]]), max(MIN_WAVES, MORE_WAVES + int(holds)))


def _waves(join: float, highest: int) -> Array:
    """Even and odd functions from ``join`` (rad) to the top as sums of waves (2, waves, k): first
    one that is 1 at the join, then those that vanish there, orthonormal and orthogonal to it."""
    x, w = np.polynomial.legendre.leggauss(SPARE_WAVE_POINTS + 2 * highest)
    x, w = (np.pi - join) * (1 + x) / 2, (np.pi - join) * w / 2
    sums = []
    last = _sines(np.array([np.pi - join]), highest)[0]
    for values, at_join in zip(_sines(x, highest)[0], last, strict=True):
        vanish = np.linalg.svd(at_join)[2][1:].T
        rest = vanish @ np.linalg.inv(np.linalg.qr(np.sqrt(w)[:, None] * (values @ vanish))[1])
        one = at_join[0] / (at_join @ at_join[0])
        one = one - rest @ ((values @ rest).T @ (w * (values @ one)))
        sums.append(np.column_stack([one, rest]))
    return np.array(sums)


def _sines(x: Array, highest: int) -> tuple[Array, Array]:
    """cos j x for j from 0, and sin j x for j from 1 on, equally many, and their derivatives by
    x: each (2, points, waves)."""
    j = np.arange(highest + 1)
    a, b = np.multiply.outer(x, j), np.multiply.outer(x, j + 1)
    return np.array([np.cos(a), np.sin(b)]), np.array([-j * np.sin(a), (j + 1) * np.cos(b)])


def _functions(ends: Array, waves: Array, angles: Array) -> tuple[Array, Array]:
    """Values and derivatives (p, k) at angles, rad; ends, waves: as in `HalfCircle`."""
    nodes, far = 2 * len(ends) - (2 if waves.size else 1), waves.shape[2]
    result = np.zeros((2, len(angles), nodes + 2 * far))
    own = np.searchsorted(ends, angles, "right") - 1
    if not waves.size:
        own = np.minimum(own, len(ends) - 2)
    for i, (a, b) in enumerate(pairwise(ends)):
        here = own == i
        three = np.array(functions(angles[here] - (a + b) / 2, (b - a) / 2))
        result[:, here, 2 * i : 2 * i + 2] = three[..., :2]
        result[:, here, 2 * i + 2] = three[..., 2]
        if 2 * i + 2 == nodes:  # the waves begin there, even and odd ones
            result[:, here, nodes + far] = three[..., 2]
    beyond = own == len(ends) - 1
    for parity, values in enumerate(waves):
        at = _sines(np.pi - angles[beyond], len(values) - 1)
        columns = slice(nodes + parity * far, nodes + (parity + 1) * far)
        result[0, beyond, columns], result[1, beyond, columns] = (
            at[0][parity] @ values,
            -at[1][parity] @ values,
        )
    return result[0], result[1]


def functions(angle: Array, half: Array | float) -> tuple[Array, Array]:
    """The three functions and their derivatives (p, 3) at angles from the element's middle, whose
    ends are ``half`` away, rad."""
    bulge, dbulge = (1 - np.cos(angle)) / (1 - np.cos(half)), np.sin(angle) / (1 - np.cos(half))
    tilt, dtilt = np.sin(angle) / np.sin(half), np.cos(angle) / np.sin(half)
    values = [(bulge - tilt) / 2, 1 - bulge, (bulge + tilt) / 2]
    return np.stack(values, -1), np.stack([(dbulge - dtilt) / 2, -dbulge, (dbulge + dtilt) / 2], -1)
