"""Modes of a tyre that is not quite axisymmetric: its harmonics are coupled.

Ritz's method on fields sum over n of Re[c_n U_n(R, Z) exp(i n Theta)]: the axisymmetric tyre's
own modes, and its static response to what breaks the symmetry. What was a doublet splits into two
modes of different frequency; each is named by the doublet that it holds most of.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..modes.harmonics import Combination, HarmonicModes, SeededTyre, Vibration
from ..section.kept_fields import Coordinates
from ..section.point_elements import PointElements

Array = np.ndarray
CANDIDATES_PER_MODE = 3  # coupled modes looked at for every one wanted
SPARE_HARMONICS = 4  # harmonics beyond the highest wanted whose modes may lie close to wanted ones
# share of a mode's energy below which a harmonic does not count for its slopes
MIN_ENERGY_SHARE = 1e-6
MIN_RESPONSE_SHARE = 1e-9  # share of the static response that a direction may hold to be left out
# times the highest eigenvalue looked at: fields beyond it follow almost statically
STATIC_FROM = 9.0
# responses of those, each to the last one's inertia: right to STATIC_FROM^(-2 STATIC_MOMENTS)
STATIC_MOMENTS = 3


@dataclass
class HarmonicFamily:
    """Fields of harmonic n that diagonalise K(n) and M, the lowest first; u^H M u = 1."""

    n: int
    eigenvalues: Array  # (k,)
    shapes: Array  # (k, nodes, 3)

    @property
    def whole(self) -> float:
        """Square of the factor from unit mass per radian to unit mass of the whole circle."""
        return 1 / np.pi if self.n else 1 / (2 * np.pi)


class HarmonicBasis:
    """Real fields: for each family c = 1, and for n >= 1 then c = i."""

    def __init__(self, families: list[HarmonicFamily]):
        self.families = families
        own = [np.tile(each.eigenvalues, 2 if each.n else 1) for each in families]
        ends = np.cumsum([len(each) for each in own])
        self._rows = [slice(end - len(each), end) for each, end in zip(own, ends, strict=True)]
        self.eigenvalues = np.concatenate(own)

    def amplitudes(self, f: int, vectors: Array) -> Array:
        """c (k, m) of the f-th family's fields, of fields given by vectors (fields, m)."""
        own, family = vectors[self._rows[f]] + 0j, self.families[f]
        count = len(family.eigenvalues)
        return own[:count] + 1j * own[count:] if family.n else own

    def energy(self, vectors: Array) -> Array:
        """Twice the strain energy (families, m), J, of each family's part of fields given by
        vectors (fields, m)."""
        return np.array([self.eigenvalues[rows] @ vectors[rows] ** 2 for rows in self._rows])

    def part(self, f: int, vectors: Array) -> Array:
        """Shapes (m, nodes, 3) of the f-th family for fields given by vectors (fields, m), scaled
        to unit mass as in the family."""
        return np.tensordot(self.amplitudes(f, vectors).T, self.families[f].shapes, 1)

    def at_zero(self, attached: PointElements) -> Array:
        """Displacement (d, fields) of the attached components."""
        columns = []
        for family in self.families:
            # share: the mean of cos n Theta over the sector that a component is spread over
            pick = family.shapes[:, attached.rows, attached.components].T
            pick = pick * np.sqrt(family.whole) * attached.share(family.n)
            columns += [pick.real, -pick.imag] if family.n else [pick.real]
        return np.hstack(columns)


def attached_modes(
    vibration: Vibration,
    attached: PointElements,
    harmonics: list[int],
    count: int,
    check: Callable[[], None] = lambda: None,
) -> list[HarmonicModes]:
    """The ``count`` lowest modes of each harmonic with masses and springs on the tyre.

    K + k p p^T and M + m p p^T, p the displacement that carries k or m, summed up to the highest
    harmonic that the sectors carry. Raises RunFailed.
    """
    families, force = [], _unit_forces(vibration.numbering, attached)
    for n in range(max([attached.highest, *harmonics]) + 1):
        check()
        own = count + 1 if n <= max(harmonics) + SPARE_HARMONICS else 0
        families.append(_with_response(vibration, n, own, force))
    basis = HarmonicBasis(families)
    p = basis.at_zero(attached)
    looked = CANDIDATES_PER_MODE * len(_seats(harmonics, count)) + 10
    low, high, rest = _reduced(basis.eigenvalues, p, looked)
    from scipy.linalg import block_diag, eigh  # late: a tyre alike all round needs none of it

    at = np.hstack([p[:, low], p[:, high] @ rest])
    K = block_diag(np.diag(basis.eigenvalues[low]), rest.T * basis.eigenvalues[high] @ rest)
    K += at.T @ (attached.stiffness.real[:, None] * at)
    M = np.eye(len(K)) + at.T @ (attached.mass.real[:, None] * at)
    values, eigenvectors = eigh(K, M)
    vectors = np.empty((len(basis.eigenvalues), min(looked, len(values))))
    vectors[low], vectors[high] = (
        eigenvectors[: len(low), :looked],
        rest @ eigenvectors[len(low) :, :looked],
    )
    return named(basis, values[:looked], vectors, harmonics, count, p)


