"""Vibrations on half of the section: fields that half turn and conjugation keep (`symmetry`).

Unknowns are c on z > 0, complex, and (a_r, b_theta, b_z) on the middle plane, real, all scaled so
that they are coordinates in an orthonormal basis of the kept fields of the whole section: products
of fields and forces are those of the coordinates. With z > 0 first, the middle plane last,

    [K   E] [c]   [f]       L L^H = K,   W = L^-1 E,   S = Re(D - W^H W)
    [E^H D] [m] = [g]       S m = g - Re(W^H L^-1 f),  c = L^-H (L^-1 f - W m)

The band of L is that of half as many unknowns. Real and imaginary parts alternate in a coordinate
vector, so that vector and K are real in them. Imaginary parts on the middle plane are zero. K is
that of one harmonic. Shapes: s equations of c, of which E couples the last ``near``, m of the
middle plane, k columns.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack
from scipy.sparse import csr_array

from ...errors import Indefinite
from .band import Cholesky, Numbering
from .mechanics import OfElements
from .symmetry import MirrorHalf

Array = np.ndarray
ROOT2 = 2**0.5


class KeptFields:
    """Coordinates (size,) of kept fields (n, 3), as a `Numbering` has them of any field.

    free (n, 3): components on z >= 0 that are free.
    """

    def __init__(self, connectivities: list[Array], free: Array, symmetry: MirrorHalf):
        self.symmetry, middle = symmetry, symmetry.middle
        adjacent = np.zeros_like(middle)  # nodes that share an element with the middle plane
        for rows in connectivities:
            adjacent[rows[middle[rows].any(1)]] = True
        adjacent &= ~middle
        inner = Numbering(connectivities, free & ~middle[:, None], adjacent)
        on_plane = np.flatnonzero(free & middle[:, None])
        self._inner, self._order = inner, np.concatenate([inner.order, on_plane])
        self.size, m = 2 * len(self._order), len(on_plane)
        first = inner.equation[adjacent].min(initial=inner.size)
        # row in the corner [E, D]: of the last equations of the band, then of the middle plane
        self._corner = np.full(free.size, -1)
        self._corner[self._order[first:]] = np.arange(len(self._order) - first)
        self._near = inner.size - int(first)
        self._scatter: dict[bytes, tuple[Array, Array]] = {}
        # value of a component whose coordinate is 1: a node and its image share it, but one on the
        # middle plane is its own; factor on both sides of M, of which half is here on that plane
        self._length, self._weight = np.full((2, len(self._order), 1), [[[1 / ROOT2]], [[1.0]]])
        self._length[inner.size :], self._weight[inner.size :] = 1.0, ROOT2
        real = self._order % 3 == 0
        self._phase = np.where(real, 1.0, 1j)[inner.size :]
        nil = np.stack([~real, real], 1)
        nil[: inner.size] = False
        self._nil = np.flatnonzero(nil)  # coordinates that are zero
        self.free = np.zeros(free.size, bool)  # mask (n, 3) of the free components, of both sides
        self.free[self._order] = True
        self.free = self.free.reshape(free.shape) | self.free.reshape(free.shape)[symmetry.other]
        # columns of the band's array that hold the corner
        self._columns = -(-(self._near + m) * m // (inner.bandwidth + 1))

    def assemble(self, parts: OfElements) -> Array:
        """Lower band of z > 0 with, in more columns, the corner [E, D] (near + m, m): a real array
        that is Fortran-ordered."""
        shape = self._inner.bandwidth + 1, self._inner.size + self._columns
        band = np.zeros(shape[0] * shape[1])
        for connectivity, matrices in parts:
            entries, place = self._places(connectivity)
            band += np.bincount(place, matrices.reshape(-1)[entries], len(band))
        return band.reshape(shape, order="F")

    def _places(self, connectivity: Array) -> tuple[Array, Array]:
        """As `Numbering.lower`."""
        key = connectivity.tobytes()
        if key not in self._scatter:
            entries, place = self._inner.lower(connectivity)
            dofs = (3 * connectivity[..., None] + np.arange(3)).reshape(len(connectivity), -1)
            i = np.repeat(self._corner[dofs][:, :, None], dofs.shape[1], 2)
            j = i.swapaxes(1, 2) - self._near
            more = np.flatnonzero((i >= 0) & (j >= 0))
            beyond = (self._inner.bandwidth + 1) * self._inner.size
            corner = beyond + (i * len(self._phase) + j).ravel()[more]
            self._scatter[key] = np.append(entries, more), np.append(place, corner)
        return self._scatter[key]

    def spread(self, x: Array) -> Array:
        """The field c (n, 3, ...) of coordinates (size, ...)."""
        c = _complex(x.reshape(self.size, -1)) * self._length
        return self.symmetry.field(self._spread(c, x.shape))

    def _spread(self, values: Array, shape: tuple[int, ...]) -> Array:
        """Values (equations, k) on all components (n, 3, ...) of z >= 0."""
        full = np.zeros((self.free.size, values.shape[1]), values.dtype)
        full[self._order] = values
        return full.reshape(-1, 3, *shape[1:])

    def gather(self, u: Array) -> Array:
        """Coordinates (size, ...) of a kept field (n, 3, ...), or of any that is real."""
        c = self.symmetry.kept(u).reshape(self.free.size, -1)[self._order] / self._length
        return self._zeroed(np.stack([c.real, c.imag], 1), u.shape[2:])

    def apart(self, u: Array) -> Array:
        """Coordinates (size, 2 k) of real fields (n, 3, k): of their kept parts, then of their
        reversed parts. Together they span the fields in every harmonic."""
        turned = self.symmetry.turned(u)
        return np.hstack([self.gather((u + turned) / 2), self.gather((u - turned) / 2)])

    def times(self, mass: csr_array, x: Array) -> Array:
        """M x; ``mass`` (n, n): of half the section."""
        pairs = x.reshape(len(self._order), -1) * self._weight
        full = self._spread(pairs, pairs.shape)
        image = (mass @ full.reshape(len(full), -1)).reshape(self.free.size, -1)[self._order]
        return self._zeroed((image * self._weight).reshape(len(image), 2, -1), x.shape[1:])

    def _zeroed(self, pairs: Array, shape: tuple[int, ...]) -> Array:
        """Coordinates (size, *shape) of pairs (equations, 2, k)."""
        x = pairs.reshape(self.size, -1)
        x[self._nil] = 0.0
        return x.reshape(self.size, *shape)

    def factor(self, band: Array) -> KeptCholesky:
        """Factor of an assembled band, which it overwrites. Raises Indefinite."""
        m, size = len(self._phase), self._inner.size
        corner = band[:, size:].ravel("F")[: (self._near + m) * m].reshape(-1, m)
        return KeptCholesky(band[:, :size], corner, self._phase)


def _complex(x: Array) -> Array:
    """A copy of pairs of rows (size, k) as complex rows, Fortran-ordered."""
    return np.array(x.T, order="C").view(complex).T


class KeptCholesky:
    """Factor of K as above: of its band (bandwidth + 1, s), which it overwrites, and its
    ``corner``: E of the band's last equations, over D. phase (m,): 1 or i; times a real coordinate
    it is the field on the middle plane. Raises Indefinite.
    """

    def __init__(self, band: Array, corner: Array, phase: Array):
        self._phase = phase
        near = len(corner) - len(phase)
        root = ROOT2 * phase
        E = corner[:near] * root
        D = (root.conj()[:, None] * corner[near:] * root).real
        factorise = lapack.zpbtrf if np.iscomplexobj(band) else lapack.dpbtrf
        self._factor, info = factorise(band, lower=1, overwrite_ab=1)
        if info:
            raise Indefinite(f"pivot {info} of {band.shape[1]} is not positive")
        self._near = slice(band.shape[1] - near, None)
        self._W = _substituted(self._factor[:, self._near], E, "N")
        self._schur, info = lapack.dpotrf(D - (self._W.conj().T @ self._W).real, lower=1)
        if info:
            raise Indefinite("a pivot of the middle plane is not positive")

    def solve(self, right: Array) -> Array:
        """K^-1 right for coordinates (size,) or (size, b)."""
        y, s = _complex(right.reshape(len(right), -1)), self._factor.shape[1]
        f = _substituted(self._factor, y[:s], "N")
        g = (self._phase.conj()[:, None] * y[s:]).real
        left = g - (self._W.conj().T @ f[self._near]).real
        m = lapack.dpotrs(self._schur, left, lower=1)[0]
        f[self._near] -= self._W @ m
        y[:s], y[s:] = _substituted(self._factor, f, "C"), self._phase[:, None] * m
        return y.T.view(float).T.reshape(right.shape)


def _substituted(factor: Array, right: Array, trans: str) -> Array:
    """L^-1 ("N") or L^-H ("C") times a complex block (s, k)."""
    if np.iscomplexobj(factor):
        right = np.array(right, order="F")
        return lapack.ztbtrs(factor, right, uplo="L", trans=trans, overwrite_b=1)[0]
    k = right.shape[1]
    parts = np.concatenate([right.real.T, right.imag.T]).T
    x = lapack.dtbtrs(factor, parts, uplo="L", trans=trans, overwrite_b=1)[0]
    return x[:, :k] + 1j * x[:, k:]


Coordinates = Numbering | KeptFields
Factor = Cholesky | KeptCholesky
