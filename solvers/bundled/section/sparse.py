"""Sparse matrices by rows, and a narrow order of the nodes of a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from .compiled import compiled

Array = np.ndarray
_add_products = compiled("scipy.sparse._sparsetools").csr_matvecs


@dataclass(frozen=True)
class Sparse:
    """A square matrix: its entries (k,) row by row, their columns (k,), and where each of the n
    rows begins among them, and the last ends (n + 1,)."""

    entries: Array
    columns: Array
    starts: Array

    @classmethod
    def assembled(cls, parts: list[tuple[Array, Array]], n: int) -> Sparse:
        """(n, n) from connectivities (e, a) with matrices (e, a, a)."""
        rows = np.concatenate([np.repeat(c, c.shape[1], 1).ravel() for c, _ in parts])
        columns = np.concatenate([np.tile(c, (1, c.shape[1])).ravel() for c, _ in parts])
        return cls._summed(rows, columns, np.concatenate([m.ravel() for _, m in parts]), n)

    @classmethod
    def _summed(cls, rows: Array, columns: Array, values: Array, n: int) -> Sparse:
        places, where = np.unique(rows * n + columns, return_inverse=True)
        entries = np.bincount(where, values.real, len(places))
        if np.iscomplexobj(values):
            entries = entries + 1j * np.bincount(where, values.imag, len(places))
        starts = np.searchsorted(places, n * np.arange(n + 1))
        return cls(entries, (places % n).astype(np.int32), starts.astype(np.int32))

    def __matmul__(self, x: Array) -> Array:
        """A x for (n,) or (n, b), either real or complex."""
        if np.iscomplexobj(self.entries):
            real = Sparse(self.entries.real.copy(), self.columns, self.starts)
            return np.asarray(real @ x + 1j * (self.imag @ x))
        kind = complex if np.iscomplexobj(x) else float
        n, right = len(self.starts) - 1, np.ascontiguousarray(x, kind).view(float).ravel()
        product = np.zeros(right.shape)
        k = len(right) // n
        _add_products(n, n, k, self.starts, self.columns, self.entries, right, product)
        return np.asarray(product.view(kind).reshape(x.shape))

    def __sub__(self, other: Sparse) -> Sparse:
        rows = np.append(self._rows, other._rows)
        columns = np.append(self.columns, other.columns)
        values = np.append(self.entries, -other.entries)
        return Sparse._summed(rows, columns, values, len(self.starts) - 1)

    @property
    def _rows(self) -> Array:
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))

    @property
    def imag(self) -> Sparse:
        """The imaginary parts, without those that are zero."""
        keep = self.entries.imag != 0
        starts = np.append(0, np.cumsum(keep))[self.starts].astype(np.int32)
        return Sparse(self.entries.imag[keep], self.columns[keep], starts)

    def diagonal(self) -> Array:
        """Entries (n,) on the diagonal; 0 where there is none."""
        diagonal = np.zeros(len(self.starts) - 1, self.entries.dtype)
        on = self._rows == self.columns
        diagonal[self.columns[on]] = self.entries[on]
        return diagonal


def narrow_order(pairs: Array, n: int) -> Array:
    """Nodes (n,) in the reverse order of Cuthill and McKee: neighbours stand near each other.

    pairs (k, 2): nodes that share an element (George and Liu, Computer Solution of Large Sparse
    Positive Definite Systems, sec. 4.3).
    """
    return np.array(_narrow_order(np.ascontiguousarray(pairs, np.int64).tobytes(), n))


@lru_cache(maxsize=8)  # of the same mesh from one evaluation to the next
def _narrow_order(pairs: bytes, n: int) -> list[int]:
    beside: list[set[int]] = [set() for _ in range(n)]
    for i, j in np.frombuffer(pairs, np.int64).reshape(-1, 2).tolist():
        beside[i].add(j)
    degree = [len(each) for each in beside]
    order: list[int] = []
    seen = [False] * n
    for first in sorted(range(n), key=degree.__getitem__):
        if seen[first]:
            continue
        seen[first] = True
        order.append(first)
        place = len(order) - 1
        while place < len(order):
            following = [j for j in beside[order[place]] if not seen[j]]
            for j in following:
                seen[j] = True
            order += sorted(following, key=lambda j: (degree[j], j))
            place += 1
    return order[::-1]
