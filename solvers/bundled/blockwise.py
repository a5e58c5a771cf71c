"""Preconditioner of the tyre in three dimensions: block Cholesky along the section's meridian.

Nodes in levels from the bead to the middle of the tread couple only with their neighbours; all
angles of a level are eliminated together, as dense blocks in single precision. Where cords run at
a bias the two parts of the fold are eliminated as one, elsewhere each by itself.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import spotrf, strtrs

from .band import Indefinite
from .circumference import Circumference
from .fold import MIRROR, Fold, NotSymmetric

Array = np.ndarray
Tangents = list[tuple[Array, Array, Array, Array]]
BIAS = 1e-2  # of what couples the parts over what does not, above which a level takes both as one


@dataclass
class _Front:
    """One level: rows of its nodes in the quarter, those to eliminate first, then the rest.

    elements: per kind, its elements here and their mirror images with their nodes' places.
    """

    nodes: Array
    eliminated: int
    elements: list[tuple[Array, Array, Array, Array]]


class Elimination:
    """The order of elimination, from the elements' connectivities."""

    def __init__(self, connectivities: list[Array], fold: Fold, around: Circumference):
        self.fold, self.around = fold, around
        place = np.full(fold.shape[1], -1)
        place[fold.nodes] = np.arange(len(fold.nodes))
        other = fold.other
        # elements on z >= 0, their images, and their nodes' places in the quarter
        chosen: list[tuple[Array, ...]] = []
        beyond = ~np.isin(np.arange(fold.shape[1]), fold.nodes)
        inner = (place >= 0) & (other != np.arange(fold.shape[1]))
        for c in connectivities:
            if (beyond[c].any(1) & inner[c].any(1)).any():
                raise NotSymmetric("an element straddles the middle plane")
            inside = np.flatnonzero((place[c] >= 0).all(1))
            chosen.append((inside, *_images(c, inside, other), place[c[inside]]))
        level = _levels([c for *_, c in chosen], fold)
        self.fronts = _fronts(chosen, level)
        N, D = around.N, around.slope
        self.elements = []  # round the circumference: stations, weights (9, 4 s) of their tables
        for t, rows in enumerate(around.stations):
            cols = slice(2 * t, 2 * t + 3)
            n, d, w = N[rows, cols], D[rows, cols], around.weights[rows]
            products = [np.einsum("sk,sl,s->kls", a, b, w) for a in (n, d) for b in (n, d)]
            self.elements.append((rows, np.stack(products, 2).reshape(9, -1).astype(np.float32)))


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


