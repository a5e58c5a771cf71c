"""Preconditioner of the tyre in three dimensions: multifrontal Cholesky, in single precision
(Duff and Reid, ACM Trans. Math. Softw. 9, 302, 1983).

A front assembles the stiffness of its cells, or the Schur complements of the fronts inside its box.
It eliminates its own unknowns as one dense block; the Schur complement of the others goes to the
next front. Columns with biased cords eliminate the two parts of `HalfTurn` together, the others
each part separately.

Triangles of dense blocks are halved down to small ones, of which the inverses are kept, so that all
that takes time is products.
"""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
from scipy.linalg.blas import ssyrk
from scipy.linalg.lapack import spotrf, strtrs
from scipy.sparse import csr_matrix

from ...errors import Indefinite
from ..section.symmetry import MIRROR_SIGNS
from .dissection import Dissection, ElementColumn, Front, Kind, Range
from .half_turn_symmetry import ODD, HalfTurn

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


Tangents = list[tuple[Array, Array, Array, Array]]  # of each part, as `Revolved.tangents`
# largest stiffness between the two parts over that within one, above which a column eliminates both
# together
MIN_COUPLING = 2e-3
MAX_RUN = 256  # rows added at once; a block on the diagonal adds its upper half needlessly


class Elimination:
    """Order of elimination of a state's tangents, and assembly of their cells."""

    def __init__(self, tangents: Tangents, symmetry: HalfTurn):
        self.symmetry, around = symmetry, symmetry.around
        self.dissection = Dissection([t[0] for t in tangents], symmetry)
        self._folds = [
            [[[_fold(column, kind, g, h) for h in (0, 1)] for g in (0, 1)] for kind in column.kinds]
            for column in self.dissection.columns
        ]
        # products that turn a station's tangents by u u, u v, v u, v v (v = du/dTheta) into those
        # by functions round the circumference: for each piece, two of its functions or slopes, even
        # or odd ones (2, 2, 4, s, f f)
        N = np.stack(
            [[F[:, rows] for F in (around.N, around.slope)] for rows in (around.even, around.odd)]
        )
        self._products: list[Array] = []
        for piece in around.pieces:
            own = N[:, :, piece.stations, piece.functions]
            weighted = own * around.weights[piece.stations, None]
            products = np.einsum("pxsk,qysl->pqxyskl", own, weighted).astype(np.float32)
            self._products.append(products.reshape(2, 2, 4, own.shape[2], -1))
        self.fronts = self.dissection.fronts(self._coupled(tangents))

    def _coupled(self, tangents: Tangents) -> int:
        """The first column whose two parts biased cords couple, by its cell next to the road."""
        for column in range(len(self.dissection.columns)):
            table = abs(self.box(tangents, (0, 1), (column, column + 1), (0, 1)))
            half = len(table) // 2
            if table[:half, half:].max() > MIN_COUPLING * table[:half, :half].max():
                return column
        return len(self.dissection.columns)

    def _inside(self, columns: Range, pieces: Range) -> tuple[slice, slice]:
        """Functions and nodes of a box of cells."""
        first, last = (self.symmetry.around.pieces[i].functions for i in (pieces[0], pieces[1] - 1))
        begin, end = (self.dissection.columns[i].nodes for i in (columns[0], columns[1] - 1))
        return slice(first.start, last.stop), slice(begin.start, end.stop)

    def unknowns(self, parts: tuple[int, ...], columns: Range, pieces: Range) -> Array:
        """Flat indices of a box's (part, function, node, component)."""
        flat = np.arange(self.symmetry.mask.size).reshape(self.symmetry.mask.shape)
        functions, nodes = self._inside(columns, pieces)
        return np.asarray(flat[list(parts), functions][:, :, self.dissection.along[nodes]].ravel())

    def box(
        self, tangents: Tangents, parts: tuple[int, ...], columns: Range, pieces: Range
    ) -> Array:
        """Stiffness between a box's `unknowns`."""
        functions, nodes = self._inside(columns, pieces)
        size = len(parts), functions.stop - functions.start, 3 * (nodes.stop - nodes.start)
        stiff = np.zeros((*size, *size), np.float32)
        for c, p in product(range(*columns), range(*pieces)):
            f, n = self._inside((c, c + 1), (p, p + 1))
            some = slice(f.start - functions.start, f.stop - functions.start)
            here = slice(3 * (n.start - nodes.start), 3 * (n.stop - nodes.start))
            stiff[:, some, here, :, some, here] += self._cell(tangents, parts, c, p)
        return stiff.reshape(int(np.prod(size)), -1)

    def _cell(self, tangents: Tangents, parts: tuple[int, ...], column: int, piece: int) -> Array:
        """Stiffness of the elements of one cell (g, f, m, g, f, m): g parts, f functions, m
        components at the column's nodes."""
        its, around = self.dissection.columns[column], self.symmetry.around.pieces[piece]
        f = around.functions.stop - around.functions.start
        m = 3 * (its.nodes.stop - its.nodes.start)
        total = np.zeros((len(parts), len(parts), m * m, f * f), np.float32)
        for kind, tangent, folds in zip(its.kinds, tangents, self._folds[column], strict=True):
            if not len(kind.here):
                continue
            elements = np.concatenate([kind.here, kind.there])
            K0, K1, K2 = (K[around.stations][:, elements] for K in tangent[1:])
            by = np.stack([K0, K1, K1.swapaxes(-1, -2), K2]).reshape(4, len(K0), -1)
            between = np.tensordot(by, self._products[piece], ((0, 1), (2, 3)))
            between = between.transpose(1, 2, 0, 3).reshape(-1, f * f)
            for g, h in np.ndindex(len(parts), len(parts)):
                total[g, h] += folds[parts[g]][parts[h]] @ between
        shape = *total.shape[:2], m, m, f, f
        return total.reshape(shape).transpose(0, 4, 2, 1, 5, 3)


