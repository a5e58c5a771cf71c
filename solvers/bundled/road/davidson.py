"""Lowest eigenpairs of K x = lambda M x by the block Davidson method (Saad, Numerical Methods for
Large Eigenvalue Problems, 8.4): only products with K and an approximate inverse of it.

With the exact inverse its subspace is that of shift-invert Lanczos. Not by SciPy's lobpcg, which
keeps three blocks where this keeps all, and goes on where K is not positive.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import RunFailed

Array = np.ndarray
Operator = Callable[[Array], Array]
EIGENVALUE_RTOL = 1e-9  # of an eigenvalue, relative
MAX_BASIS_PER_MODE = 8  # times the wanted pairs, before the basis is cut down to its best half
MAX_BLOCKS = 60
NOT_STABLE = "the pressed tyre is not stable: its stiffness is not positive"
MIN_LENGTH2 = 1e-10  # of a direction's squared length, below which it is in the basis already


def lowest(
    product: Operator, mass: Operator, inverse: Operator, start: Array, count: int
) -> tuple[Array, Array]:
    """The ``count`` lowest eigenvalues, ascending, and vectors (count, size), x^T M x = 1.

    Operators take blocks (b, size); ``inverse``: about K^-1, symmetric; start (b, size).
    Raises RunFailed, unstable where K is not positive.
    """
    V, W = np.empty((2, 0, start.shape[1]))
    H = np.empty((0, 0))
    block = _orthonormal(start, V, mass)
    if len(block) < count:
        raise RunFailed("crashed", f"{len(start)} fields to start from do not span {count} modes")
    for _ in range(MAX_BLOCKS):
        image = product(block)
        V, W = np.concatenate([V, block]), np.concatenate([W, image])
        column = V @ image.T
        H = np.block([[H, column[: len(H)]], [column[: len(H)].T, column[len(H) :]]])
        values, turn = np.linalg.eigh((H + H.T) / 2)
        if values[0] <= 0:
            raise RunFailed("unstable", NOT_STABLE)
        lowest, turn_lowest = values[:count], turn[:, :count].T
        x = turn_lowest @ V
        residual = turn_lowest @ W - lowest[:, None] * mass(x)
        step = inverse(residual)
        # the residual in the norm of K^-1, squared: the eigenvalue's error, relative
        error = np.einsum("cs,cs->c", residual, step) / lowest
        if (error <= EIGENVALUE_RTOL).all():
            return lowest, x
        if len(V) + count > MAX_BASIS_PER_MODE * count:
            best = turn[:, : MAX_BASIS_PER_MODE * count // 2].T
            V, W, H = best @ V, best @ W, np.diag(values[: len(best)])
        block = _orthonormal(step[error > EIGENVALUE_RTOL], V, mass)
        if not len(block):
            break
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
