"""Symmetric and Hermitian banded matrices: numbering, storage and Cholesky factors (LAPACK).

SciPy and NumPy each have a copy of OpenBLAS, which takes a buffer of 32 MB in its first call and
keeps it. Without memory for it OpenBLAS tries for ever: importing this file makes both calls.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack
from scipy.sparse import csr_array

from ...errors import Indefinite
from .sparse import narrow_order

Array = np.ndarray
BUFFER_BYTES = 1 << 26  # twice a buffer of OpenBLAS


def take_buffers() -> None:
    """Let both copies of OpenBLAS take their buffers. Raises MemoryError if there is no memory."""
    for first_call in (
        lambda: lapack.dpbtrs(np.ones((1, 1)), np.ones(1)),
        lambda: np.linalg.solve(np.ones((1, 1)), np.ones(1)),
    ):
        np.empty(BUFFER_BYTES, np.uint8)  # raises; its pages are never touched
        first_call()


take_buffers()


class Numbering:
    """Numbers of the equations of the free displacement components.

    Nodes have the deck's order or that of reverse Cuthill and McKee, whichever gives the narrower
    band; it is reversed if that brings the nodes of the mask ``end`` (n,) nearer to its end:
    `kept_fields` couples the last equations with the middle plane.
    ``equation`` (n, 3): equation of each component; a held one has ``size``, a spare equation that
    is dropped. ``bandwidth``: sub-diagonals; ``order``: flat component of each equation.
    """

    def __init__(self, connectivities: list[Array], free: Array, end: Array | None = None):
        n = len(free)
        rows = np.concatenate([np.repeat(c, c.shape[1], 1).ravel() for c in connectivities])
        cols = np.concatenate([np.tile(c, (1, c.shape[1])).ravel() for c in connectivities])
        touching = np.asarray(free.any(1))
        keep = touching[rows] & touching[cols]
        pairs = np.sort(rows[keep] * n + cols[keep])
        pairs = pairs[np.diff(pairs, prepend=-1) > 0]  # np.unique loads NumPy's masked arrays
        pairs = np.stack([pairs // n, pairs % n], 1)
        orders = [np.arange(n), narrow_order(pairs, n)]
        nodes = min(orders, key=lambda order: _largest_distance(pairs, order))
        if end is not None:
            there = np.flatnonzero(end[nodes[touching[nodes]]])
            if 2 * there.sum() < len(there) * touching.sum():  # on average nearer to the first node
                nodes = nodes[::-1]
        flat = (3 * nodes[:, None] + np.arange(3)).ravel()
        self.order = flat[free.ravel()[flat]]
        self.size = len(self.order)
        equation = np.full(3 * n, self.size)
        equation[self.order] = np.arange(self.size)
        self.equation = equation.reshape(n, 3)
        self._scatter: dict[bytes, tuple[Array, Array]] = {}
        self.bandwidth = 0
        for c in connectivities:
            e = self.elements(c)
            held = e == self.size
            span = np.where(held, -1, e).max(1) - np.where(held, self.size, e).min(1)
            self.bandwidth = max(self.bandwidth, int(span.max(initial=0)))

    def elements(self, connectivity: Array) -> Array:
        """Equations (e, 3a) of the elements' components."""
        return self.equation[connectivity].reshape(len(connectivity), -1)

    def lower(self, connectivity: Array) -> tuple[Array, Array]:
        """Indices (k,) of the flat entries of element matrices that are assembled, and of their
        places (k,) in the flat band."""
        key = connectivity.tobytes()
        if key not in self._scatter:
            e = self.elements(connectivity)
            i = np.repeat(e[:, :, None], e.shape[1], 2)
            j = i.swapaxes(1, 2)
            entries = np.flatnonzero((i >= j) & (i < self.size))
            place = (i - j + (self.bandwidth + 1) * j).ravel()[entries]
            self._scatter[key] = entries, place
        return self._scatter[key]

    def assemble(self, parts: list[tuple[Array, Array]]) -> Array:
        """Lower band (bandwidth + 1, size), Fortran order, of parts: connectivity (e, a), matrices
        (e, 3a, 3a)."""
        length = (self.bandwidth + 1) * self.size
        band = np.zeros(length)
        for connectivity, matrices in parts:
            entries, place = self.lower(connectivity)
            band += np.bincount(place, matrices.reshape(-1)[entries], length)
        return band.reshape((self.bandwidth + 1, self.size), order="F")

    def vector(self, parts: list[tuple[Array, Array]]) -> Array:
        """Assembled vector (size,), real or complex, of (connectivity, element vectors)."""
        total = np.zeros(self.size + 1, np.result_type(*(v for _, v in parts)))
        for connectivity, values in parts:
            np.add.at(total, self.elements(connectivity), values)
        return total[:-1]

    def spread(self, vectors: Array) -> Array:
        """Vectors (size, ...) on the equations to all components (n, 3, ...), zero where held."""
        full = np.zeros((self.equation.size, *vectors.shape[1:]), vectors.dtype)
        full[self.order] = vectors
        return full.reshape(-1, 3, *vectors.shape[1:])

    def gather(self, full: Array) -> Array:
        """Components (n, 3, ...) to equations (size, ...)."""
        return full.reshape(self.equation.size, *full.shape[2:])[self.order]

    def apart(self, full: Array) -> Array:
        """Coordinates (size, ...) whose span has the fields (n, 3, ...): those of `gather`, except
        in `kept_fields`."""
        return self.gather(full)

    @property
    def free(self) -> Array:
        """Mask (n, 3) of the free components."""
        return np.asarray(self.equation < self.size)

    def factor(self, band: Array) -> Cholesky:
        """Factor of an assembled band, which it overwrites. Raises Indefinite."""
        return Cholesky(band)

    def times(self, mass: csr_array, x: Array) -> Array:
        """M x for x (size,) or (size, b); ``mass`` (n, n) applies to each component."""
        full = self.spread(x)
        return self.gather((mass @ full.reshape(len(full), -1)).reshape(full.shape))


def _largest_distance(pairs: Array, order: Array) -> int:
    """Largest distance of two connected nodes in an order; pairs (p, 2)."""
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    return int(abs(np.diff(place[pairs])).max(initial=0))


class Cholesky:
    """Factor of a symmetric or Hermitian positive definite lower band, which it overwrites.

    Raises Indefinite.
    """

    def __init__(self, band: Array):
        self._solve = lapack.zpbtrs if np.iscomplexobj(band) else lapack.dpbtrs
        factorise = lapack.zpbtrf if np.iscomplexobj(band) else lapack.dpbtrf
        self._factor, info = factorise(band, lower=1, overwrite_ab=1)
        if info:
            raise Indefinite(f"pivot {info} of {band.shape[1]} is not positive")

    def solve(self, right: Array) -> Array:
        """K^-1 right for (size,) or (size, b)."""
        return np.asarray(self._solve(self._factor, right, lower=1)[0])
