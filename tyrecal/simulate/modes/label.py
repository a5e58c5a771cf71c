"""A labelled mode [c, m] of the tyre.

Labels [c, m] from mode shapes alone.

c is the shape's circumferential harmonic. m comes from the belt: each component of its motion is
written as sum of a_k P_k(zeta), Legendre polynomials over the width, zeta = z / half width, and
holds the energy |a_k|^2 / (2 k + 1) per polynomial, in which no phase appears. On order m:

    m = 0   r P0, theta P0              the belt moves in its plane
    m = 1   r P1, theta P1, z P0        it moves out of its plane and tilts
    m = 2   r P2, theta P2, z P1        it bulges
    m = 3   r P3, theta P3, z P2

On c = 0 theta P0 alone is [0,0] torsional and z P0 alone [0,0] axial; r P0, a breathing that a
belt only does while it bulges, counts as m = 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import legvander

from ..evaluate.results import Evaluation, HarmonicShape, RawMode, RingShape

FAMILIES = ("in-plane", "out-of-plane")
KNOWN = {
    (0, 0, "axial"): "lateral",
    (0, 0, "torsional"): "torsional",
    (1, 1, None): "pitch / yaw-camber",
    (1, 0, None): "vertical / fore-aft",
    (2, 0, None): "ovalisation",
}
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth")
Array = np.ndarray
# radius over the largest radius above which a point is on the belt: a belt is nearly flat, and a
# sidewall soon leaves this height
BELT = 0.94
DEGREE = 3  # of the polynomials P0 to P3 in z across the belt
CONDITION = 30.0  # of the polynomials on the points at hand; fewer rings carry a lower degree
MAX_SAMPLED_HARMONIC = 12  # that is looked for in sampled shapes
ALIASED = 1e-4  # of what a harmonic holds: solvers print angles and shapes with six digits
SUBSTANTIAL = 0.2  # share of the belt's motion below which a mode cannot claim an order
# mean square motion of the belt over that of all points below which a mode is not the belt's
TAKES_PART = 0.1
# column of z P0 on c = 0; columns 0 to 3 are the orders, 0 on c = 0 being theta P0
AXIAL_COLUMN = 4
UNIT_MASS_SOLVERS = ("bundled", "calculix")  # whose harmonic shapes have a modal mass of 1 kg
PARITY = (0, 1, 0, 1, 1)  # axial motion is the c = 0 member of the out-of-plane family


@dataclass(frozen=True, order=True)
class Label:
    """[c, m]: c waves round the circumference; m nodal circles of the radial motion on the belt.

    m = 0 is in-plane, 1 out-of-plane (the belt tilts), 2 and more bend the belt across its width.
    The two [0, 0] modes move the belt as a rigid ring and differ in ``kind``: ``axial`` (along
    the axle) and ``torsional`` (about it); all others have kind None.
    """

    c: int
    m: int
    kind: str | None = None

    @property
    def family(self) -> str | None:
        """``in-plane``: [c,0] and [0,0] torsional; ``out-of-plane``: [c,1] and [0,0] axial, which
        move the belt likewise; None: overtones, and modes across the belt."""
        if self.c == 0:
            return {"torsional": FAMILIES[0], "axial": FAMILIES[1]}.get(self.kind or "")
        return FAMILIES[self.m] if self.m < 2 else None

    @property
    def display(self) -> str:
        """Name for people; files and options have the label itself: ``axial`` is lateral."""
        return in_words(str(self))

    @property
    def motion(self) -> str:
        """Motion of the tyre, in words: that of [2,1] is 'first out-of-plane bending'."""
        if (self.c, self.m, self.kind) in KNOWN:
            return KNOWN[self.c, self.m, self.kind]
        if self.m > 1:
            return "belt bends across its width"
        if self.c < 2:
            return "overtone"
        order = ORDINALS[self.c - 2] if self.c - 2 < len(ORDINALS) else f"{self.c - 1}th"
        return f"{order} {'out-of' if self.m else 'in'}-plane bending"

    def __str__(self) -> str:
        return f"[{self.c},{self.m}]" + (f" {self.kind}" if self.kind else "")


def in_words(text: str) -> str:
    """A text with labels as people say them: ``[0,0] axial`` of files is ``[0,0] lateral``."""
    return text.replace("[0,0] axial", "[0,0] lateral")


@dataclass(frozen=True)
class Mode:
    """A label on a solver's mode. ``clarity``: how far the label's share of the motion leads
    the next label's, 0 (a tie) to 1; ``position``: index in the labelled modes, which are the
    evaluation's, or their `pair_rings`, and in its gradients."""

    label: Label
    frequency_Hz: float
    multiplicity: int  # 2: both modes of a pair, 1: one
    clarity: float
    position: int
    raw: RawMode

    def __repr__(self) -> str:
        doublet = ", doublet" if self.multiplicity == 2 else ""
        return f"Mode({self.label}, {self.frequency_Hz:.2f} Hz{doublet})"


