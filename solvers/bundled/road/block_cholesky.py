"""Preconditioner of the tyre in three dimensions: block Cholesky along the section's meridian.

Nodes in levels from the bead to the middle of the tread couple only with their neighbours; a
level's functions round the tyre are eliminated together, as dense blocks in single precision. Where
cords run at a bias the two parts of the fold are eliminated as one, elsewhere each by itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.linalg.lapack import spotrf, strtrs
from scipy.sparse import csr_matrix

from ...errors import Indefinite, Refused
from ..section.symmetry import MIRROR_SIGNS
from .half_turn_symmetry import ODD, HalfTurn

Array = np.ndarray
Tangents = list[tuple[Array, Array, Array, Array]]
MAX_UNDIVIDED_ROWS = 300  # rows of a triangle that are not halved any more
_Assembled = tuple[tuple[int, ...], Array, Array, Array]
# of what couples the parts over what does not, above which a level takes both as one
MIN_COUPLING = 2e-3


@dataclass
class _Front:
    """One level."""

    nodes: Array  # rows of its nodes in the quarter: those to eliminate first, then the rest
    eliminated: int
    # per kind, its elements here and their mirror images with their nodes' places
    elements: list[tuple[Array, Array, Array, Array]]


class Elimination:
    """The order of elimination, from the elements' connectivities."""

    def __init__(self, connectivities: list[Array], symmetry: HalfTurn):
        self.symmetry, around = symmetry, symmetry.around
        place = np.full(symmetry.shape[1], -1)
        place[symmetry.nodes] = np.arange(len(symmetry.nodes))
        other = symmetry.other
        # elements on z >= 0, their images, and their nodes' places in the quarter
        chosen: list[tuple[Array, ...]] = []
        beyond = ~np.isin(np.arange(symmetry.shape[1]), symmetry.nodes)
        inner = (place >= 0) & (other != np.arange(symmetry.shape[1]))
        for c in connectivities:
            if (beyond[c].any(1) & inner[c].any(1)).any():
                raise Refused("an element straddles the middle plane")
            inside = np.flatnonzero((place[c] >= 0).all(1))
            chosen.append((inside, *_images(c, inside, other), place[c[inside]]))
        level = _levels([c for *_, c in chosen], symmetry)
        self.fronts = _fronts(chosen, level)
        # the same threads for every factor: what one factor frees then serves the next, for the
        # system keeps memory by threads
        self.ahead, self.pool, self.chains = (ThreadPoolExecutor(n) for n in (1, 2, 2))
        # what a station's tangents by u u, u v, v u, v v (v = du/dTheta) are to the functions round
        # the circumference: per piece, products of two of its functions or slopes, even or odd ones
        # (2, 2, 2, 2, s, f f), and where its pairs stand among all
        N = np.stack(
            [[F[:, rows] for F in (around.N, around.slope)] for rows in (around.even, around.odd)]
        )
        self.products: list[tuple[slice, Array]] = []
        self.pairs: list[tuple[slice, slice]] = []
        for piece in around.pieces:
            own = N[:, :, piece.stations, piece.functions]
            weighted = own * around.weights[piece.stations, None]
            products = np.einsum("pxsk,qysl->pqxyskl", own, weighted)
            products = products.reshape(*products.shape[:5], -1).astype(np.float32)
            self.products.append((piece.stations, products))
            before = self.pairs[-1][1].stop if self.pairs else 0
            self.pairs.append((piece.functions, slice(before, before + products.shape[-1])))


def _images(c: Array, inside: Array, other: Array) -> tuple[Array, Array]:
    """Mirror images of elements, and where in the image each node's own image stands (e, a)."""
    known: dict[tuple[int, ...], list[int]] = {}
    for element, nodes in enumerate(c):
        known.setdefault(tuple(sorted(nodes)), []).append(element)
    images, orders = [], []
    for element in inside:
        own = known[tuple(sorted(c[element]))]  # layers on one line have the same nodes
        mirrored = other[c[element]]
        image = known[tuple(sorted(mirrored))][own.index(element)]
        images.append(image)
        orders.append([list(c[image]).index(n) for n in mirrored])
    return np.array(images, int), np.array(orders, int).reshape(len(images), c.shape[1])


def _levels(connectivities: list[Array], symmetry: HalfTurn) -> Array:
    """Steps from the nodes that are farthest from the tread's middle; -1 for held ones."""
    free = np.asarray(symmetry.mask.any((0, 1, 3)))
    from_middle = _steps(connectivities, symmetry.nodes == symmetry.beyond, free)
    return _steps(connectivities, from_middle == from_middle.max(), free)


