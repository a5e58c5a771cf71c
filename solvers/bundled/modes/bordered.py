"""Unknowns of a harmonic in addition to the tyre's own: motions q of the rim, flow w of the
cavity's air.

    [K   Kx  .   C^T] [u]   [b]        q: see `wheel`; u of the rim's nodes is T q
    [Kx* Kq  .   Cq*] [q] = [b]        w, s: see `cavity`; s = Q^-1 (C u + H w) is an unknown so
    [.   .   .   H^T] [w]   [b]        that the air's stiffness, a full matrix on all nodes of
    [C   Cq  H   -Q ] [s]   [0]        its wall, leaves the band as it is

    *: conjugate transpose. Kx = K T of the rim's nodes, Kq = T* K T + the wheel's own springs; the
    same for the mass.
    C u, Cq q: volume that the wall and the rim sweep, weighted by the terms of the pressure.
    H, Q: stiffness 1/rho int grad . grad and compressibility 1/B int of the air's pressure terms;
    w* H w is the kinetic energy of the flow, so H is its mass, too.

K (size, size) is the tyre's banded stiffness, less shift times its mass; shift = omega^2, 1/s2. The
further rows and columns are eliminated by their Schur complement. q, w and s are also the numbers
of these unknowns; b right sides are solved at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import Indefinite
from ..section.kept_fields import Coordinates, Factor
from ..section.mechanics import OfElements
from ..section.symmetry import Whole
from .cavity import GasCoupling

Array = np.ndarray


@dataclass(frozen=True)
class Border:
    """Rows and columns of the unknowns q, w and s next to the band."""

    fields: Array  # T (nodes, 3, q)
    stiffness: tuple[Array, Array]  # Kx (size, q), Kq (q, q)
    mass: tuple[Array, Array]  # of the same shapes
    wall: Array  # C (s, size)
    wall_rim: Array  # Cq (s, q)
    air: GasCoupling | None  # None: no air, w = s = 0

    @property
    def widths(self) -> tuple[int, int, int]:
        """Numbers of q, of w, and of s."""
        if self.air is None:
            return self.fields.shape[2], 0, 0
        flow = self.air.H[:, self.air.flowing]
        return self.fields.shape[2], flow.shape[1], flow.shape[0]

    @property
    def flow_mass(self) -> Array:
        """H (w, w) of the terms w of the flow: its mass, m4/kg per radian, as w is in kg/m. For a
        tyre with air."""
        assert self.air is not None
        flow: Array = self.air.H[self.air.flowing, self.air.flowing]
        return flow

    def columns(self, shift: float) -> tuple[Array, Array]:
        """E (size, q + w + s) and D (q + w + s, q + w + s) next to the band of K - shift M."""
        q, w, s = self.widths
        k = q + w
        E = np.zeros((len(self.stiffness[0]), k + s), self.stiffness[0].dtype)
        D = np.zeros((k + s, k + s), E.dtype)
        E[:, :q] = self.stiffness[0] - shift * self.mass[0]
        D[:q, :q] = self.stiffness[1] - shift * self.mass[1]
        if self.air is not None:
            flow = self.air.H[:, self.air.flowing]
            E[:, k:] = self.wall.T
            D[k:, :q], D[k:, q:k], D[k:, k:] = self.wall_rim, flow, -self.air.Q
            D[:k, k:] = D[k:, :k].conj().T
            D[q:k, q:k] = -shift * self.flow_mass
        return E, D

    def times_mass(self, x: Array, tyre: Array) -> Array:
        """M x for x (size + q + w, ...), ``tyre`` being M u of its first part."""
        q, w, _ = self.widths
        size = len(tyre)
        u, rim, flow = x[:size], x[size : size + q], x[size + q :]
        across, own = self.mass
        parts = [tyre + across @ rim, across.conj().T @ u + own @ rim]
        if w:
            parts.append(self.flow_mass @ flow)
        return np.concatenate(parts)


class Bordered:
    """Factor of the band of K - shift M with its border; ``tyre``: factor of the band alone.

    Raises Indefinite.
    """

    def __init__(self, tyre: Factor, border: Border, shift: float):
        self.tyre = tyre
        self._columns, D = border.columns(shift)
        self._inner = tyre.solve(self._columns) if D.size else self._columns
        self._schur = D - self._columns.conj().T @ self._inner
        q, w, s = border.widths
        self._size, self._extra = len(self._columns), q + w
        own = self._schur[: q + w, : q + w]
        if s:  # s is negative definite by itself
            mixed = self._schur[q + w :, : q + w]
            own = own - mixed.conj().T @ np.linalg.solve(self._schur[q + w :, q + w :], mixed)
        scale = np.sqrt(abs(np.diag(own)))
        try:
            np.linalg.cholesky(own / np.outer(scale, scale))
        except np.linalg.LinAlgError:
            raise Indefinite("the wheel or the air has no stiffness") from None

    def solve(self, right: Array) -> Array:
        """u, q and w (size + q + w, b) for the right sides (size + q + w, b)."""
        x = self.tyre.solve(right[: self._size])
        if not self._schur.size:
            return x
        rest = np.zeros((len(self._schur), *right.shape[1:]), x.dtype)
        rest[: self._extra] = right[self._size :]
        d = np.linalg.solve(self._schur, rest - self._columns.conj().T @ x)
        return np.concatenate([x - self._inner @ d, d[: self._extra]])


def assemble(
    numbering: Coordinates,
    symmetry: Whole,
    fields: Array,
    own: tuple[Array, Array],
    stiffness: Array,
    mass: Array,
    air: GasCoupling | None,
) -> Border:
    """Assemble the border from the rim's ``fields`` T (nodes, 3, q), K T and M T (nodes, 3, q), and
    the wheel's own stiffness and mass (q,)."""
    on_band = numbering.gather(stiffness)
    real = np.isrealobj(on_band)  # on half of the section products of kept fields are real

    def product(left: Array, right: Array) -> Array:
        whole = np.tensordot(left, right, ((0, 1), (0, 1)))
        return np.asarray(whole.real if real else whole)

    none = np.zeros((0, numbering.size))
    wall = symmetry.kept(np.moveaxis(air.C, 0, -1)) if air else None
    return Border(
        fields,
        (on_band, product(fields.conj(), stiffness) + np.diag(own[0])),
        (numbering.gather(mass), product(fields.conj(), mass) + np.diag(own[1])),
        none if wall is None else numbering.gather(wall).T,
        none[:, : fields.shape[2]] if wall is None else product(wall.conj(), fields),
        air,
    )


def apply(parts: OfElements, fields: Array) -> Array:
    """Element matrices times k fields (nodes, 3, k), which are zero at most nodes."""
    touched: Array = np.asarray(fields.any((1, 2)))
    image = np.zeros_like(fields)
    for connectivity, matrices in parts:
        near = touched[connectivity].any(1)
        c = connectivity[near]
        columns = fields.shape[2]  # -1 would be ambiguous if no element of a type is near
        local = matrices[near] @ fields[c].reshape(len(c), 3 * c.shape[1], columns)
        np.add.at(image, c, local.reshape(*c.shape, 3, columns))
    return image