def _columns(c_is_zero: bool) -> Array:
    """(3 components, DEGREE + 1, 5 columns): 1 where a polynomial belongs to the column."""
    table = np.zeros((3, DEGREE + 1, 5))
    for k in range(DEGREE + 1):
        table[0, k, k] = table[1, k, k] = 1.0
        if k < DEGREE:
            table[2, k, k + 1] = 1.0
    if c_is_zero:
        table[0, 0], table[2, 0] = np.eye(5)[2], np.eye(5)[AXIAL_COLUMN]
    return table


COLUMNS = (_columns(False), _columns(True))  # of c > 0, of c = 0


@dataclass(frozen=True)
class BeltMotion:
    """How a shape moves the belt."""

    c: int  # circumferential harmonic
    shares: Array  # (5,) of the belt's energy on orders 0 to 3 and, on c = 0, along the axle
    participation: float  # mean square motion of the belt over that of all points


def belt_motion(shape: HarmonicShape | RingShape) -> BeltMotion:
    """The belt's part in ``shape``. The belt: points beyond 0.94 of the largest radius given.

    Raises ValueError when no component was measured on the belt, or at too few points (4).
    """
    if isinstance(shape, HarmonicShape):
        c = shape.n
        belt, inverse = _section_fit(np.ascontiguousarray(shape.points, float).tobytes())
        energy = np.zeros((3, DEGREE + 1))
        energy[:, : len(inverse)] = _squared(inverse @ shape.amplitude[belt]).T
        motion = _squared(shape.amplitude)
        part, whole = motion[belt].mean(), motion.mean()
    else:
        c, energy = _ring_energy(shape)
        motion = shape.displacement**2
        part, whole = np.nanmean(motion[_belt(shape.points[:, 0])]), np.nanmean(motion)
    energy /= 2 * np.arange(DEGREE + 1) + 1
    shares = np.einsum("ik,ikm->m", energy, COLUMNS[c == 0]) / (energy.sum() or 1.0)
    return BeltMotion(c, shares, float(part / (whole or 1.0)))


def mean_belt_motion(shape: HarmonicShape) -> tuple[Array, float]:
    """Amplitudes (3,) r, theta, z, which are the mean over the belt's width, and the belt's mean
    radius, m."""
    belt, inverse = _section_fit(np.ascontiguousarray(shape.points, float).tobytes())
    return (inverse @ shape.amplitude[belt])[0], float(shape.points[belt, 0].mean())


