"""Modes of the loaded tyre named after those of the unloaded one by their shapes.

Shapes are fields (ring, node, 3) on rings round the tyre, angle 0 in the patch's middle, that some
nodes of the section make. Overlap of two shapes a, b: their MAC

    (a . b)^2 / (a . a  b . b),   a . b = sum of area * (a_r b_r + a_theta b_theta + a_z b_z)

A shape is symmetric about the patch where its part that is even under theta -> -theta (u_theta odd)
holds more of a . a than the other. Cords at a bias mix the two a little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..evaluate.results import HarmonicShape
from .label import Label, Mode

Array = np.ndarray
MAX_LOAD_STEP, MIN_LOAD_SHARE = 1 / 16, 1e-7  # steps of t, the way from load to load being 1
MIN_OVERLAP = 0.8  # least MAC of a shape over a step, else the step is halved; chosen
SPANNED = 1e-6  # singular value over the largest one, above which a direction counts
ABOVE = 2.0  # omega^2 of directions outside the known modes, over the highest one of these
SYMMETRIES = ("symmetric", "antisymmetric")
MIRROR = np.array([1.0, -1.0, 1.0])  # theta -> -theta


@dataclass(frozen=True, order=True)
class Member:
    """One of the two modes that a doublet splits in, or a single mode."""

    label: Label  # of the unloaded mode
    symmetry: str  # about the patch, one of `SYMMETRIES`

    def __str__(self) -> str:
        return f"{self.label.display} {self.symmetry}"


@dataclass(frozen=True)
class Rings:
    """Where shapes are known: nodes of the section, on rings round the tyre."""

    angles: Array  # (k,) of the rings, rad, as in `Pressed`
    nodes: Array  # (j,) deck numbers
    areas: Array  # (k, j) of the undeformed tyre, m2, that each point stands for

    def flat(self, shapes: Array) -> Array:
        """Shapes (p, k, j, 3) as vectors (p, 3 k j), their scalar product that of the module."""
        return np.asarray((shapes * np.sqrt(self.areas)[:, :, None]).reshape(len(shapes), -1))

    def overlaps(self, a: Array, b: Array) -> Array:
        """MACs (p, q) of p shapes a (p, k, j, 3) and q shapes b (q, k, j, 3)."""
        x, y = self.flat(a), self.flat(b)
        return np.asarray((x @ y.T) ** 2 / np.outer((x * x).sum(1), (y * y).sum(1)))

    def part(self, shapes: Array, symmetric: bool) -> Array:
        """The part of shapes (p, k, j, 3) that is symmetric about the patch, or antisymmetric."""
        back = (-np.arange(len(self.angles))) % len(self.angles)  # each ring has one at -theta
        image = MIRROR * shapes[:, back]
        return (shapes + image if symmetric else shapes - image) / 2

    def evenness(self, shapes: Array) -> Array:
        """Share (p,) of each shape that is symmetric about the patch."""
        even, whole = self.flat(self.part(shapes, symmetric=True)), self.flat(shapes)
        return np.asarray((even**2).sum(1) / (whole**2).sum(1))


def rings(angles: Array, nodes: Array, all_nodes: Array, points: Array) -> Rings:
    """The rings through ``nodes`` (j,), a line across the section, which Z orders; ``all_nodes``
    (n,), points (n, 2): R, Z in m."""
    row = {int(number): i for i, number in enumerate(all_nodes)}
    R, Z = points[[row[int(number)] for number in nodes]].T
    order = np.argsort(Z)
    width = np.empty(len(nodes))
    steps = np.hypot(*np.diff([R[order], Z[order]]))
    width[order] = (np.append(steps, 0.0) + np.append(0.0, steps)) / 2
    around = np.concatenate([angles, [2 * np.pi]])
    ahead = np.diff(around)
    arcs = (ahead + np.roll(ahead, 1)) / 2
    return Rings(angles, nodes, arcs[:, None] * (R * width))


def members(mode: Mode, where: Rings) -> dict[Member, Array]:
    """The unloaded mode's two members (ring, node, 3), any scale, or its only one."""
    shape = mode.raw.shape
    if not isinstance(shape, HarmonicShape):
        raise TypeError("an unloaded mode to compare with comes from its harmonic")
    row = {int(number): i for i, number in enumerate(shape.nodes)}
    A = shape.amplitude[[row[int(number)] for number in where.nodes]]
    # A exp(i phase) whose real parts of r and z, and imaginary ones of theta, are the largest
    squares = (A**2 * (MIRROR * where.areas.sum(0)[:, None])).sum()
    A = A * np.exp(-0.5j * np.angle(squares))
    turn = np.exp(1j * shape.n * where.angles)[:, None, None]
    even, odd = (A * turn).real, (1j * A * turn).real
    if shape.n:
        return {Member(mode.label, s): u for s, u in zip(SYMMETRIES, (even, odd), strict=True)}
    single = A.real if (A.real**2).sum() >= (A.imag**2).sum() else A.imag
    field = np.broadcast_to(single, even.shape)
    symmetry = SYMMETRIES[int(where.evenness(field[None])[0] < 0.5)]
    return {Member(mode.label, symmetry): field}


