"""Lowest eigenvalues by block Lanczos, banded factors and Davidson, against dense algebra."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh, qr
from tyrecal_solvers.bundled import job
from tyrecal_solvers.bundled.modes import lanczos
from tyrecal_solvers.bundled.road import davidson
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


def block(matrix: Array) -> davidson.Operator:
    return lambda x: x @ matrix


def matrices(random: np.random.Generator) -> tuple[Array, Array]:
    A, B = random.normal(size=(2, 120, 120))
    return A @ A.T / 100 + np.diag(np.arange(1.0, 121.0)), B @ B.T / 1000 + np.eye(120)


def lowest_by_davidson(
    K: Array, M: Array, inverse: Array, fields: Array, count: int
) -> tuple[Array, Array, davidson.Basis]:
    basis = davidson.basis_of(fields, block(K), block(M))
    return *davidson.lowest(block(K), block(M), block(inverse), basis, count), basis


def test_davidson_against_dense_algebra(random: np.random.Generator) -> None:
    """An inverse that is off by a tenth, a start of noise, a basis that is cut down on the way."""
    K, M = matrices(random)
    rough = np.linalg.inv(K + 0.1 * np.diag(np.diag(K)))
    values, x, basis = lowest_by_davidson(K, M, rough, random.normal(size=(6, 120)), 5)
    exact = eigh(K, M, eigvals_only=True)[:5]
    np.testing.assert_allclose(values, exact, rtol=3 * davidson.EIGENVALUE_RTOL)
    np.testing.assert_allclose(x @ M @ x.T, np.eye(5), atol=1e-9)
    np.testing.assert_allclose(basis.images, basis.vectors @ K, atol=1e-9 * np.linalg.norm(K))
    np.testing.assert_allclose(basis.inertias, basis.vectors @ M, atol=1e-9 * np.linalg.norm(M))


def test_davidson_from_fewer_fields_than_modes(random: np.random.Generator) -> None:
    K, M = matrices(random)
    values, _, _ = lowest_by_davidson(K, M, np.linalg.inv(K), random.normal(size=(2, 120)), 5)
    exact = eigh(K, M, eigvals_only=True)[:5]
    np.testing.assert_allclose(values, exact, rtol=3 * davidson.EIGENVALUE_RTOL)


def test_davidson_goes_on_from_the_basis_of_a_matrix_near_by(random: np.random.Generator) -> None:
    """Springs at four places, another lowest mode by it: the same as from dense algebra, with fewer
    products than from the start."""
    K, M = matrices(random)
    rough = np.linalg.inv(K + 0.1 * np.diag(np.diag(K)))
    fields = random.normal(size=(6, 120))
    basis = lowest_by_davidson(K, M, rough, fields, 5)[2]
    springs = np.diag(np.where(np.arange(120) < 4, [3.0] * 120, 0.0))
    exact = eigh(K + springs, M, eigvals_only=True)[:5]

    def products(start: davidson.Basis) -> int:
        taken: list[int] = []

        def product(x: Array) -> Array:
            taken.append(len(x))
            return x @ (K + springs)

        values, x = davidson.lowest(product, block(M), block(rough), start, 5)
        np.testing.assert_allclose(values, exact, rtol=3 * davidson.EIGENVALUE_RTOL)
        np.testing.assert_allclose(x @ M @ x.T, np.eye(5), atol=1e-9)
        return sum(taken)

    basis.images[:] += basis.vectors @ springs
    anew = davidson.basis_of(fields, block(K + springs), block(M))
    assert products(basis) < products(anew)


def test_davidson_fails_by_name(
    random: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    K, M = matrices(random)
    fields = random.normal(size=(4, 120))
    with pytest.raises(RunFailed, match="not positive"):
        lowest_by_davidson(K - 50 * np.eye(120), M, np.eye(120), fields, 3)
    invariant = np.repeat(np.eye(120)[:1], 4, 0)
    with pytest.raises(RunFailed, match="1 directions to start from for 3 modes"):
        lowest_by_davidson(np.eye(120), np.eye(120), np.eye(120), invariant, 3)
    monkeypatch.setattr(davidson, "MAX_BLOCKS", 2)
    with pytest.raises(RunFailed, match="did not converge"):
        lowest_by_davidson(K, M, np.eye(120), fields, 3)


def test_only_new_directions_are_taken_into_a_basis(random: np.random.Generator) -> None:
    """Six fields: two in the basis, one of the others' sum and one a thousandfold. Two are new,
    M-orthonormal to the basis and to each other; none of those in the basis alone is."""
    _, M = matrices(random)
    basis = davidson.basis_of(random.normal(size=(3, 120)), block(np.eye(120)), block(M))
    V = basis.vectors.copy()
    a, b = random.normal(size=(2, 120))
    fields = np.array([V[0], V[1] - 2 * V[2], a, b, a + b + V[0], 1e3 * b])
    assert basis.add(fields, block(np.eye(120)), block(M)) == 2
    np.testing.assert_array_equal(basis.vectors[:3], V)
    np.testing.assert_allclose(basis.vectors @ M @ basis.vectors.T, np.eye(5), atol=1e-9)
    assert np.linalg.matrix_rank(np.concatenate([basis.vectors, [a], [b]]), 1e-6) == 5
    assert not basis.add(fields[:2], block(np.eye(120)), block(M))
