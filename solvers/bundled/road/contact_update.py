"""The preconditioner with another contact than it was formed with.

Woodbury: with the factor's K = L L^T, and a change D of the contact stiffness at the dofs E,

    (K + E D E^T)^-1 = L^-T (1 - Y M Y^T) L^-1,   M = (1 + D Y^T Y)^-1 D,   Y = L^-1 E

E: unit columns, one for each of those dofs; the transposed inverse has M^T. Columns of Y are formed
when the contact of a dof first changes, and kept.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve
from scipy.sparse import csr_matrix

from .multifrontal import Factor

Array = np.ndarray
COLUMNS_AT_ONCE = 64  # columns that are formed at a time
# change of a dof's contact stiffness over the largest one, below which it is left to GMRES
MIN_STIFFNESS_CHANGE = 1e-3


class ContactUpdate:
    """Approximate inverse of the tangent stiffness as the contact changes."""

    def __init__(self, factor: Factor):
        self.factor = factor
        # column of Y of each dof, -1: none
        self._column = np.full(factor.order.symmetry.mask.size, -1)
        # rows of Y in each front of the factor (`multifrontal`): one list for each time that
        # columns were formed
        self._blocks: list[list[Array]] = []
        self._compliance = np.zeros((0, 0))  # Y^T Y, m/N
        self._active = np.zeros(0, int)  # columns of Y whose contact has changed

    def to(self, contact: csr_matrix) -> None:
        """Replace the contact stiffness by ``contact`` (2 f q 3, 2 f q 3), N/m, between the parts
        of `HalfTurn`; it need not be symmetric."""
        change = csr_matrix(contact - self.factor.contact)
        size = abs(change)
        largest = np.maximum(size.max(0).toarray()[0], size.max(1).toarray()[:, 0])
        dofs = np.flatnonzero(largest > MIN_STIFFNESS_CHANGE * abs(contact).max())
        self._form(dofs)
        self._active = self._column[dofs]
        D = change[dofs][:, dofs].toarray()  # of the dofs that change, N/m
        compliance = self._compliance[np.ix_(self._active, self._active)]
        self._small = solve(np.eye(len(dofs)) + D @ compliance, D, check_finite=False)

    def _form(self, dofs: Array) -> None:
        """Columns of Y for the dofs that lack them, and their part of Y^T Y."""
        dofs = dofs[self._column[dofs] < 0]
        if not len(dofs):
            return
        before = len(self._compliance)
        self._column[dofs] = before + np.arange(len(dofs))
        some = np.array_split(dofs, -(-len(dofs) // COLUMNS_AT_ONCE))
        pieces = [self.factor.columns(each) for each in some]
        new = [_side_by_side(each) for each in zip(*pieces, strict=True)]
        earlier = [_products(block, new) for block in self._blocks]
        corner = _products(new, new)
        across = np.concatenate([*earlier, corner], 0)
        self._compliance = np.block([[self._compliance, across[:before]], [across.T]])
        self._blocks.append(new)

    def solve(self, right: Array, transposed: Sequence[bool] | None = None) -> Array:
        """The inverse times parts (..., 2, f, q, 3); ``transposed``: for each of these parts,
        whether its inverse is the transposed one."""
        rows = right.reshape(-1, *right.shape[-4:])
        y = self.factor.forward(rows)
        if len(self._active):
            image = np.concatenate([_products(block, y) for block in self._blocks])[self._active]
            turned = np.zeros(len(rows), bool) if transposed is None else np.array(transposed)
            share = np.zeros((len(self._compliance), len(rows)), np.float32)
            share[self._active] = np.where(turned, self._small.T @ image, self._small @ image)
            start = 0
            for block in self._blocks:
                part = share[start : start + block[-1].shape[1]]
                start += len(part)
                for i, Y in enumerate(block):
                    if len(Y):
                        y[i] = y[i] - Y @ part if len(y[i]) else -Y @ part
        return self.factor.backward(y).reshape(right.shape)


def _side_by_side(pieces: Sequence[Array]) -> Array:
    """Columns of all pieces (rows, columns) side by side; a piece without rows is 0."""
    rows = max(len(piece) for piece in pieces)
    whole = np.zeros((rows, sum(piece.shape[1] for piece in pieces)), np.float32)
    start = 0
    for piece in pieces:
        whole[: len(piece), start : start + piece.shape[1]] = piece
        start += piece.shape[1]
    return whole


def _products(left: list[Array], right: list[Array]) -> Array:
    """left^T right (columns, columns), summed over the fronts."""
    total = np.zeros((left[0].shape[1], right[0].shape[1]))
    for a, b in zip(left, right, strict=True):
        if len(a) and len(b):
            total += a.T @ b
    return total