class Factor:
    """Approximate inverse of the tangent stiffness on the two parts.

    tangents: at the stations (`Revolved.tangents`); contact: stiffness of the parts (2 f q 3,
    2 f q 3), N/m. Below, v is the number of right sides. Raises Indefinite.
    """

    def __init__(self, order: Elimination, tangents: Tangents, contact: csr_matrix):
        self.order = order
        fronts = order.fronts
        self._unknowns = np.concatenate([front.own for front in fronts])  # as they are eliminated
        self._place = place = np.full(order.symmetry.mask.size, -1)
        place[self._unknowns] = np.arange(len(self._unknowns))
        self.contact = _within_parts(contact, fronts)
        touching = csr_matrix(self.contact[self._unknowns][:, self._unknowns])
        # of each front: its unknowns, those left to later fronts, L (`cholesky`), and
        # X = L^-1 times the stiffness between both
        self._steps: list[tuple[slice, Array, Array, Array]] = []
        rests: dict[int, tuple[Array, Array]] = {}
        start = 0
        for i, front in enumerate(fronts):
            own, left = slice(start, start + len(front.own)), np.sort(place[front.left])
            start, n = own.stop, len(front.own)
            here = np.concatenate([np.arange(own.start, own.stop), left])
            m = len(left)
            if front.cells:
                unknowns = place[order.unknowns(front.parts, *front.cells)]
                free = np.argsort(unknowns)[-len(here) :]  # place is -1 where nothing is free
                whole = order.box(tangents, front.parts, *front.cells)[free]
                first, onward = whole[:n, free[:n]].T, whole[n:, free[:n]]  # it is symmetric
                rest = whole[n:, free[n:]]
            else:
                first = np.zeros((n, n), np.float32, "F")
                onward, rest = np.zeros((m, n), np.float32), np.zeros((m, m), np.float32)
            for inside in front.inner:
                _add((first, onward, rest), here, *rests.pop(inside))
            held = touching[own].tocoo()
            later = held.col >= own.start
            row, col = held.row[later], np.searchsorted(here, held.col[later])
            for block, which, from_row in ((first, col < n, 0), (onward, col >= n, n)):
                block[col[which] - from_row, row[which]] += held.data[later][which]
            onward = onward.T
            cholesky(first)
            divide(first, onward)
            rests[i] = left, less_square(rest, onward)
            self._steps.append((own, left, first, onward))

    def solve(self, right: Array) -> Array:
        """K^-1 right for parts (..., 2, f, q, 3)."""
        rows = right.reshape(-1, *right.shape[-4:])
        return self.backward(self.forward(rows)).reshape(right.shape)

    def forward(self, right: Array) -> list[Array]:
        """L^-1 right for parts (v, 2, f, q, 3): by front, (rows, v), without rows where it is 0."""
        flat = right.reshape(len(right), -1)
        return self._forward(flat[:, self._unknowns].T.astype(np.float32, order="C"))

    def columns(self, dofs: Array) -> list[Array]:
        """L^-1 times units at free components of the parts, flat indices, as `forward` has it."""
        b = np.zeros((len(self._unknowns), len(dofs)), np.float32)
        b[self._place[dofs], np.arange(len(dofs))] = 1.0
        return self._forward(b)

    def _forward(self, b: Array) -> list[Array]:
        pieces = []
        for own, left, L, X in self._steps:
            y = b[own]
            some = bool(y.any())
            if some:
                divide(L, y)
                b[left] -= X.T @ y
            pieces.append(y.copy() if some else y[:0])
        return pieces

    def backward(self, pieces: list[Array]) -> Array:
        """L^-T of what `forward` gave, as parts (v, 2, f, q, 3)."""
        x = np.zeros((len(self._unknowns), pieces[-1].shape[1]), np.float32)
        for (own, left, L, X), y in zip(self._steps[::-1], pieces[::-1], strict=True):
            x[own] = y if len(y) else 0.0
            x[own] -= X @ x[left]
            divide_transposed(L, x[own])
        whole = np.zeros((x.shape[1], self.order.symmetry.mask.size))
        whole[:, self._unknowns] = x.T
        return whole.reshape(-1, *self.order.symmetry.mask.shape)