def _steps(connectivities: list[Array], start: Array, free: Array) -> Array:
    level = np.where(start & free, 0, -1)
    current = 0
    while (level == current).any():
        near = [c[(level[c] == current).any(1)].ravel() for c in connectivities]
        following = np.unique(np.concatenate(near))
        current += 1
        level[following[(level[following] == -1) & free[following]]] = current
    return level


def _fronts(chosen: list[tuple[Array, ...]], level: Array) -> list[_Front]:
    highest = [level[c].max(1, initial=-1) for *_, c in chosen]
    fronts, before = [], np.zeros(0, int)
    for i in range(level.max() + 1):
        onward = np.zeros(len(level), bool)
        for (*_, c), high in zip(chosen, highest, strict=True):
            onward[c[high == i + 1]] = True
        own = np.flatnonzero(level == i)
        exposed = own[onward[own]]
        nodes = np.concatenate([before, own[~onward[own]], exposed])
        position = np.full(len(level), len(nodes))  # a spare place for held ones
        position[nodes] = np.arange(len(nodes))
        elements = [
            (inside[high == i], image[high == i], order[high == i], position[c[high == i]])
            for (inside, image, order, c), high in zip(chosen, highest, strict=True)
        ]
        if not i or len(nodes) > len(exposed):
            fronts.append(_Front(nodes, len(nodes) - len(exposed), elements))
        before = exposed
    return fronts


