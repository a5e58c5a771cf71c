"""Sparse matrices and narrow orders against SciPy's, which are compiled in other packages."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import reverse_cuthill_mckee
from tyrecal_solvers.bundled.section.sparse import Sparse, narrow_order

from ..chance import generator
from . import support

Array = np.ndarray
NODES = 30


def drawn(kind: type) -> tuple[Sparse, Array]:
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
    return Sparse.assembled([(c[:25], matrices[:25]), (c[25:], matrices[25:])], NODES), full


@pytest.mark.parametrize("kind", [float, complex])
def test_a_sparse_matrix_is_the_full_one(kind: type) -> None:
    got, full = drawn(kind)
    random = generator("products")
    for x in (random.normal(size=NODES), random.normal(size=(4, NODES)).T, np.arange(NODES)):
        for side in (x, x + 1j * x[::-1]):
            assert got @ side == pytest.approx(full @ side, rel=1e-12, abs=1e-12)
    assert got.diagonal() == pytest.approx(np.diag(full))
    assert support.full(got.imag) == pytest.approx(full.imag)
    assert not (got - got).entries.any()
    twice, other = Sparse(2 * got.entries, got.columns, got.starts), drawn(float)[0]
    assert support.full(twice - other) == pytest.approx(2 * full - support.full(other))


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


@pytest.mark.slow
def test_routines_are_scipys_whoever_comes_first() -> None:
    """The same module before and after its package is imported, and the package works with it."""
    ours = "from tyrecal_solvers.bundled.section.compiled import LAPACK, compiled"
    whole = "import scipy.linalg, scipy.sparse, sys"
    same = "assert LAPACK is scipy.linalg.lapack._flapack, LAPACK"
    known = "sys.modules['scipy.sparse._sparsetools']"
    sparse = f"assert compiled('scipy.sparse._sparsetools') is {known}"
    works = "assert abs(scipy.linalg.cho_factor([[4.0]])[0] - 2) < 1e-12"
    for first, second in ((ours, whole), (whole, ours)):
        code = "\n".join([first, second, same, sparse, works])
        subprocess.run([sys.executable, "-c", code], check=True)
