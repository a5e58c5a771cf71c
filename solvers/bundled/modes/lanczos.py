"""Lowest eigenpairs of K x = lambda M x by block Lanczos on (K - shift M)^-1 M.

Parlett, The Symmetric Eigenvalue Problem, ch. 13, with full reorthogonalisation in the inner
product of M; real symmetric or complex Hermitian. Not by SciPy's eigsh, which starts from one
vector instead of a block, and leaves Hermitian matrices to its general solver.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import RunFailed

Array = np.ndarray
# residual of 1 / (lambda - shift) in the norm of M, relative; lambda's relative error is its square
INVERSE_RTOL = 1e-7
MAX_BASIS = 300  # vectors


def lowest(
    solve: Callable[[Array], Array],
    mass: Callable[[Array], Array],
    start: Array,
    count: int,
    shift: float,
) -> tuple[Array, Array]:
    """The ``count`` lowest eigenvalues, all above ``shift``, and their M-normalised vectors.

    solve(b), by a Cholesky factor, so that no eigenvalue is below: (K - shift M)^-1 b; mass(x): M
    x; start (size, b): first block. Returns eigenvalues (count,) ascending and vectors (size,
    count). Raises RunFailed.
    """
    size = start.shape[0]
    count = min(count, size)
    block, image, _ = _orthonormal(start, mass(start))
    if not block.shape[1]:
        raise RunFailed("crashed", "there is no mass that is free to vibrate")
    basis, images = block[:, :0], image[:, :0]  # images: M times the basis
    projected = np.empty((0, 0), start.dtype)
    while block.shape[1]:
        basis, images = np.hstack([basis, block]), np.hstack([images, image])
        following = solve(image)
        column = images.conj().T @ following
        projected = _bordered(projected, column)
        following -= basis @ column
        following -= basis @ (images.conj().T @ following)
        block, image, gram = _orthonormal(following, mass(following))
        inverse, vectors = np.linalg.eigh(projected)
        if len(inverse) >= count:
            inverse, vectors = inverse[::-1][:count], vectors[:, ::-1][:, :count]
            last = vectors[-len(gram) :]
            # norm, by M, of the residual of each pair
            error = np.sqrt(np.abs(np.einsum("bm,bc,cm->m", last.conj(), gram, last)))
            if (error <= INVERSE_RTOL * inverse).all():
                return shift + 1 / inverse, basis @ vectors
        if len(projected) > MAX_BASIS:
            break
    if len(projected) >= size:  # the basis spans everything: the projection is the problem
        return shift + 1 / inverse, basis @ vectors
    words = f"{count} modes did not converge in {len(projected)} Lanczos vectors"
    raise RunFailed("crashed", words)


def _bordered(matrix: Array, column: Array) -> Array:
    """The Hermitian matrix grown by its new last block column."""
    old, width = len(matrix), column.shape[1]
    grown = np.empty((old + width, old + width), column.dtype)
    grown[:old, :old] = matrix
    grown[:, old:] = column
    grown[old:, :] = column.conj().T
    return grown


def _orthonormal(block: Array, image: Array) -> tuple[Array, Array, Array]:
    """Block (size, b) and its image M block made M-orthonormal in itself, and the Gram matrix (b,
    b) before.

    Directions that depend on the others drop out.
    """
    gram = block.conj().T @ image
    values, vectors = np.linalg.eigh(gram)
    keep = values > 1e-26 * abs(values[-1])  # squared lengths
    turn = vectors[:, keep] / np.sqrt(values[keep])
    return block @ turn, image @ turn, gram