class Factor:
    """Approximate inverse of the tangent stiffness on the two parts.

    tangents: at the stations (`Revolved.tangents`); contact: stiffness of the parts (2 k q 3,
    2 k q 3), N/m. Raises Indefinite.
    """

    def __init__(self, order: Elimination, tangents: Tangents, contact: csr_matrix):
        self.order = order
        self.contact = contact
        self._steps: list[tuple[Array, Array, slice, Array, Array]] = []
        carried: list[Array] = []
        levels = self._assemble(tangents)
        following = order.ahead.submit(next, levels, None)
        try:
            while (level := following.result()) is not None:
                following = order.ahead.submit(next, levels, None)
                carried = self._eliminate(*level, carried, order.pool)
        finally:
            wait([following])
        # steps of one part, of the other, and after these of both: two threads for the first two
        slots = [slot for _, _, slot, _, _ in self._steps]
        parts = [slice(0, 1), slice(1, 2), slice(0, 2)]
        self._chains = [[i for i, s in enumerate(slots) if s == part] for part in parts]

    def _assemble(self, tangents: Tangents) -> Iterator[tuple[_Front, list[_Assembled]]]:
        """Level by level its blocks, of each part or of both where the bias couples them."""
        coupled = False
        for front in self.order.fronts:
            tables = _tables(front, tangents, self.order)
            own, other = abs(tables[0][0]).max(), abs(tables[0][1]).max()
            coupled = coupled or bool(other > MIN_COUPLING * own)
            if not coupled:
                self._uncouple(front.nodes[: front.eliminated])
            first, rest = slice(0, front.eliminated), slice(front.eliminated, None)
            blocks: list[_Assembled] = []
            for group in [(0, 1)] if coupled else [(0,), (1,)]:
                make = partial(self._block, tables, front, group)
                blocks.append((group, make(first, first), make(first, rest), make(rest, rest)))
            yield front, blocks

    def _block(
        self,
        tables: list[list[Array]],
        front: _Front,
        group: tuple[int, ...],
        rows: slice,
        cols: slice,
    ) -> Array:
        """Stiffness over (part, function, node, component) of some of a front's nodes, of one part
        or both, held components cut out; Fortran order."""
        masks = self.order.symmetry.mask[:, :, front.nodes]
        K = masks.shape[1]
        n, m = len(front.nodes[rows]) * 3, len(front.nodes[cols]) * 3
        after, beyond = 3 * (rows.start or 0), 3 * (cols.start or 0)
        out = np.zeros((len(group) * K * n, len(group) * K * m), np.float32, order="F")
        for x, g in enumerate(group):
            for y, h in enumerate(group):
                # its transpose, in C order: (function, column, function, row)
                place = out[x * K * n : (x + 1) * K * n, y * K * m : (y + 1) * K * m].T
                tiles = np.lib.stride_tricks.as_strided(
                    place, (K, m, K, n), (m * place.strides[0], place.strides[0], n * 4, 4)
                )
                # the transpose of a symmetric whole: rows of h, columns of g
                table = tables[h][g][:, beyond : beyond + m, after : after + n]
                for own, pairs in self.order.pairs:
                    f = own.stop - own.start
                    tiles[own, :, own] += table[pairs].reshape(f, f, m, n).swapaxes(1, 2)
                place[~masks[h][:, cols].ravel()] = 0.0
                place[:, ~masks[g][:, rows].ravel()] = 0.0
        if rows.stop is not None:  # of what is eliminated here
            dofs = [self._dofs(group, front.nodes[some]) for some in (rows, cols)]
            touching = self.contact[dofs[0]][:, dofs[1]].tocoo()
            out[touching.row, touching.col] += touching.data
        if rows == cols:
            diagonal = np.einsum("ii->i", out)
            diagonal += np.concatenate([~masks[g][:, rows].ravel() for g in group])
        return out

    def _dofs(self, parts: tuple[int, ...], nodes: Array) -> Array:
        """Places of (part, angle, node, component) among the flat parts."""
        flat = np.arange(self.order.symmetry.mask.size).reshape(self.order.symmetry.mask.shape)
        return np.asarray(flat[list(parts)][:, :, nodes].ravel())

    def _uncouple(self, nodes: Array) -> None:
        """Leave out what the contact couples of the nodes' two parts."""
        if not self.contact.nnz:
            return
        place = np.indices(self.order.symmetry.mask.shape)
        part, here = place[0].ravel(), np.isin(place[2].ravel(), nodes)
        entries = self.contact.tocoo()
        row, col = entries.row, entries.col
        keep = (part[row] == part[col]) | ~(here[row] | here[col])
        kept = entries.data[keep], (row[keep], col[keep])
        self.contact = csr_matrix(kept, shape=self.contact.shape)

    def _eliminate(
        self,
        front: _Front,
        blocks: list[_Assembled],
        carried: list[Array],
        pool: ThreadPoolExecutor,
    ) -> list[Array]:
        """What a level leaves to the next one, of each part or of both."""
        gone, left = front.nodes[: front.eliminated], front.nodes[front.eliminated :]
        rests = []
        for group, first, onward, rest in blocks:
            if len(gone):
                before = [carried[h] for h in group if h < len(carried)]
                _add_carried(first, before, len(group), len(self.order.symmetry.around.even))
                _eliminate(first, onward, rest, pool)
                self._steps.append((gone, left, slice(group[0], group[-1] + 1), first, onward))
            rests.append(rest)
        return rests

    def solve(self, right: Array) -> Array:
        """K^-1 right for parts (..., 2, k, q, 3)."""
        rows = right.reshape(-1, *right.shape[-4:])
        return self.backward(self.forward(rows)).reshape(right.shape)

    def forward(self, right: Array) -> list[Array]:
        """L^-1 right for parts (v, 2, k, q, 3): by step, (rows, v); without rows up to the first
        level where ``right`` is not zero."""
        b = np.array(right, np.float32, order="C")
        pieces = [np.zeros((0, len(b)), np.float32)] * len(self._steps)

        def go(steps: list[int]) -> None:
            begun = False
            for i in steps:
                gone, left, slot, L, X = self._steps[i]
                y = b[:, slot, :, gone].reshape(len(b), -1).T
                begun = begun or bool(y.any())
                if begun:
                    _divide(L, y)
                    if len(left):
                        b[:, slot, :, left] -= (y.T @ X).reshape(b[:, slot, :, left].shape)
                    pieces[i] = y

        list(self.order.chains.map(go, self._chains[:2]))
        go(self._chains[2])
        return pieces

    def backward(self, pieces: list[Array]) -> Array:
        """L^-T of what `forward` gave, as parts (v, 2, k, q, 3)."""
        x = np.zeros((pieces[-1].shape[1], *self.order.symmetry.mask.shape), np.float32)

        def go(steps: list[int]) -> None:
            for i in steps[::-1]:
                gone, left, slot, L, X = self._steps[i]
                y = pieces[i] if len(pieces[i]) else np.zeros((len(L), len(x)), np.float32)
                if len(left):
                    y = y - X @ x[:, slot, :, left].reshape(len(x), -1).T
                _divide_transposed(L, y)
                x[:, slot, :, gone] = y.T.reshape(x[:, slot, :, gone].shape)

        go(self._chains[2])
        list(self.order.chains.map(go, self._chains[:2]))
        return np.asarray(x * self.order.symmetry.mask, float)


def _between_functions(kind: tuple[Array, ...], elements: Array, order: Elimination) -> Array:
    """Tangents of some elements between functions round the circumference, of even and odd fields
    (2, 2, e, 3a, 3a, pairs)."""
    K0, K1, K2 = (K[:, elements] for K in kind[1:])
    by = [K.reshape(len(K), -1) for K in (K0, K1, K1.swapaxes(-1, -2), K2)]
    total = np.empty((2, 2, *K0.shape[1:], order.pairs[-1][1].stop), np.float32)
    for (stations, products), (_, pairs) in zip(order.products, order.pairs, strict=True):
        for p, q in np.ndindex(2, 2):
            each = products[p, q].reshape(4, *products.shape[4:])
            among = sum(K[stations].T @ F for K, F in zip(by, each, strict=True))
            total[p, q, ..., pairs] = among.reshape(*K0.shape[1:], -1)
    return total