def state(frequencies: Array, shapes: Array, where: Rings) -> ModesAtLoad:
    """The modes of one load: frequencies (m,) in Hz, shapes (m, ring, node, 3)."""
    return ModesAtLoad(frequencies, shapes, where.evenness(shapes) >= 0.5)


@dataclass(frozen=True)
class ModesAtLoad:
    """Modes of the tyre at one load."""

    frequencies: Array  # (m,) Hz
    shapes: Array  # (m, ring, node, 3), any scale
    symmetric: Array  # (m,) whether a mode is symmetric about the patch


@dataclass(frozen=True)
class Followed:
    """Where each mode of one load went at the next."""

    position: Array  # (m,) index of the mode there, -1 if it is none of the known ones
    spanned: Array  # (m,) share of its shape there that the modes known before span, 0 to 1


def follow(before: ModesAtLoad, after: ModesAtLoad, where: Rings) -> Followed:
    """Modes followed from load to load, symmetric ones and antisymmetric ones by themselves.

    Within each kind the curves of the frequencies attract, bend away and exchange shapes rather
    than cross (von Neumann and Wigner), so a look at both ends is not enough. As if the stiffness
    changed linearly in between,

        K(t) = (1 - t) K_before + t K_after,   K = sum of omega^2 v v^T over the known modes

    and high above them what is left of both ends' span, modes are followed in steps so small that
    shapes hardly change: each time the one-to-one assignment with the largest sum of overlaps.
    """
    position, spanned = np.full(len(before.shapes), -1), np.zeros(len(before.shapes))
    for symmetric in (True, False):
        here, there = (np.flatnonzero(s.symmetric == symmetric) for s in (before, after))
        if not (len(here) and len(there)):
            continue
        a, b = (
            _nearest_orthonormal(where.flat(where.part(s.shapes[rows], symmetric)).T)
            for s, rows in ((before, here), (after, there))
        )
        to = _homotopy(before.frequencies[here], a, after.frequencies[there], b)
        matched = to >= 0
        position[here[matched]] = there[to[matched]]
        spanned[here[matched]] = ((a.T @ b) ** 2).sum(0)[to[matched]]
    return Followed(position, spanned)


def _homotopy(f_before: Array, a: Array, f_after: Array, b: Array) -> Array:
    """For each column of a (3 k j, m) the place (m,) of its column in b, or -1; columns
    orthonormal, frequencies (m,) in Hz. K is in Hz^2: no factor changes its vectors."""
    from scipy.optimize import linear_sum_assignment  # late: longer than most evaluations

    u, size, _ = np.linalg.svd(np.hstack([a, b]), full_matrices=False)
    span = u[:, size > SPANNED * size[0]]
    a, b = span.T @ a, span.T @ b
    above = ABOVE * max(f_before.max(), f_after.max()) ** 2
    known = ((a, f_before), (b, f_after))
    ends = [(v * (f**2 - above)) @ v.T + above * np.eye(len(v)) for v, f in known]
    now, t, step = a, 0.0, MAX_LOAD_STEP
    while t < 1:
        ahead = min(t + step, 1.0)
        _, vectors = np.linalg.eigh((1 - ahead) * ends[0] + ahead * ends[1])
        overlap = (now.T @ vectors) ** 2
        rows, to = linear_sum_assignment(overlap, maximize=True)
        if overlap[rows, to].min() < MIN_OVERLAP and step > MIN_LOAD_SHARE:
            step /= 2
            continue
        now, t, step = vectors[:, to], ahead, min(2 * step, MAX_LOAD_STEP)
    overlap = (now.T @ b) ** 2
    return np.where(overlap.max(1) > 0.5, overlap.argmax(1), -1)


def _nearest_orthonormal(v: Array) -> Array:
    """The orthonormal columns (3 k j, m) nearest to those of v (Loewdin)."""
    u, _, w = np.linalg.svd(v / np.linalg.norm(v, axis=0), full_matrices=False)
    return np.asarray(u @ w)