def _reduced(eigenvalues: Array, p: Array, looked: int) -> tuple[Array, Array, Array]:
    """Places of the low fields and of the high ones, and orthonormal combinations (high, k) of
    these, that together hold the ``looked`` lowest coupled modes.

    The low fields themselves; of the many high ones, with eigenvalues D and displacements p at the
    attached components, D^-1 p^T, D^-2 p^T, ...: Lanczos' vectors of
    the forces that attached masses and springs exert on them.
    """
    limit = STATIC_FROM * np.sort(eigenvalues)[: looked + 1][-1]
    low, high = np.flatnonzero(eigenvalues <= limit), np.flatnonzero(eigenvalues > limit)
    relative = limit / eigenvalues[high, None]
    moments = np.hstack([relative**k * p[:, high].T for k in range(1, STATIC_MOMENTS + 1)])
    return low, high, np.linalg.qr(moments)[0]


def _unit_forces(numbering: Coordinates, attached: PointElements) -> Array:
    """Coordinates (size, k), orthonormal, that span unit forces on the attached components."""
    force = np.zeros((*numbering.free.shape, len(attached.rows)))
    force[attached.rows, attached.components, range(len(attached.rows))] = 1.0
    force = numbering.apart(force)
    loaded = np.flatnonzero(force.any(1))
    across, sizes, _ = np.linalg.svd(force[loaded], full_matrices=False)
    across = across[:, sizes > MIN_RESPONSE_SHARE * sizes[0]]
    forces = np.zeros((len(force), across.shape[1]))
    forces[loaded] = across
    return forces


def _with_response(vibration: Vibration, n: int, count: int, force: Array) -> HarmonicFamily:
    """Modes of harmonic n and the static response to forces (size, k) on the attached
    components."""
    factor, numbering = vibration.factor(n), vibration.numbering
    response = factor.solve(force)
    gives, directions = np.linalg.eigh(force.conj().T @ response)
    directions = directions[:, gives > MIN_RESPONSE_SHARE * gives[-1]]
    vectors = response @ directions
    images = force @ directions + vibration.shift * vibration.times_mass(vectors)
    if count:
        modes = vibration.modes(n, count, factor)
        own = numbering.gather(np.moveaxis(modes.shapes, 0, -1))
        vectors = np.hstack([own, vectors])
        images = np.hstack([vibration.times_mass(own) * modes.eigenvalues, images])
    family = ritz(vibration, n, vectors, images)
    if n == 0:  # of kept fields the real ones, see `symmetry`
        family.shapes = family.shapes.real + family.shapes.imag
    return family


def ritz(vibration: Vibration, n: int, vectors: Array, images: Array) -> HarmonicFamily:
    """Fields spanned by ``vectors`` (size, k), K(n) times which is ``images``, made diagonal."""
    masses = vibration.times_mass(vectors)
    size = np.sqrt(np.einsum("ik,ik->k", vectors.conj(), masses).real)
    vectors, masses, images = vectors / size, masses / size, images / size
    gram, turn = np.linalg.eigh(vectors.conj().T @ masses)
    turn = turn[:, gram > 1e-12] / np.sqrt(gram[gram > 1e-12])
    K = turn.conj().T @ (vectors.conj().T @ images) @ turn
    values, inner = np.linalg.eigh((K + K.conj().T) / 2)
    shapes = vibration.numbering.spread(vectors @ (turn @ inner))
    return HarmonicFamily(n, values, np.moveaxis(shapes, -1, 0))


