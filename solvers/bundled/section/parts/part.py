"""Base class of the tyre's parts: energy, force, tangents, mass and form, and the same in 3-D; also
the blocks that a part is read from, the modes that its form belongs to, and their rows.

All that a step, a vibration or a slope needs of the tyre is a sum over its parts. State U (n, 3)
in m: displacements in the frame of the reference angle (see `elements`); energies per radian.
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Container
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ....language.text import Block, DeckError
from ..materials import Material, ModulusTable
from ..mesh import DeckMesh

Array = np.ndarray
IN_PLANE = np.diag([1.0, 1.0, 0.0])  # of the wheel
SPIN_AXIS = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # e_z x
Precision = type[np.floating[Any]]
Tangents = tuple[Array, Array | None, Array | None]
TOGETHER = 5  # modes whose gradients are formed at once


class TyrePart(ABC):
    """Rubber, cords, a pressure, ...; a new one is a subclass, or an `elastic.Elastic`."""

    connectivity: Array  # (e, a): nodes of each element
    mass: Array | None = None  # (e, a, a): consistent, kg per radian, of each component

    @abstractmethod
    def energy(self, U: Array) -> Any:
        """Share of the part in the potential, J per radian."""

    @abstractmethod
    def force(self, U: Array) -> Array:
        """Gradient of the energy by the elements' displacements (e, 3a), N per radian."""

    @abstractmethod
    def tangents(self, U: Array, harmonics: bool) -> Tangents:
        """K0, K1, K2 (e, 3a, 3a) of K(n) = K0 + i n K1 + n^2 K2, n the harmonic; None where one is
        zero or, except for K0, not requested."""

    @abstractmethod
    def at_stations(self, nodes: int) -> AtStations:
        """The part in three dimensions, in a section of so many nodes."""

    def frequency_dependent_part(self, table: int) -> TyrePart | None:
        """The part of its stiffness that scales with the modulus of table number ``table``; None:
        no part."""
        return None

    def material_part(self, compound: int, modulus: int) -> TyrePart | None:
        """The part of its stiffness that is proportional to a modulus (0: shear, 1: bulk) of the
        model's lossy material number ``compound``; None: no part."""
        return None

    def form(self, U: Array, fields: ModeShapes) -> Array:
        """phi^H K phi (m,) of the modes phi. K0 and K2 are symmetric, K1 antisymmetric, so that
        (a - i b)^T K(n) (a + i b) = a.K0 a + b.K0 b + n^2 (a.K2 a + b.K2 b) + 2 n b.K1 a."""
        K0, K1, K2 = self.tangents(U, harmonics=True)
        a, b = (
            np.moveaxis(part[:, self.connectivity].reshape(len(fields.n), *K0.shape[:2]), 0, -1)
            for part in (fields.real, fields.imag)
        )
        n = fields.n

        def form(left: Array, K: Array, right: Array) -> Array:
            return np.asarray((left * (K @ right)).sum((0, 1)))

        total = form(a, K0, a) + form(b, K0, b) + 0j
        if K1 is not None:
            total += 2 * n * form(b, K1, a)
        if K2 is not None:
            total += n * n * (form(a, K2, a) + form(b, K2, b))
        return fields.summed(total)


class AtStations(ABC):
    """A part at Gauss stations s round the tyre, about the last state that `force` was given.

    u, du (3n, s): displacements and their derivative by the angle at the stations.
    """

    def __init__(self, connectivity: Array, nodes: int):
        self.connectivity = connectivity
        self.dofs = (3 * connectivity[..., None] + np.arange(3)).reshape(len(connectivity), -1)
        from scipy.sparse import csr_matrix  # late: a section needs none of it

        size = self.dofs.size
        ones = (np.ones(size), (self.dofs.ravel(), np.arange(size)))
        self._assembly = csr_matrix(ones, shape=(3 * nodes, size))

    def gather(self, forces: Array) -> Array:
        """Sums (3n, s) at the nodes of the elements' forces (e, 3a, s)."""
        return np.asarray(self._assembly @ forces.reshape(self.dofs.size, -1))

    @abstractmethod
    def force(self, u: Array, du: Array) -> tuple[Array, Array]:
        """Gradients of the energy by u and by du (e, 3a, s). Raises Inverted."""

    @abstractmethod
    def energy(self) -> Array:
        """Energy at each station (s,), J per radian."""

    @abstractmethod
    def product(self, u: Array, du: Array) -> tuple[Array, Array]:
        """Changes of the forces by u and by du, (e, 3a, s) each, with small u and du."""

    @abstractmethod
    def tangents(self, precision: Precision) -> tuple[Array, Array, Array]:
        """Second derivatives by u u, u du and du du (s, e, 3a, 3a)."""