def _levels(connectivities: list[Array], fold: Fold) -> Array:
    """Steps from the nodes that are farthest from the tread's middle; -1 for held ones."""
    free = np.asarray(fold.mask.any((0, 1, 3)))
    from_middle = _steps(connectivities, fold.nodes == fold.beyond, free)
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

    tangents: at the stations (`Revolved.tangents`); contact (k, n, 3, 3): stiffness at the
    nodes, N/m. Raises Indefinite.
    """

    def __init__(self, order: Elimination, tangents: Tangents, contact: Array):
        self.order = order
        self._steps: list[list[tuple[Array, Array]]] = []  # per level: L, X of each block
        carried: list[Array] = []
        with ThreadPoolExecutor(2) as pool:
            for front in order.fronts:
                same, cross = _tables(front, tangents, order)
                coupled = len(carried) == 1 or abs(cross).max() > BIAS * abs(same).max()
                step, rests = [], []
                for group in [(0, 1)] if coupled else [(0,), (1,)]:
                    block = lambda rows, cols, t=(same, cross), f=front, g=group: _block(
                        t, f, g, order, contact, rows, cols
                    )
                    L, X, rest = _eliminate(
                        block("gone", "gone"),
                        block("gone", "left"),
                        block("left", "left"),
                        [carried[h] for h in group if h < len(carried)],
                        coupled,
                        order.fold.shape[0],
                        pool,
                    )
                    step.append((L, X))
                    rests.append(rest)
                self._steps.append(step)
                carried = rests

    def solve(self, right: Array) -> Array:
        """K^-1 right for parts (2, k, q, 3)."""
        b = np.array(right, np.float32, order="C")
        pieces = []
        for front, step in zip(self.order.fronts, self._steps, strict=True):
            gone, left = front.nodes[: front.eliminated], front.nodes[front.eliminated :]
            slots = [slice(0, 2)] if len(step) == 1 else [slice(0, 1), slice(1, 2)]
            for slot, (L, X) in zip(slots if len(gone) else [], step, strict=False):
                y = strtrs(L, b[slot, :, gone].ravel(), lower=1)[0].ravel()
                if len(left):
                    b[slot, :, left] -= (y @ X).reshape(b[slot, :, left].shape)
                pieces.append((slot, gone, left, L, X, y))
        x = np.zeros_like(b)
        for slot, gone, left, L, X, y in pieces[::-1]:
            if len(left):
                y = y - X @ x[slot, :, left].ravel()
            solved = strtrs(L, y, lower=1, trans=1)[0]
            x[slot, :, gone] = solved.reshape(x[slot, :, gone].shape)
        return np.asarray(x * self.order.fold.mask, float)

    def solve_block(self, right: Array) -> Array:
        """`solve` for several right-hand sides (b, 2, k, q, 3): one pass over the factor."""
        b = np.array(right, np.float32, order="C")
        count, pieces = len(b), []
        for front, step in zip(self.order.fronts, self._steps, strict=True):
            gone, left = front.nodes[: front.eliminated], front.nodes[front.eliminated :]
            slots = [slice(0, 2)] if len(step) == 1 else [slice(0, 1), slice(1, 2)]
            for slot, (L, X) in zip(slots if len(gone) else [], step, strict=False):
                y = strtrs(L, b[:, slot, :, gone].reshape(count, -1).T, lower=1)[0]
                if len(left):
                    b[:, slot, :, left] -= (y.T @ X).reshape(b[:, slot, :, left].shape)
                pieces.append((slot, gone, left, L, X, y))
        x = np.zeros_like(b)
        for slot, gone, left, L, X, y in pieces[::-1]:
            if len(left):
                y = y - X @ x[:, slot, :, left].reshape(count, -1).T
            solved = strtrs(L, y, lower=1, trans=1)[0].T
            x[:, slot, :, gone] = solved.reshape(x[:, slot, :, gone].shape)
        return np.asarray(x * self.order.fold.mask, float)


def _tables(front: _Front, tangents: Tangents, order: Elimination) -> tuple[Array, Array]:
    """Tangents at the stations over the front's nodes, (4, s, nodes, 3, nodes, 3): of W by u u,
    u v, v u, v v with v = du/dTheta; sums of elements and their images, and differences."""
    nf, S = len(front.nodes), len(order.around.weights)
    same, cross = np.zeros((2, nf + 1, nf + 1, 4, S, 3, 3), np.float32)  # a spare: held nodes
    for (elements, images, orders, places), kind in zip(front.elements, tangents, strict=True):
        if not len(elements):
            continue
        own, there = _by_pairs(kind, elements), _by_pairs(kind, images)
        e = np.arange(len(elements))[:, None, None]
        there = there[e, orders[:, :, None], orders[:, None]] * np.multiply.outer(MIRROR, MIRROR)
        for row, plus, minus in zip(places, own + there, own - there, strict=True):
            pairs = np.ix_(row, row)
            same[pairs] += plus
            cross[pairs] += minus
    arrange = lambda t: np.ascontiguousarray(t[:nf, :nf].transpose(2, 3, 0, 4, 1, 5))
    return arrange(same), arrange(cross)


def _by_pairs(kind: tuple[Array, ...], elements: Array) -> Array:
    """Tangents of elements by pairs of nodes (e, a, a, 4, s, 3, 3)."""
    _, K0, K1, K2 = kind
    K1 = K1[:, elements]
    stack = np.stack([K0[:, elements], K1, K1.swapaxes(-1, -2), K2[:, elements]])
    _, S, e, d, _ = stack.shape
    return stack.reshape(4, S, e, d // 3, 3, d // 3, 3).transpose(2, 3, 5, 0, 1, 4, 6)


def _block(
    tables: tuple[Array, Array],
    front: _Front,
    group: tuple[int, ...],
    order: Elimination,
    contact: Array,
    rows: str,
    cols: str,
) -> Array:
    """Stiffness over (part, angle, node, component) of nodes ``gone`` or ``left``, of one part or
    both, held components cut out; Fortran order."""
    chosen = {"gone": slice(0, front.eliminated), "left": slice(front.eliminated, None)}
    here, there = chosen[rows], chosen[cols]
    masks = order.fold.mask[:, :, front.nodes]
    K = masks.shape[1]
    n, m = len(front.nodes[here]) * 3, len(front.nodes[there]) * 3
    out = np.zeros((len(group) * K * n, len(group) * K * m), np.float32, order="F")
    for x, g in enumerate(group):
        for y, h in enumerate(group):
            # its transpose, in C order: (angle, column, angle, row)
            place = out[x * K * n : (x + 1) * K * n, y * K * m : (y + 1) * K * m].T
            tiles = np.lib.stride_tricks.as_strided(
                place,
                (K, m, K, n),
                (m * place.strides[0], place.strides[0], n * 4, 4),
            )
            table = tables[0 if g == h else 1][:, :, there, :, here]
            for t, (stations, weights) in enumerate(order.elements):
                flat = np.ascontiguousarray(table[:, stations]).reshape(weights.shape[1], -1)
                part = (weights @ flat).reshape(3, 3, m, n).transpose(0, 2, 1, 3)
                tiles[2 * t : 2 * t + 3, :, 2 * t : 2 * t + 3] += part
            if rows == cols and rows == "gone":
                _add_contact(tiles, contact, front, order, g == h)
            place[~masks[h][:, there].ravel()] = 0.0
            place[:, ~masks[g][:, here].ravel()] = 0.0
    if rows == cols:
        diagonal = np.einsum("ii->i", out)
        diagonal += np.concatenate([~masks[g][:, here].ravel() for g in group])
    return out


def _add_contact(
    tiles: Array, contact: Array, front: _Front, order: Elimination, same: bool
) -> None:
    nodes = front.nodes[: front.eliminated]
    here, there = order.fold.nodes[nodes], order.fold.beyond[nodes]
    image = contact[:, there] * np.multiply.outer(MIRROR, MIRROR)
    image[:, here == there] = 0.0
    total = contact[:, here] + (image if same else -image)
    if not same:
        total[:, here == there] = 0.0
    for k, place in zip(*np.nonzero(total.any((2, 3))), strict=True):
        a = slice(3 * place, 3 * place + 3)
        tiles[k, a, k, a] += total[k, place].T


def _eliminate(
    first: Array,
    beside: Array,
    rest: Array,
    carried: list[Array],
    joint: bool,
    angles: int,
    pool: ThreadPoolExecutor,
) -> tuple[Array, Array, Array]:
    """L of the first block, X = L^-1 beside, and rest - X^T X; lower triangles only.

    ``carried``: what earlier levels left of the first nodes, of each part or of both;
    ``joint``: the blocks hold both parts.
    """
    if not len(first):
        return first, beside, rest
    parts = 2 if joint else 1
    whole = first.T.reshape(parts, angles, -1, parts, angles, len(first) // (parts * angles))
    blocks = parts // max(len(carried), 1)
    for h, more in enumerate(carried):
        add = more.T.reshape(blocks, angles, -1, blocks, angles, len(more) // (blocks * angles))
        m = add.shape[2]
        whole[h : h + blocks, :, :m, h : h + blocks, :, :m] += add
    L, info = spotrf(first, lower=1, overwrite_a=1)
    if info:
        raise Indefinite("the tangent stiffness is not positive definite")
    width = beside.shape[1]
    if not width:
        return L, beside, rest
    middle = width // 2
    halves = [slice(0, middle), slice(middle, width)]
    # two threads share the work the same way everywhere, so that the bits are the same too
    solve = lambda cols: strtrs(L, beside[:, cols], lower=1, overwrite_b=1)[0]
    X = np.concatenate(list(pool.map(solve, halves)), 1)

    def update(rows: slice) -> None:
        cols = slice(0, rows.stop)
        rest[rows, cols] -= (X[:, cols].T @ X[:, rows]).T

    third = int(width * 0.7)  # about half of the triangle
    list(pool.map(update, [slice(0, third), slice(third, width)]))
    return L, X, rest