def label_modes(evaluation_modes: Sequence[RawMode]) -> list[Mode]:
    """One Mode per raw mode, in their order, no label twice.

    Within a harmonic the orders 0 to 3 go to modes by assignment: the largest sum of share times
    the belt's participation over the square of the frequency, which is the part of the belt's
    static compliance that a mode holds. So the lowest mode that moves the belt on an order has
    its label, two modes that share two orders are told apart together, and an overtone, or a
    mode of the sidewalls, steals nothing: it gets the next free m of its parity (from 2; 1 on
    c = 0). Sampled pairs have to be joined before (``pair_rings``).

    Raises ValueError as ``belt_motion``.
    """
    from scipy.optimize import linear_sum_assignment  # late: longer than most evaluations

    motions = [belt_motion(mode.shape) for mode in evaluation_modes]
    frequency = np.array([max(mode.frequency_Hz, 1e-6) for mode in evaluation_modes])
    labels: dict[int, Label] = {}
    clarity: dict[int, float] = {}
    for c in sorted({motion.c for motion in motions}):
        members = [i for i in np.argsort(frequency, kind="stable") if motions[i].c == c]
        shares = np.array([motions[i].shares for i in members])
        part = np.array([motions[i].participation for i in members])[:, None]
        weight = shares * part * (frequency[members[0]] / frequency[members])[:, None] ** 2
        weight[(shares < SUBSTANTIAL) | (part < TAKES_PART)] = 0.0
        rows, columns = (each.tolist() for each in linear_sum_assignment(weight, maximize=True))
        pairs = zip(rows, columns, strict=True)
        claims = {row: column for row, column in pairs if weight[row, column] > 0}
        taken = {column for column in claims.values() if column != AXIAL_COLUMN}
        for row, i in enumerate(members):
            column = claims.get(row)
            if column is None:
                column = int(np.argmax(shares[row]))
                m = PARITY[column] + (2 if c or PARITY[column] == 0 else 0)
                while m in taken:
                    m += 2
                taken.add(m)
                labels[i] = Label(c, m)
            else:
                labels[i] = _label(c, column)
            next_share = max(np.delete(shares[row], column))
            clarity[i] = max(0.0, float(shares[row, column] - next_share))
    return [
        Mode(labels[i], mode.frequency_Hz, mode.multiplicity, clarity[i], i, mode)
        for i, mode in enumerate(evaluation_modes)
    ]


def labelled(evaluation: Evaluation) -> list[Mode]:
    """All modes with their labels, by rising frequency."""
    return sorted(paired_labels(evaluation.modes), key=lambda mode: mode.frequency_Hz)


def paired_labels(modes: Sequence[RawMode]) -> list[Mode]:
    """`label_modes`, after the two modes of each pair are joined into one if shapes are sampled on
    rings; a harmonic shape stands for a pair already.

    Raises ValueError as ``belt_motion``.
    """
    sampled = any(isinstance(mode.shape, RingShape) for mode in modes)
    return label_modes(pair_rings(modes) if sampled else modes)


def pair_rings(modes: Sequence[RawMode], tolerance: float = 5e-3) -> list[RawMode]:
    """``modes`` by frequency, with the two halves of each sampled pair joined into one.

    Halves: RingShapes of multiplicity 1 and one harmonic c >= 1, their frequencies within
    ``tolerance`` (relative), alike in how they move the belt. The joined mode has multiplicity 2,
    the mean frequency and the first half's shape: either half tells the label, whatever angle
    they are turned by. A half without a partner stays as it is.

    Raises ValueError as ``belt_motion``.
    """
    waiting = sorted(modes, key=lambda mode: mode.frequency_Hz)
    single = [m.multiplicity == 1 and isinstance(m.shape, RingShape) for m in waiting]
    motions = [belt_motion(m.shape) if s else None for m, s in zip(waiting, single, strict=True)]
    joined, used = [], set()
    for i, (mode, motion) in enumerate(zip(waiting, motions, strict=True)):
        if i in used:
            continue
        best, partner = np.inf, -1
        for j in range(i + 1, len(waiting)):
            gap = waiting[j].frequency_Hz / mode.frequency_Hz - 1
            if gap > tolerance:
                break
            other = motions[j]
            if j in used or not (motion and other and motion.c == other.c > 0):
                continue
            unlike = gap / tolerance + np.abs(motion.shares - other.shares).sum()
            if unlike < best:
                best, partner = unlike, j
        if best < 1.5:  # a pair differs by its split, two orders in all their shares: by 2
            used.add(partner)
            mean = (mode.frequency_Hz + waiting[partner].frequency_Hz) / 2
            mode = RawMode(mean, mode.shape, 2, damping_ratio=mode.damping_ratio)
        joined.append(mode)
    return sorted(joined, key=lambda mode: mode.frequency_Hz)