def _within_parts(contact: csr_matrix, fronts: list[Front]) -> csr_matrix:
    """The contact stiffness without its coupling of parts that are eliminated separately."""
    if not contact.nnz:
        return contact
    alone = np.full(contact.shape[0], -1)  # part of unknowns eliminated without the other part
    for front in fronts:
        if len(front.parts) == 1:
            alone[front.own] = front.parts[0]
    half = contact.shape[0] // 2
    entries = contact.tocoo()
    part = lambda i: i // half
    row, col = entries.row, entries.col
    keep = (part(row) == part(col)) | ((alone[row] < 0) & (alone[col] < 0))
    return csr_matrix((entries.data[keep], (row[keep], col[keep])), shape=contact.shape)


def _add(blocks: tuple[Array, Array, Array], here: Array, some: Array, block: Array) -> None:
    """Add the lower triangle of ``block``, between the unknowns ``some``, to a front's ``blocks``,
    run by run. here: the front's unknowns; blocks: between its own unknowns, from these to the
    rest, and between the rest."""
    own = len(blocks[0])
    at = np.searchsorted(here, some)
    is_cut = (np.diff(at) != 1) | (at[1:] == own)
    is_cut[MAX_RUN - 1 :: MAX_RUN] = True
    runs = []
    for a, b in pairwise([0, *(np.flatnonzero(is_cut) + 1).tolist(), len(at)]):
        if a < b:
            beyond = int(at[a] >= own)
            start = at[a] - own * beyond
            runs.append((slice(a, b), slice(start, start + b - a), beyond))
    for i, (row, to_row, below) in enumerate(runs):
        for col, to_col, beyond in runs[: i + 1]:
            blocks[below + beyond][to_row, to_col] += block[row, col]


def _fold(column: ElementColumn, kind: Kind, g: int, h: int) -> csr_matrix:
    """Map from the elements' stiffness, flat between even and odd fields (2, 2, 2 e, 3a, 3a), to
    the stiffness between the components of parts g and h at the column's nodes. Each element
    contributes here and as its mirror image."""
    e, a = kind.places.shape
    comp = np.tile(np.arange(3), a)
    row, col = np.indices((3 * a, 3 * a))
    parity = ODD[g][comp][row] * 2 + ODD[h][comp][col]  # of even and odd fields
    sign = (MIRROR_SIGNS[comp][row] * MIRROR_SIGNS[comp][col]) * (1 if g == h else -1)
    place, turned = _components(kind.places), _components(kind.turned)
    m = 3 * (column.nodes.stop - column.nodes.start)
    target = place[:, row] * m + place[:, col]
    element = np.arange(e)[:, None, None]
    flat = lambda which, i, j: ((parity * 2 * e + which) * 3 * a + i) * 3 * a + j
    source = [flat(element, row, col), flat(element + e, turned[:, row], turned[:, col])]
    values = np.concatenate([np.ones(target.size), np.tile(sign.ravel(), e)]).astype(np.float32)
    rows, cols = np.tile(target.ravel(), 2), np.concatenate([s.ravel() for s in source])
    free = np.tile(((place[:, row] >= 0) & (place[:, col] >= 0)).ravel(), 2)
    shape = (m * m, 4 * 2 * e * 9 * a * a)
    return csr_matrix((values[free], (rows[free], cols[free])), shape=shape)


def _components(nodes: Array) -> Array:
    return np.asarray((3 * nodes[..., None] + np.arange(3)).reshape(len(nodes), 3 * nodes.shape[1]))
