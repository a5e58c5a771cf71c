"""Sparse matrices of element matrices, and a narrow order of the nodes of a mesh."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array

Array = np.ndarray


def assembled(parts: list[tuple[Array, Array]], n: int) -> csr_array:
    """The sum (n, n) of element matrices (e, a, a) with connectivities (e, a)."""
    rows = np.concatenate([np.repeat(c, c.shape[1], 1).ravel() for c, _ in parts])
    columns = np.concatenate([np.tile(c, (1, c.shape[1])).ravel() for c, _ in parts])
    values = np.concatenate([m.ravel() for _, m in parts])
    places, where = np.unique(rows * n + columns, return_inverse=True)
    entries = np.bincount(where, values.real, len(places))
    if np.iscomplexobj(values):
        entries = entries + 1j * np.bincount(where, values.imag, len(places))
    starts = np.searchsorted(places, n * np.arange(n + 1))
    return csr_array((entries, places % n, starts), (n, n))


def narrow_order(pairs: Array, n: int) -> Array:
    """Nodes (n,) in the reverse order of Cuthill and McKee: neighbours stand near each other.

    pairs (k, 2): nodes that share an element (George and Liu, Computer Solution of Large Sparse
    Positive Definite Systems, sec. 4.3).
    """
    return np.array(_narrow_order(np.ascontiguousarray(pairs, np.int64).tobytes(), n))


@lru_cache(maxsize=8)  # of the same mesh from one evaluation to the next
def _narrow_order(pairs: bytes, n: int) -> list[int]:
    """Order of Cuthill and McKee of n nodes, from pairs (k, 2) as bytes."""
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
