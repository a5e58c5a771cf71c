"""Lowest eigenpairs of K x = lambda M x by the block Davidson method (Saad, Numerical Methods for
Large Eigenvalue Problems, 8.4): only products with K and an approximate inverse of it.

With the exact inverse its subspace is that of shift-invert Lanczos. Not by SciPy's lobpcg, which
keeps three blocks where this keeps all, and goes on where K is not positive.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...errors import RunFailed

Array = np.ndarray
Operator = Callable[[Array], Array]
EIGENVALUE_RTOL = 1e-9  # of an eigenvalue, relative
MAX_BASIS_PER_MODE = 8  # times the wanted pairs, before the basis is cut down to its best half
MAX_BLOCKS = 60
NOT_STABLE = "the pressed tyre is not stable: its stiffness is not positive"
MIN_LENGTH2 = 1e-10  # of a direction's squared length, below which it is in the basis already


@dataclass(frozen=True)
class Basis:
    """M-orthonormal vectors (b, size), and their images K x (b, size)."""

    vectors: Array
    images: Array

    def turned(self, turn: Array) -> Basis:
        """Basis of the combinations ``turn`` (b', b) of these vectors."""
        return Basis(turn @ self.vectors, turn @ self.images)

    def joined(self, other: Basis) -> Basis:
        """Basis of the vectors of both."""
        vectors = np.concatenate([self.vectors, other.vectors])
        return Basis(vectors, np.concatenate([self.images, other.images]))


def basis_of(fields: Array, product: Operator, mass: Operator) -> Basis:
    """Orthonormal basis of the space that fields (b, size) span."""
    vectors = _orthonormal(fields, np.empty((0, fields.shape[1])), mass)
    return Basis(vectors, product(vectors))


def lowest(
    product: Operator, mass: Operator, inverse: Operator, start: Basis, count: int
) -> tuple[Array, Array, Basis]:
    """The ``count`` lowest eigenvalues, ascending, vectors (count, size), x^T M x = 1, and the
    basis that has them, from which a matrix near K may start.

    Operators take blocks (b, size); ``inverse``: about K^-1, symmetric.
    Raises RunFailed, unstable where K is not positive.
    """
    if len(start.vectors) < count:
        have = f"{len(start.vectors)} directions to start from"
        raise RunFailed("crashed", f"{have} for {count} modes")
    basis, H = start, start.vectors @ start.images.T
    error, before = np.full(count, np.inf), np.zeros(count)
    for _ in range(MAX_BLOCKS):
        values, turn = np.linalg.eigh((H + H.T) / 2)
        if values[0] <= 0:
            raise RunFailed("unstable", NOT_STABLE)
        lowest = values[:count]
        # asked again of what has not converged, and where the basis has found a lower one
        left = (error > EIGENVALUE_RTOL) | (before - lowest > EIGENVALUE_RTOL * lowest)
        ritz = basis.turned(turn[:, :count].T)
        residual = ritz.images[left] - lowest[left, None] * mass(ritz.vectors[left])
        step = inverse(residual)
        # the residual in the norm of K^-1, squared: the eigenvalue's error, relative
        error[left] = np.einsum("cs,cs->c", residual, step) / lowest[left]
        if (error <= EIGENVALUE_RTOL).all():
            return lowest, ritz.vectors, basis
        before = lowest
        if len(basis.vectors) + count > MAX_BASIS_PER_MODE * count:
            kept = MAX_BASIS_PER_MODE * count // 2
            basis, H = basis.turned(turn[:, :kept].T), np.diag(values[:kept])
        block = _orthonormal(step[error[left] > EIGENVALUE_RTOL], basis.vectors, mass)
        if not len(block):
            break
        new = Basis(block, product(block))
        basis = basis.joined(new)
        column = basis.vectors @ new.images.T
        H = np.block([[H, column[: len(H)]], [column[: len(H)].T, column[len(H) :]]])
    raise RunFailed(
        "crashed",
        f"{count} modes of the pressed tyre did not converge: {(error > EIGENVALUE_RTOL).sum()} are"
        f" left, the worst off by {error.max():.1e}",
    )


def _orthonormal(block: Array, V: Array, mass: Operator) -> Array:
    """The directions of a block beyond those of V, M-orthonormal to them and to each other."""
    for _ in range(2):
        image = mass(block)
        scale = 1 / np.sqrt(np.einsum("bs,bs->b", block, image))
        block, image = block * scale[:, None], image * scale[:, None]
        overlap = image @ V.T
        gram = image @ block.T - overlap @ overlap.T
        block = block - overlap @ V
        values, turn = np.linalg.eigh((gram + gram.T) / 2)
        keep = values > MIN_LENGTH2
        block = (turn[:, keep] / np.sqrt(values[keep])).T @ block
    return block
