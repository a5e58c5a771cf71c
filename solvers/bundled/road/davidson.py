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
EIGENVALUE_RTOL = 1e-8  # of an eigenvalue, relative; a frequency's is half of it
MAX_BASIS_PER_MODE = 8  # times the wanted pairs, before the basis is cut down to its best half
MAX_BLOCKS = 120  # iterations, each of which adds a block
NOT_STABLE = "the pressed tyre is not stable: its stiffness is not positive"
MIN_LENGTH2 = 1e-10  # of a direction's squared length, below which it is in the basis already


class Basis:
    """M-orthonormal vectors x (b, size) with their images K x and M x; it grows in place."""

    def __init__(self, size: int):
        self._rows = np.empty((3, 0, size))
        self._count = 0

    @property
    def vectors(self) -> Array:
        """x (b, size)."""
        return self._rows[0, : self._count]

    @property
    def images(self) -> Array:
        """K x (b, size), which the caller changes in place where K changes."""
        return self._rows[1, : self._count]

    @property
    def inertias(self) -> Array:
        """M x (b, size)."""
        return self._rows[2, : self._count]

    def add(self, fields: Array, product: Operator, mass: Operator) -> int:
        """Add the directions of ``fields`` (c, size) beyond the basis; how many they are."""
        block, inertia = self._beyond(fields, mass(fields))
        start, self._count = self._count, self._count + len(block)
        if self._count > self._rows.shape[1]:
            larger = np.empty((3, 2 * self._count, self._rows.shape[2]))
            larger[:, :start] = self._rows[:, :start]
            self._rows = larger
        if len(block):
            for rows, new in zip(self._rows, (block, product(block), inertia), strict=True):
                rows[start : self._count] = new
        return len(block)

    def _beyond(self, block: Array, inertia: Array) -> tuple[Array, Array]:
        """The directions of a block (c, size), and M times them, orthonormal to the basis and each
        other; inertia: M times the block."""
        for _ in range(2):
            scale = 1 / np.sqrt(np.einsum("bs,bs->b", block, inertia))[:, None]
            block, inertia = block * scale, inertia * scale
            overlap = inertia @ self.vectors.T
            block -= overlap @ self.vectors
            inertia -= overlap @ self.inertias
            gram = inertia @ block.T
            values, turn = np.linalg.eigh((gram + gram.T) / 2)
            keep = values > MIN_LENGTH2
            turn = (turn[:, keep] / np.sqrt(values[keep])).T
            block, inertia = turn @ block, turn @ inertia
        return block, inertia

    def cut(self, turn: Array) -> None:
        """Replace the vectors by their combinations ``turn`` (b', b), b' < b."""
        for rows in self._rows:
            rows[: len(turn)] = turn @ rows[: self._count]
        self._count = len(turn)


def basis_of(fields: Array, product: Operator, mass: Operator) -> Basis:
    """Basis of the space that fields (b, size) span."""
    basis = Basis(fields.shape[1])
    basis.add(fields, product, mass)
    return basis


def lowest(
    product: Operator,
    mass: Operator,
    inverse: Operator,
    basis: Basis,
    count: int,
    tolerance: float = EIGENVALUE_RTOL,
) -> tuple[Array, Array]:
    """The ``count`` lowest eigenvalues, ascending, and vectors (count, size), x^T M x = 1; the
    ``basis`` grows until it has them, and may start the search for another K once its images are
    changed; tolerance: of an eigenvalue, relative.

    Operators take blocks (b, size): ``product``: K x, ``mass``: M x, ``inverse``: about K^-1 x,
    symmetric.
    Raises RunFailed, unstable where K is not positive.
    """
    while len(basis.vectors) < count:  # a small start grows by inverse iteration
        if basis.add(inverse(basis.inertias), product, mass):
            continue
        have = f"{len(basis.vectors)} directions to start from"
        raise RunFailed("crashed", f"{have} for {count} modes")
    H = basis.vectors @ basis.images.T
    error, before = np.full(count, np.inf), np.zeros(count)
    for _ in range(MAX_BLOCKS):
        values, turn = np.linalg.eigh((H + H.T) / 2)
        if values[0] <= 0:
            raise RunFailed("unstable", NOT_STABLE)
        lowest = values[:count]
        error[before - lowest > tolerance * lowest] = np.inf  # the basis has a lower one
        left = np.flatnonzero(error > tolerance)
        if not len(left):
            return lowest, turn[:, :count].T @ basis.vectors
        # the lowest half first: what brings them on brings the others on as well
        left = left[: (count + 1) // 2]
        ritz = turn[:, left].T
        residual = ritz @ basis.images - lowest[left, None] * (ritz @ basis.inertias)
        step = inverse(residual)
        # the residual in the norm of K^-1, squared: the eigenvalue's error, relative
        error[left] = np.einsum("cs,cs->c", residual, step) / lowest[left]
        before = lowest
        step = step[error[left] > tolerance]
        if not len(step):
            continue
        if len(basis.vectors) + len(step) > MAX_BASIS_PER_MODE * count:
            kept = MAX_BASIS_PER_MODE * count // 2
            basis.cut(turn[:, :kept].T)
            H = np.diag(values[:kept])
        added = basis.add(step, product, mass)
        if not added:
            break
        column = basis.vectors @ basis.images[-added:].T
        H = np.block([[H, column[:-added]], [column[:-added].T, column[-added:]]])
    raise RunFailed(
        "crashed",
        f"{count} modes of the pressed tyre did not converge: {(error > tolerance).sum()} are"
        f" left, the worst off by {error.max():.1e}",
    )
