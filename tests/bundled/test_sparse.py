"""Sparse matrices and narrow orders against SciPy's, which are compiled in other packages."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee
from tyrecal_solvers.bundled.section.sparse import assembled, narrow_order

from ..chance import generator
from . import support

Array = np.ndarray
NODES = 30


def drawn(kind: type) -> tuple[csr_array, Array]:
    """Elements of three nodes each, some twice, and the same matrix with all its zeros."""
    random = generator("sparse", kind.__name__)
    c = np.array([random.choice(NODES, 3, replace=False) for _ in range(40)])
    c[-1] = c[0]
    matrices = random.normal(size=(40, 3, 3)).astype(kind)
    if kind is complex:
        matrices[:20] += 1j * random.normal(size=(20, 3, 3))
    full = np.zeros((NODES, NODES), kind)
    for nodes, own in zip(c, matrices, strict=True):
        full[np.ix_(nodes, nodes)] += own
    return assembled([(c[:25], matrices[:25]), (c[25:], matrices[25:])], NODES), full


@pytest.mark.parametrize("kind", [float, complex])
def test_a_sparse_matrix_is_the_full_one(kind: type) -> None:
    got, full = drawn(kind)
    assert support.full(got) == pytest.approx(full, rel=1e-12, abs=1e-12)
    assert got.nnz == np.count_nonzero(full)


def test_neighbours_stand_nearly_as_near_as_scipy_puts_them() -> None:
    """A strip of quadrilaterals with its nodes numbered at random, where ties are broken otherwise;
    nothing is left out, loose nodes neither."""
    random = generator("order")
    shuffled = random.permutation(41 * 4 + 2)[: 41 * 4].reshape(41, 4)
    corners = [shuffled[:-1, :-1], shuffled[1:, :-1], shuffled[1:, 1:], shuffled[:-1, 1:]]
    c = np.stack([each.ravel() for each in corners], 1)
    pairs = np.stack([np.repeat(c, 4, 1).ravel(), np.tile(c, (1, 4)).ravel()], 1)
    n = 41 * 4 + 2
    graph = csr_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (n, n))
    widths = []
    for order in (narrow_order(pairs, n), reverse_cuthill_mckee(graph, symmetric_mode=True)):
        assert sorted(order) == list(range(n))
        place = np.argsort(order)
        widths.append(abs(np.diff(place[pairs])).max())
    assert widths[0] <= 1.5 * widths[1] < 12