def of_each_component(M: Array, components: Array) -> Array:
    """Matrices (e, a, a) of scalars as (e, 3a, 3a), coupled by ``components`` (3, 3)."""
    e, a, _ = M.shape
    return np.einsum("eab,ij->eaibj", M, components).reshape(e, 3 * a, 3 * a)


def consistent_mass(N: Array, weights: Array) -> Array:
    """Element masses (e, a, a) from N (g, a) or (e, g, a) and weights (e, g), kg per radian."""
    if N.ndim == 3:
        return np.asarray((N * weights[..., None]).swapaxes(1, 2) @ N)
    return np.tensordot(weights, N[:, :, None] * N[:, None, :], 1)


def cross(a: Array, b: Array) -> Array:
    """a x b (..., 3) over the last axis; np.cross spends ten times as long on its arguments."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], -1)


@dataclass(frozen=True)
class Rows:
    """z = z0 + B0 u + B1 du/dTheta at Gauss points of elements of one kind (`elastic`)."""

    B0: Array  # (e, g, k, 3a): dz/du
    hoop: Array  # (e, g, a): B1 = dz/d(du/dTheta) (e, g, 3, 3a) is this on its three diagonals
    around: slice  # the three of the k rows that du/dTheta changes
    rest: Array  # z0 of the undeformed tyre, (k,) or (e, g, k)
    weights: Array  # (e, g): of the integral, m3 (solids) or m2 (lines) per radian

    @cached_property
    def B1(self) -> Array:
        """dz/d(du/dTheta) (e, g, 3, 3a) of the rows ``around``."""
        return on_diagonals(self.hoop)


def on_diagonals(values: Array) -> Array:
    """Rows (e, g, 3, 3a), each component of u times ``values`` (e, g, a)."""
    e, g, a = values.shape
    rows = np.zeros((e, g, 3, a, 3), values.dtype)
    for i in range(3):
        rows[:, :, i, :, i] = values
    return rows.reshape(e, g, 3, 3 * a)


class ModeShapes:
    """Modes as sums of shapes a + i b of harmonics n.

    modes: per mode n (p,), a and b (p, nodes, 3) of the p shapes that it is the sum of.
    """

    def __init__(self, n: Array, shapes: Array, owner: Array | None = None):
        """``owner`` (p,): the mode, from 0 on, that each of the shapes is part of; None: each is a
        mode."""
        self.n, self.shapes = n, shapes
        self._owner = np.arange(len(n)) if owner is None else owner
        self._set(shapes.real, shapes.imag)

    def _set(self, real: Array, imag: Array) -> None:
        self.complex = np.iscomplexobj(real)  # they carry a variable's tangent
        self.real, self.imag = real, imag  # a and b (p, nodes, 3) of all shapes
        own = [self._owner == j for j in range(self._owner.max() + 1)]
        self.modes = [(self.n[mine], real[mine], imag[mine]) for mine in own]
        self.known: list[tuple[Rows, Array]] = []

    def replaced(self, real: Array, imag: Array) -> ModeShapes:
        """The sums with other shapes."""
        other = copy.copy(self)
        other._set(real, imag)
        return other

    def summed(self, values: Array) -> Array:
        """Per mode (m, ...) the sum of its shapes' values (p, ...)."""
        total = np.zeros((len(self.modes), *values.shape[1:]), values.dtype)
        np.add.at(total, self._owner, values)
        return total

    def products(self, connectivity: Array, rows: Rows) -> Array:
        """G (m, e, g, k, k), sum of z z^T over a mode's shapes, real and imaginary: the form
        phi^H K phi is A : G. Rows without a tangent are all variables': G is remembered."""
        for own, G in self.known:
            same = own.B0 is rows.B0 or np.array_equal(own.B0, rows.B0)
            if same and (own.hoop is rows.hoop or np.array_equal(own.hoop, rows.hoop)):
                return G
        kind = np.result_type(rows.B0, rows.hoop, self.modes[0][1])
        G = np.empty((len(self.modes), *rows.B0.shape[:3], rows.B0.shape[2]), kind)
        for first in range(0, len(self.modes), TOGETHER):
            modes = self.modes[first : first + TOGETHER]
            n, a, b = (np.concatenate(own) for own in zip(*modes, strict=True))
            z = _gradients(connectivity, rows, a, b, n)
            ends = np.cumsum([len(own) for own, _, _ in modes])[:-1]
            for j, part in enumerate(np.split(z, ends, -1), first):
                columns = part.reshape(*rows.B0.shape[:3], -1)
                np.matmul(columns, columns.swapaxes(-1, -2), out=G[j])
        if not np.iscomplexobj(G):
            self.known.append((rows, G))
        return G