def _tables(front: _Front, tangents: Tangents, order: Elimination) -> list[list[Array]]:
    """Stiffness over the front's nodes (pairs, 3 nodes, 3 nodes), between a and b: sums of elements
    and their mirror images, and differences."""
    n = 3 * len(front.nodes)
    tables = np.zeros((2, 2, n + 3, n + 3, order.pairs[-1][1].stop), np.float32)
    for (elements, images, orders, places), kind in zip(front.elements, tangents, strict=True):
        if not len(elements):
            continue
        between = _between_functions(kind, np.concatenate([elements, images]), order)
        every = np.arange(between.shape[3])
        sign = np.tile(MIRROR_SIGNS, len(every) // 3).astype(np.float32)
        odd = np.tile(ODD, len(every) // 3).astype(int)
        for e, (its, place) in enumerate(zip(orders, places, strict=True)):
            turned, at = _dofs(its), np.ix_(_dofs(place), _dofs(place))
            for g, h in np.ndindex(2, 2):
                parities = odd[g][:, None], odd[h]
                here = between[(*parities, e, every[:, None], every)]
                there = between[(*parities, len(elements) + e, turned[:, None], turned)]
                there *= np.multiply.outer(sign, sign)[..., None]
                tables[g, h][at] += here + there if g == h else here - there
    # the last place is a spare of held nodes
    return [[np.ascontiguousarray(t[:n, :n].transpose(2, 0, 1)) for t in row] for row in tables]


def _dofs(nodes: Array) -> Array:
    return np.asarray((3 * nodes[:, None] + np.arange(3)).ravel())


def _add_carried(first: Array, carried: list[Array], parts: int, functions: int) -> None:
    """Add to the first block what earlier levels left of its nodes, of each part or of both."""
    whole = first.T.reshape(
        parts, functions, -1, parts, functions, len(first) // (parts * functions)
    )
    blocks = parts // max(len(carried), 1)
    for h, more in enumerate(carried):
        add = more.T.reshape(
            blocks, functions, -1, blocks, functions, len(more) // (blocks * functions)
        )
        m = add.shape[2]
        whole[h : h + blocks, :, :m, h : h + blocks, :, :m] += add


def _eliminate(first: Array, onward: Array, rest: Array, pool: ThreadPoolExecutor) -> None:
    """L of the first block, X = L^-1 onward, and rest - X^T X in their places; lower triangles."""
    _cholesky(first, pool)
    if onward.shape[1]:
        _divide_both(first, onward, pool)
        _subtract_square(rest, onward, pool)


# Triangles are halved down to small ones, of which the inverses are kept. All that takes time is
# thus in NumPy's products, which leave the interpreter to the other thread, as SciPy's triangular
# solvers do not. Threads share the work the same way everywhere, so that the bits are the same too.


def _cholesky(A: Array, pool: ThreadPoolExecutor) -> None:
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
    _cholesky(A[:h, :h], pool)
    across = np.asfortranarray(A[h:, :h].T)
    _divide_both(A[:h, :h], across, pool)
    A[h:, :h] = across.T
    _subtract_square(A[h:, h:], across, pool)
    _cholesky(A[h:, h:], pool)


def _divide_both(L: Array, B: Array, pool: ThreadPoolExecutor) -> None:
    """B becomes L^-1 B."""
    list(pool.map(lambda columns: _divide(L, columns), np.array_split(B, 2, 1)))


def _divide(L: Array, B: Array) -> None:
    if len(L) <= MAX_UNDIVIDED_ROWS:
        B[:] = L @ B
        return
    h = len(L) // 2
    _divide(L[:h, :h], B[:h])
    B[h:] -= L[h:, :h] @ B[:h]
    _divide(L[h:, h:], B[h:])


def _divide_transposed(L: Array, B: Array) -> None:
    """B becomes L^-T B."""
    if len(L) <= MAX_UNDIVIDED_ROWS:
        B[:] = L.T @ B
        return
    h = len(L) // 2
    _divide_transposed(L[h:, h:], B[h:])
    B[:h] -= L[h:, :h].T @ B[h:]
    _divide_transposed(L[:h, :h], B[:h])


def _subtract_square(A: Array, X: Array, pool: ThreadPoolExecutor) -> None:
    """The lower triangle of A becomes that of A - X^T X."""
    cut = int(len(A) * 0.7)  # about half of the triangle

    def subtract(rows: slice) -> None:
        A[rows, : rows.stop] -= (X[:, : rows.stop].T @ X[:, rows]).T

    list(pool.map(subtract, [slice(0, cut), slice(cut, len(A))]))