def _label(c: int, column: int) -> Label:
    if c == 0 and column in (0, AXIAL_COLUMN):
        return Label(0, 0, "axial" if column == AXIAL_COLUMN else "torsional")
    return Label(c, column)


def _belt(R: Array) -> Array:
    return R / R.max() > BELT


def _squared(x: Array) -> Array:
    return x.real**2 + x.imag**2


def _polynomials(x: Array) -> Array:
    """Legendre polynomials at x, (k, degree + 1): the highest degree that the points carry."""
    for degree in range(min(DEGREE, len(x) // 4 - 1), 0, -1):
        values = legvander(x, degree)
        if np.linalg.cond(values) < CONDITION:
            return values
    return legvander(x, 0)


def _across(z: Array) -> Array:
    return z / (np.abs(z).max(initial=0.0) or 1.0)


@lru_cache(maxsize=16)
def _section_fit(points: bytes) -> tuple[Array, Array]:
    """Belt nodes of a section and the least-squares operator (degree + 1, belt nodes)."""
    R, Z = np.frombuffer(points).reshape(-1, 2).T
    belt = np.flatnonzero(_belt(R))
    return belt, np.linalg.pinv(_polynomials(_across(Z[belt])))


def _ring_energy(shape: RingShape) -> tuple[int, Array]:
    """The harmonic that holds most of the motion, and |a|^2 (3, DEGREE + 1) on it."""
    points = np.ascontiguousarray(shape.points, float).tobytes()
    held = np.zeros(MAX_SAMPLED_HARMONIC + 1)
    energy = np.zeros((MAX_SAMPLED_HARMONIC + 1, 3, DEGREE + 1))
    on_belt = False
    for k, u in enumerate(shape.displacement.T):
        for zone, (rows, fits) in enumerate(_ring_fits(points, np.isfinite(u).tobytes())):
            on_belt |= zone == 0 and len(rows) >= 4
            for c, (basis, inverse) in enumerate(fits):
                held[c] += np.sum((basis.T @ u[rows]) ** 2)
                if zone == 0:
                    a = np.sum((inverse @ u[rows]).reshape(2, -1) ** 2, axis=0)
                    energy[c, k, : len(a)] = a
    if not on_belt:
        raise ValueError("a label needs motion measured at four points of the belt or more")
    # harmonics that the angles cannot tell apart hold the same: the lowest is meant
    c = int(np.argmax(held > (1 - ALIASED) * held.max()))
    return c, energy[c]


@lru_cache(maxsize=16)
def _ring_fits(points: bytes, measured: bytes) -> list[tuple[Array, list[tuple[Array, Array]]]]:
    """Per zone (belt, two sidewalls): its measured points and, per harmonic, the fit there.

    A fit: orthonormal basis (rows, terms) of P_k cos c Theta, P_k sin c Theta, and the operator
    from motion to their coefficients, cosines first.
    """
    R, Theta, Z = np.frombuffer(points).reshape(-1, 3).T
    given, belt = np.frombuffer(measured, bool), _belt(R)
    height = (R - R.min()) / (np.ptp(R) or 1.0) * 2 - 1
    zones = [
        (belt, _across(np.where(belt, Z, 0.0))),
        (~belt & (Z > 0), height),
        (~belt & (Z < 0), height),
    ]
    result = []
    for zone, x in zones:
        rows = np.flatnonzero(zone & given)
        fits = []
        if len(rows) >= 4:
            P = _polynomials(x[rows])
            for c in range(MAX_SAMPLED_HARMONIC + 1):
                angle = c * Theta[rows, None]
                basis, size, right = np.linalg.svd(
                    np.hstack([P * np.cos(angle), P * np.sin(angle)]), full_matrices=False
                )
                keep = size > size[0] / CONDITION**2
                basis = basis[:, keep]
                fits.append((basis, (right[keep].T / size[keep]) @ basis.T))
        result.append((rows, fits))
    return result