@dataclass
class CoupledShapes:
    """The harmonics that attached masses and springs couple in each mode.

    p: those that hold more than `MIN_ENERGY_SHARE` of its energy.
    """

    mode: Array  # (p,)
    n: Array  # (p,)
    shapes: Array  # (p, nodes, 3)
    eigenvalues: Array  # (m,)
    at: Array  # (d, m): displacement of the attached components

    def forms(self) -> tuple[Array, Array, Array, Array]:
        """As `HarmonicModes.forms`: each mode is the sum of several parts."""
        return self.n, self.shapes, self.mode, self.eigenvalues

    def rates(self, forms: Array, change: SeededTyre) -> Array:
        """psi^T (K' - lambda M') psi (m,) of the whole: d lambda by the change."""
        return forms + change.attached.rates(self.eigenvalues, self.at)

    def where(self, keep: Array | slice) -> CoupledShapes:
        """The parts of some of the modes."""
        kept = np.arange(len(self.eigenvalues))[keep]
        place = np.full(len(self.eigenvalues), -1)
        place[kept] = np.arange(len(kept))
        mine = place[self.mode] >= 0
        return CoupledShapes(
            place[self.mode[mine]],
            self.n[mine],
            self.shapes[mine],
            self.eigenvalues[kept],
            self.at[:, kept],
        )


def named(
    basis: HarmonicBasis, values: Array, vectors: Array, harmonics: list[int], count: int, p: Array
) -> list[HarmonicModes]:
    """Coupled modes, eigenvalues (m,) rising and vectors (fields, m), by the plain modes of
    which they hold most; of a doublet's two the lower comes first. p (d, fields)."""
    place = {family.n: f for f, family in enumerate(basis.families)}
    held = {
        (n, k): abs(amplitude) ** 2
        for n in harmonics
        for k, amplitude in enumerate(basis.amplitudes(place[n], vectors))
    }
    by_harmonic = tell(held, harmonics, count)
    order = [j for n in harmonics for j in by_harmonic[n]]
    values, vectors = values[order], vectors[:, order]
    which, mode = np.nonzero(basis.energy(vectors) > MIN_ENERGY_SHARE * values)
    parts = [basis.part(f, vectors[:, mode[which == f]]) for f in np.unique(which).tolist()]
    n_of = np.array([family.n for family in basis.families])
    whole = CoupledShapes(mode, n_of[which], np.concatenate(parts), values, p @ vectors)
    result, first = [], 0
    for n in harmonics:
        mine = slice(first, first + len(by_harmonic[n]))
        own = basis.part(place[n], vectors[:, mine])
        result.append(split(n, values[mine], own, whole.where(mine)))
        first = mine.stop
    return result


def tell(
    held: dict[tuple[int, int], Array], harmonics: list[int], count: int
) -> dict[int, list[int]]:
    """Per harmonic the places of its coupled modes, two for each of its ``count`` doublets.

    held: how much of the plain mode (n, k), k-th of harmonic n, is in each coupled mode (m,)
    by rising frequency.
    """
    seats = _seats(harmonics, count)
    looked = CANDIDATES_PER_MODE * len(seats) + 10
    overlap = np.array([held[seat][:looked] for seat in seats])
    taken = assigned(overlap)
    by_harmonic: dict[int, list[int]] = {n: [] for n in harmonics}
    for n in harmonics:
        for k in range(count):
            places = [int(t) for seat, t in zip(seats, taken, strict=True) if seat == (n, k)]
            by_harmonic[n] += sorted(places)
    return by_harmonic


def assigned(overlap: Array) -> Array:
    """The column (m,) of each row of ``overlap``, none twice, whose sum is the largest."""

    from scipy.optimize import linear_sum_assignment  # late: a third of a second

    columns: Array = linear_sum_assignment(overlap, maximize=True)[1]
    return columns


def _seats(harmonics: list[int], count: int) -> list[tuple[int, int]]:
    """Harmonic and place in it of every mode that is wanted, a doublet's twice."""
    return [(n, k) for n in harmonics for k in range(count) for _ in range(2 if n else 1)]


def split(
    n: int, values: Array, shapes: Array, combination: Combination | None = None
) -> HarmonicModes:
    """Modes that come two by two for n >= 1."""
    members = np.tile([1, 2], len(values) // 2) if n else None
    return HarmonicModes(n, values, shapes, members=members, combination=combination)
