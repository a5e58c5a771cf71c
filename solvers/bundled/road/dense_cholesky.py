"""Cholesky factors of dense blocks in single precision, and their triangles' inverses applied.

Triangles are halved down to small ones, of which the inverses are kept, so that all that takes time
is products.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.blas import ssyrk
from scipy.linalg.lapack import spotrf, strtrs

from ...errors import Indefinite

Array = np.ndarray
MAX_UNDIVIDED_ROWS = 200  # rows of a triangle that are not halved any more


def cholesky(A: Array) -> None:
    """The lower triangle of A becomes its Cholesky factor L, but the inverse in L's small triangles
    on the diagonal. Raises Indefinite."""
    if len(A) <= MAX_UNDIVIDED_ROWS:
        L, info = spotrf(A, lower=1)
        if info:
            raise Indefinite("the tangent stiffness is not positive definite")
        # not by strtri, which ends the process with OpenBLAS's Prescott kernel
        A[:] = np.tril(strtrs(L, np.eye(len(A), dtype=L.dtype, order="F"), lower=1)[0])
        return
    h = len(A) // 2
    cholesky(A[:h, :h])
    across = np.asfortranarray(A[h:, :h].T)
    divide(A[:h, :h], across)
    A[h:, :h] = across.T
    A[h:, h:] -= across.T @ across
    cholesky(A[h:, h:])


def divide(L: Array, B: Array) -> None:
    """B becomes L^-1 B."""
    if len(L) <= MAX_UNDIVIDED_ROWS:
        B[:] = L @ B
        return
    h = len(L) // 2
    divide(L[:h, :h], B[:h])
    B[h:] -= L[h:, :h] @ B[:h]
    divide(L[h:, h:], B[h:])


def divide_transposed(L: Array, B: Array) -> None:
    """B becomes L^-T B."""
    if len(L) <= MAX_UNDIVIDED_ROWS:
        B[:] = L.T @ B
        return
    h = len(L) // 2
    divide_transposed(L[h:, h:], B[h:])
    B[:h] -= L[h:, :h].T @ B[h:]
    divide_transposed(L[:h, :h], B[:h])


def less_square(A: Array, X: Array) -> Array:
    """The lower triangle of A, in rows one after the other, less that of X^T X, in A's place."""
    return ssyrk(-1.0, X, 1.0, A.T, trans=1, lower=0, overwrite_c=1).T if len(A) else A
