"""Block Lanczos and banded factors against dense linear algebra."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh, qr
from tyrecal_solvers.bundled import job
from tyrecal_solvers.bundled.modes import lanczos
from tyrecal_solvers.bundled.section.band import Cholesky, Numbering
from tyrecal_solvers.errors import Indefinite, RunFailed

from ..chance import generator

pytestmark = pytest.mark.numbers

Array = np.ndarray
KIND = pytest.mark.parametrize("kind", [float, complex])


def problem(values: Array, kind: type, random: np.random.Generator) -> tuple[Array, Array]:
    """K, M Hermitian, M positive definite, with K x = lambda M x for the given lambda."""
    size = len(values)
    T = random.normal(size=(size, size)) + size * np.eye(size)
    if kind is complex:
        T = T + 1j * random.normal(size=(size, size))
    return T.conj().T @ np.diag(values) @ T, T.conj().T @ T


def lowest(K: Array, M: Array, count: int, shift: float, start: Array) -> tuple[Array, Array]:
    factor = np.linalg.inv(K - shift * M)
    return lanczos.lowest(lambda b: factor @ b, lambda x: M @ x, start, count, shift)


@KIND
@pytest.mark.parametrize("shift", [0.0, -3.0])
def test_lowest_pairs(kind: type, shift: float, random: np.random.Generator) -> None:
    """K x = lambda M x and x^H M x = 1, the lambda those of LAPACK's dense solver; with a rigid
    mode, lambda = 0, when the shift lies below it."""
    values = np.concatenate([[0.0 if shift else 0.5], random.uniform(1, 1e4, 59)])
    K, M = problem(values, kind, random)
    start = random.normal(size=(60, 3)).astype(kind)
    got, x = lowest(K, M, 5, shift, start)
    wanted = eigh(K, M, eigvals_only=True)[:5]
    np.testing.assert_allclose(got, wanted, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(x.conj().T @ M @ x, np.eye(5), atol=1e-10)
    residual = np.linalg.norm(np.linalg.solve(M, K @ x) - x * got, axis=0)
    assert (residual <= 1e-4 * np.maximum(got, 1)).all()


@KIND
@pytest.mark.parametrize("size", [3, 7, 8, 30])
def test_all_pairs(kind: type, size: int, random: np.random.Generator) -> None:
    """count = size (or more) gives the whole spectrum, also when the blocks do not divide it."""
    values = random.uniform(1, 100, size)
    K, M = problem(values, kind, random)
    for count in (size, size + 4):
        got, x = lowest(K, M, count, 0.0, random.normal(size=(size, 3)).astype(kind))
        np.testing.assert_allclose(got, np.sort(values), rtol=1e-8)
        np.testing.assert_allclose(x.conj().T @ M @ x, np.eye(size), atol=1e-7)


@KIND
def test_repeated_eigenvalues(kind: type, random: np.random.Generator) -> None:
    """A block of three finds eigenvalues of multiplicity up to three (Parlett, ch. 13), each with
    its M-orthonormal vectors."""
    values = np.array([2.0, 2.0, 2.0, 3.0, 3.0, *np.linspace(10, 1e3, 35)])
    K, M = problem(values, kind, random)
    got, x = lowest(K, M, 6, 0.0, random.normal(size=(40, 3)).astype(kind))
    np.testing.assert_allclose(got, values[:6], rtol=1e-10)
    np.testing.assert_allclose(x.conj().T @ M @ x, np.eye(6), atol=1e-9)


def test_identical_eigenvalues_exhaust_the_basis(random: np.random.Generator) -> None:
    """K = 4 M: the first block is invariant already; asking for more still gives M-orthonormal
    vectors, or says that it cannot."""
    K, M = problem(np.full(9, 4.0), float, random)
    got, x = lowest(K, M, 3, 0.0, random.normal(size=(9, 3)))
    np.testing.assert_allclose(got, 4.0, rtol=1e-12)
    try:
        got, x = lowest(K, M, 9, 0.0, random.normal(size=(9, 3)))
    except RunFailed:
        return
    np.testing.assert_allclose(got, 4.0, rtol=1e-9)
    np.testing.assert_allclose(x.T @ M @ x, np.eye(9), atol=1e-7)


def test_dependent_start_vectors_drop_out(random: np.random.Generator) -> None:
    """A zero and a repeated start vector do no harm."""
    values = np.arange(1.0, 31.0)
    K, M = problem(values, float, random)
    v = random.normal(size=30)
    got, _ = lowest(K, M, 4, 0.0, np.stack([v, 0 * v, v], -1))
    np.testing.assert_allclose(got, values[:4], rtol=1e-10)


@pytest.mark.parametrize("size", [0, 5])
def test_no_mass_is_refused(size: int) -> None:
    """M = 0 (a deck without *DENSITY), or nothing free: no modes, said so."""
    with pytest.raises(RunFailed, match="no mass"):
        lowest(np.eye(size), np.zeros((size, size)), 2, 0.0, np.ones((size, 2)))


def test_too_small_a_basis_is_refused(random: np.random.Generator, monkeypatch) -> None:
    """NotConverged instead of inaccurate modes."""
    monkeypatch.setattr(lanczos, "MAX_BASIS", 6)
    K, M = problem(random.uniform(1, 1e4, 60), float, random)
    with pytest.raises(RunFailed, match="5 modes"):
        lowest(K, M, 5, 0.0, random.normal(size=(60, 3)))


def assembled(kind: type, random: np.random.Generator) -> tuple[Array, Array, Numbering]:
    """Band, dense matrix over the free components and numbering of a chain of triangles."""
    table = np.array([[0, 5, 2], [2, 1, 5], [1, 4, 2], [4, 3, 1], [3, 6, 4]])
    free = np.ones((7, 3), bool)
    free[0] = free[4, 1] = False
    number = Numbering([table], free)
    parts = []
    for _ in range(2):
        m = random.normal(size=(5, 9, 9))
        parts.append(m @ m.swapaxes(1, 2) + np.eye(9))
    skew = random.normal(size=(5, 9, 9)) * 0.1
    skew = skew - skew.swapaxes(1, 2)
    band = number.assemble([(table, parts[0]), (table, parts[1])]).astype(kind)
    element = parts[0] + parts[1]
    if kind is complex:
        band = band + 1j * number.assemble([(table, skew)])
        element = element + 1j * skew
    full = np.zeros((21, 21), kind)
    for nodes, m in zip(table, element, strict=True):
        e = (3 * nodes[:, None] + np.arange(3)).ravel()
        full[np.ix_(e, e)] += m
    return np.asfortranarray(band), full[np.ix_(number.order, number.order)], number


@KIND
def test_assembly_and_factor_against_dense(kind: type, random: np.random.Generator) -> None:
    """The lower band holds the assembled matrix; Cholesky.solve = dense solve, one or more right
    sides."""
    band, K, number = assembled(kind, random)
    assert number.size == len(K) == 17
    lower = np.zeros_like(K)
    for d in range(len(band)):
        lower += np.diag(band[d, : number.size - d], -d)
    np.testing.assert_allclose(lower, np.tril(K), atol=1e-13)
    right = random.normal(size=(17, 3)).astype(kind)
    factor = Cholesky(band)
    np.testing.assert_allclose(K @ factor.solve(right), right, atol=1e-11)
    np.testing.assert_allclose(K @ factor.solve(right[:, 0]), right[:, 0], atol=1e-11)


@KIND
def test_indefinite(kind: type, random: np.random.Generator) -> None:
    """K - s 1 has no Cholesky factor once s passes the lowest eigenvalue."""
    band, K, _ = assembled(kind, random)
    least = np.linalg.eigvalsh(K)[0]
    for s, definite in ((0.99 * least, True), (1.01 * least, False)):
        shifted = band.copy(order="F")
        shifted[0] -= s
        if definite:
            Cholesky(shifted)
        else:
            with pytest.raises(Indefinite):
                Cholesky(shifted)


def test_spread_gather_and_vector(random: np.random.Generator) -> None:
    """gather(spread(x)) = x, spread is zero where held, and vector adds what dense adds."""
    _, _, number = assembled(float, random)
    x = random.normal(size=(number.size, 2))
    full = number.spread(x)
    np.testing.assert_array_equal(number.gather(full), x)
    assert (full[0] == 0).all() and (full[4, 1] == 0).all()
    table, values = np.array([[0, 5], [5, 2]]), random.normal(size=(2, 6))
    wanted = np.zeros((7, 3))
    np.add.at(wanted, table, values.reshape(2, 2, 3))
    np.testing.assert_allclose(number.vector([(table, values)]), number.gather(wanted))


def test_bandwidth_is_that_of_a_good_order() -> None:
    """A chain whose nodes are numbered at random has a small band after reordering: two-node
    elements reach 3 + 2 sub-diagonals."""
    places = qr(generator(1).normal(size=(40, 40)), pivoting=True)[2]
    table = np.stack([places[:-1], places[1:]], -1)
    assert Numbering([table], np.ones((40, 3), bool)).bandwidth == 5


def test_numbers_that_are_too_far_apart_end_as_a_failure_of_the_solver(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lapack(analysis: job.Job) -> None:
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    monkeypatch.setattr(job.Job, "__init__", lambda a, *_: a.__dict__.update(road=None, model=None))
    monkeypatch.setattr(job.Job, "run", lapack)
    (tmp_path / "modes.inp").write_text("*HEADING\n")
    with pytest.raises(RunFailed, match="too far apart: Eigenvalues did not converge"):
        job.run(tmp_path, "modes", None)
