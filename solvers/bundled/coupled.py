"""Modes of a tyre that is not quite axisymmetric: its harmonics are coupled.

Ritz's method on fields sum over n of Re[c_n U_n(R, Z) exp(i n Theta)]: the axisymmetric tyre's
own modes, and its static response to what breaks the symmetry. What was a doublet splits into two
modes of different frequency; each is told by the doublet that it holds most of.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from .attached import Attached
from .harmonics import HarmonicModes, Vibration

Array = np.ndarray
CANDIDATES = 3  # coupled modes looked at for every one wanted
NEAR = 4  # harmonics beyond the highest wanted whose modes may lie close to wanted ones
NEGLIGIBLE = 1e-9  # share of the static response that a direction may hold to be left out


@dataclass
class Family:
    """Fields of harmonic n that diagonalise K(n) and M: eigenvalues (k,), shapes (k, nodes, 3),
    u^H M u = 1 per radian, the lowest first."""

    n: int
    eigenvalues: Array
    shapes: Array

    @property
    def whole(self) -> float:
        """Square of the factor from unit mass per radian to unit mass of the whole circle."""
        return 1 / np.pi if self.n else 1 / (2 * np.pi)


class Basis:
    """Real fields: for each family c = 1, and for n >= 1 then c = i."""

    def __init__(self, families: list[Family]):
        self.families = families
        self.place = []  # (family, index in it, c)
        for f, family in enumerate(families):
            for c in (1.0, 1j) if family.n else (1.0,):
                self.place += [(f, k, c) for k in range(len(family.eigenvalues))]
        self.eigenvalues = np.array([families[f].eigenvalues[k] for f, k, _ in self.place])

    def at_zero(self, attached: Attached) -> Array:
        """Displacement (d, fields) of the attached components."""
        columns = []
        for family in self.families:
            pick = family.shapes[:, attached.rows, attached.components].T
            pick = pick * np.sqrt(family.whole) * attached.share(family.n)
            columns += [pick.real, -pick.imag] if family.n else [pick.real]
        return np.hstack(columns)


def attached_modes(
    vibration: Vibration,
    attached: Attached,
    harmonics: list[int],
    count: int,
    check: Callable[[], None] = lambda: None,
    highest: int | None = None,
) -> list[HarmonicModes]:
    """The ``count`` lowest modes of each harmonic with masses and springs on the tyre.

    K + k p p^T and M + m p p^T, p the displacement that carries k or m; ``highest``: harmonic of
    the sum, as a rule the highest one that the sectors carry. Raises Unstable, NotConverged.
    """
    families = []
    top = attached.highest if highest is None else highest
    for n in range(max([top, *harmonics]) + 1):
        check()
        own = count + 1 if n <= max(harmonics) + NEAR else 0
        families.append(_with_response(vibration, n, own, attached))
    basis = Basis(families)
    p = basis.at_zero(attached)
    K = np.diag(basis.eigenvalues) + p.T @ (attached.stiffness[:, None] * p)
    M = np.eye(len(K)) + p.T @ (attached.mass[:, None] * p)
    return named(basis, *eigh(K, M), harmonics, count)


def _with_response(vibration: Vibration, n: int, count: int, attached: Attached) -> Family:
    """Modes of harmonic n and the static response to unit forces on the attached components."""
    factor, numbering = vibration.factor(n), vibration.numbering
    force = np.zeros((*numbering.equation.shape, len(attached.rows)), complex if n else float)
    force[attached.rows, attached.components, range(len(attached.rows))] = 1.0
    force = numbering.gather(force)
    response = factor.solve(force)
    gives, directions = np.linalg.eigh(force.conj().T @ response)
    directions = directions[:, gives > NEGLIGIBLE * gives[-1]]
    vectors = response @ directions
    images = force @ directions + vibration.shift * vibration.times_mass(vectors)
    if count:
        modes = vibration.modes(n, count, factor)
        own = numbering.gather(np.moveaxis(modes.shapes, 0, -1))
        vectors = np.hstack([own, vectors])
        images = np.hstack([vibration.times_mass(own) * modes.eigenvalues, images])
    return ritz(vibration, n, vectors, images)


def ritz(vibration: Vibration, n: int, vectors: Array, images: Array) -> Family:
    """Fields spanned by ``vectors`` (size, k), K(n) times which is ``images``, made diagonal."""
    masses = vibration.times_mass(vectors)
    size = np.sqrt(np.einsum("ik,ik->k", vectors.conj(), masses).real)
    vectors, masses, images = vectors / size, masses / size, images / size
    gram, turn = np.linalg.eigh(vectors.conj().T @ masses)
    turn = turn[:, gram > 1e-12] / np.sqrt(gram[gram > 1e-12])
    K = turn.conj().T @ (vectors.conj().T @ images) @ turn
    values, inner = np.linalg.eigh((K + K.conj().T) / 2)
    shapes = vibration.numbering.spread(vectors @ (turn @ inner))
    return Family(n, values, np.moveaxis(shapes, -1, 0))


def named(
    basis: Basis, values: Array, vectors: Array, harmonics: list[int], count: int
) -> list[HarmonicModes]:
    """Coupled modes, eigenvalues (m,) rising and vectors (fields, m), by the plain modes of
    which they hold most; of a doublet's two the lower comes first."""
    held: dict[tuple[int, int], Array] = {}
    for row, (f, k, _) in enumerate(basis.place):
        key = basis.families[f].n, k
        held[key] = held.get(key, 0.0) + vectors[row] ** 2
    told = tell(held, harmonics, count)
    result = []
    for family in basis.families:
        if family.n not in harmonics:
            continue
        mine = told[family.n]
        rows = [i for i, (f, _, _) in enumerate(basis.place) if basis.families[f] is family]
        weights = np.array([basis.place[i][2] for i in rows])
        fields = family.shapes[[basis.place[i][1] for i in rows]]
        shapes = np.tensordot((weights[:, None] * vectors[rows][:, mine]).T, fields, 1)
        result.append(split(family.n, values[mine], shapes))
    return result


def tell(
    held: dict[tuple[int, int], Array], harmonics: list[int], count: int
) -> dict[int, list[int]]:
    """Per harmonic the places of its coupled modes, two for each of its ``count`` doublets.

    held: how much of the plain mode (n, k), k-th of harmonic n, is in each coupled mode (m,)
    by rising frequency.
    """
    seats = [(n, k) for n in harmonics for k in range(count) for _ in range(2 if n else 1)]
    looked = CANDIDATES * len(seats) + 10
    overlap = np.array([held[seat][:looked] for seat in seats])
    _, taken = linear_sum_assignment(overlap, maximize=True)
    told: dict[int, list[int]] = {n: [] for n in harmonics}
    for n in harmonics:
        for k in range(count):
            places = [
                int(t) for seat, t in zip(seats, taken, strict=True) if seat == (n, k)
            ]
            told[n] += sorted(places)
    return told


def split(n: int, values: Array, shapes: Array) -> HarmonicModes:
    """Modes that come two by two for n >= 1."""
    members = np.tile([1, 2], len(values) // 2) if n else None
    return HarmonicModes(n, values, shapes, members=members)