def contract(A: Array, G: Array) -> Array:
    """sum over Gauss points of A : G per mode; A (e, g, k, k), G (m, e, g, k, k)."""
    G, A = G.reshape(len(G), -1), A.reshape(-1)
    if np.iscomplexobj(G):
        return np.asarray(G @ A)
    return np.asarray(G @ A.real + 1j * (G @ A.imag))


def _gradients(connectivity: Array, rows: Rows, real: Array, imag: Array, n: Array) -> Array:
    """Real and imaginary parts of (B0 + i n B1)(a + i b), (e, g, k, 2, p)."""
    e, g, k, d = rows.B0.shape
    u = np.moveaxis(np.stack([real[:, connectivity], imag[:, connectivity]]), 1, -1)
    u = np.ascontiguousarray(np.moveaxis(u, 0, -2))  # (e, a, 3, 2, p)
    z = (rows.B0.reshape(e, g * k, d) @ u.reshape(e, d, -1)).reshape(e, g, k, 2, -1)
    around = (rows.hoop @ u.reshape(e, d // 3, -1)).reshape(e, g, 3, 2, -1) * n
    z[:, :, rows.around, 0] -= around[..., 1, :]
    z[:, :, rows.around, 1] += around[..., 0, :]
    return np.asarray(z)


def real_times(B: Array, z: Array) -> Array:
    """B @ z (e, k, 1) for columns z (e, d, 1); a real B is not made complex for complex ones."""
    if np.iscomplexobj(B) or not np.iscomplexobj(z):
        return np.asarray(B @ z)
    return np.asarray((B @ np.ascontiguousarray(z).view(float)).view(complex))


@dataclass(frozen=True)
class SectionJob:
    """A job's model, and the moduli that its rubber is to have."""

    keywords: list[Block]
    mesh: DeckMesh
    materials: dict[str, Material]
    # modulus tables whose rubber keeps its static modulus: the model scales it mode by mode
    tables: list[ModulusTable]
    lossy: list[Material]  # those with a loss factor
    dynamic_Hz: float | None  # at which the vibration's modulus is evaluated; None = static
    long_term: bool  # the static state is relaxed, else its moduli are the instantaneous ones
    used: dict[str, Material] = field(default_factory=dict)  # materials named so far

    def material(self, k: Block, name: str) -> Material:
        """A material that a keyword names. Raises DeckError."""
        if name not in self.materials:
            raise DeckError(k.place, f"material {name} is not defined")
        self.used[name] = self.materials[name]
        return self.used[name]

    def by_type(self, k: Block, kinds: Container[str]) -> dict[str, Array]:
        """The elements of a keyword's set: element type to rows (e,) of its block. Raises
        DeckError."""
        name = k.need("ELSET")
        if name not in self.mesh.element_sets:
            raise DeckError(k.place, f"element set {name} is not defined")
        rows: dict[str, list[int]] = {}
        for number in self.mesh.element_sets[name]:
            kind, position = self.mesh.place[number]
            if self.mesh.type_of(kind) not in kinds:
                raise DeckError(k.place, f"element {number} of type {kind} cannot have *{k.name}")
            rows.setdefault(kind, []).append(position)
        return {kind: np.array(r) for kind, r in rows.items()}
