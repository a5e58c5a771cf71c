"""Davidson's method for the lowest modes, against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from tyrecal_solvers.bundled.road import davidson
from tyrecal_solvers.errors import RunFailed

pytestmark = pytest.mark.numbers

Array = np.ndarray


def block(matrix: Array) -> davidson.Operator:
    return lambda x: x @ matrix


def matrices(random: np.random.Generator) -> tuple[Array, Array]:
    A, B = random.normal(size=(2, 120, 120))
    return A @ A.T / 100 + np.diag(np.arange(1.0, 121.0)), B @ B.T / 1000 + np.eye(120)


def lowest(
    K: Array, M: Array, inverse: Array, fields: Array, count: int
) -> tuple[Array, Array, davidson.Basis]:
    basis = davidson.basis_of(fields, block(K), block(M))
    return *davidson.lowest(block(K), block(M), block(inverse), basis, count), basis


def test_davidson_against_dense_algebra(random: np.random.Generator) -> None:
    """An inverse that is off by a tenth, a start of noise, a basis that is cut down on the way."""
    K, M = matrices(random)
    rough = np.linalg.inv(K + 0.1 * np.diag(np.diag(K)))
    values, x, basis = lowest(K, M, rough, random.normal(size=(6, 120)), 5)
    exact = eigh(K, M, eigvals_only=True)[:5]
    np.testing.assert_allclose(values, exact, rtol=3 * davidson.EIGENVALUE_RTOL)
    np.testing.assert_allclose(x @ M @ x.T, np.eye(5), atol=1e-9)
    np.testing.assert_allclose(basis.images, basis.vectors @ K, atol=1e-9 * np.linalg.norm(K))
    np.testing.assert_allclose(basis.inertias, basis.vectors @ M, atol=1e-9 * np.linalg.norm(M))


def test_davidson_from_fewer_fields_than_modes(random: np.random.Generator) -> None:
    K, M = matrices(random)
    values, _, _ = lowest(K, M, np.linalg.inv(K), random.normal(size=(2, 120)), 5)
    exact = eigh(K, M, eigvals_only=True)[:5]
    np.testing.assert_allclose(values, exact, rtol=3 * davidson.EIGENVALUE_RTOL)


def test_davidson_goes_on_from_the_basis_of_a_matrix_near_by(random: np.random.Generator) -> None:
    """Springs at four places, another lowest mode by it: the same as from dense algebra, with fewer
    products than from the start."""
    K, M = matrices(random)
    rough = np.linalg.inv(K + 0.1 * np.diag(np.diag(K)))
    fields = random.normal(size=(6, 120))
    basis = lowest(K, M, rough, fields, 5)[2]
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
        lowest(K - 50 * np.eye(120), M, np.eye(120), fields, 3)
    invariant = np.repeat(np.eye(120)[:1], 4, 0)
    with pytest.raises(RunFailed, match="1 directions to start from for 3 modes"):
        lowest(np.eye(120), np.eye(120), np.eye(120), invariant, 3)
    monkeypatch.setattr(davidson, "MAX_BLOCKS", 2)
    with pytest.raises(RunFailed, match="did not converge"):
        lowest(K, M, np.eye(120), fields, 3)


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
