"""The order in which the pressed tyre's unknowns are eliminated: nested dissection.

The section in columns of elements, from the bead to the middle of the tread, times the pieces round
the tyre: a rectangle of cells, of which only neighbours couple. A box of cells is cut where fewest
unknowns lie between the halves; those go last, and the halves by themselves before (George, SIAM J.
Numer. Anal. 10, 345, 1973). Where no cords run at a bias the two parts of a field (`HalfTurn`) are
boxes of their own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import Refused
from .half_turn_symmetry import HalfTurn

Array = np.ndarray
MAX_UNDIVIDED = 200  # unknowns inside a box that is not cut any more
Range = tuple[int, int]  # of columns or pieces: the first, and the one after the last


@dataclass(frozen=True)
class Kind:
    """Elements of one kind in a column, with their mirror images."""

    here: Array  # (e,) rows of the elements on z >= 0
    there: Array  # (e,) rows of their images
    turned: Array  # (e, a): where in the image each node's own image stands
    places: Array  # (e, a): of the nodes here among the column's, -1 of held ones


@dataclass(frozen=True)
class ElementColumn:
    """Elements between two levels of nodes."""

    nodes: slice  # in `Dissection.along`
    kinds: list[Kind]


@dataclass(frozen=True)
class Front:
    """Unknowns, flat indices of the two parts, that are eliminated together."""

    parts: tuple[int, ...]  # 0, 1 or both
    own: Array  # the unknowns that are eliminated
    left: Array  # what they are coupled with that goes later
    inner: list[int]  # the boxes inside, by their place in the order
    # columns and pieces of a box that is not cut any more, else None
    cells: tuple[Range, Range] | None


class Dissection:
    """Columns from the elements' connectivities, and fronts over them. Raises Refused."""

    def __init__(self, connectivities: list[Array], symmetry: HalfTurn):
        self.symmetry = symmetry
        self.columns, self.along, self._nodes = _columns(connectivities, symmetry)
        mask = symmetry.mask
        # of free components, in the order of the columns
        self._mask = np.ascontiguousarray(mask[:, :, self.along])
        flat = np.arange(mask.size).reshape(mask.shape)[:, :, self.along]
        self._flat = np.ascontiguousarray(flat)
        pieces = [np.arange(p.functions.start, p.functions.stop) for p in symmetry.around.pieces]
        self._functions = _ranges(pieces, symmetry.mask.shape[1])  # as ``_nodes`` of the columns

    def fronts(self, coupled: int) -> list[Front]:
        """Fronts in the order of elimination; from the column ``coupled`` on, the first of which
        cords at a bias couple the parts, these go together."""
        fronts: list[Front] = []
        columns, pieces = len(self.columns), len(self.symmetry.around.pieces)
        self._cut(fronts, (0, 1), (0, columns), (0, pieces), coupled)
        return fronts

    def _cut(
        self, fronts: list[Front], parts: tuple[int, ...], columns: Range, pieces: Range, first: int
    ) -> list[int]:
        """Add a box's fronts; places of its last, of each part by itself or of both. first: the
        column ``coupled``."""
        again = lambda c, p: self._cut(fronts, parts, c, p, first)
        if len(parts) == 2 and columns[1] <= first:
            return [i for part in parts for i in self._cut(fronts, (part,), columns, pieces, first)]
        inside = self._inside(columns, pieces)
        unknown = self._mask[list(parts)]
        halves: list[tuple[Range, Range]] = []
        if len(parts) == 2 and columns[0] < first:
            halves = [((columns[0], first), pieces), ((first, columns[1]), pieces)]
        elif unknown[:, inside].sum() > MAX_UNDIVIDED:
            a, b = (sum(along) // 2 for along in (columns, pieces))
            ways = [
                [((columns[0], a), pieces), ((a, columns[1]), pieces)],
                [(columns, (pieces[0], b)), (columns, (b, pieces[1]))],
            ]
            ways = [
                way
                for way, along in zip(ways, (columns, pieces), strict=True)
                if along[1] - along[0] > 1
            ]
            size = lambda way: unknown[:, inside & ~self._apart(way)].sum()
            halves = min(ways, key=size, default=[])
        own = inside & ~self._apart(halves)
        inner = [i for half in halves for i in again(*half)]
        cells = None if halves else (columns, pieces)
        touched = np.multiply.outer(_meet(self._functions, pieces), _meet(self._nodes, columns))
        left = self._unknowns(parts, touched & ~inside)
        fronts.append(Front(parts, self._unknowns(parts, own), left, inner, cells))
        return [len(fronts) - 1]

    def _apart(self, halves: list[tuple[Range, Range]]) -> Array:
        """Unknowns inside one of the halves, a mask (f, q)."""
        inside = np.zeros(self.symmetry.mask.shape[1:3], bool)
        for half in halves:
            inside |= self._inside(*half)
        return inside

    def _inside(self, columns: Range, pieces: Range) -> Array:
        """Unknowns that a box of cells couples only with each other, a mask (f, q)."""
        within = lambda ends, box: (ends[0] >= box[0]) & (ends[1] < box[1])
        return np.multiply.outer(within(self._functions, pieces), within(self._nodes, columns))

    def _unknowns(self, parts: tuple[int, ...], chosen: Array) -> Array:
        """Flat indices of the free components of the (function, node) in a mask (f, q)."""
        rows = np.flatnonzero(chosen)
        by_row = lambda values, part: values[part].reshape(-1, 3)[rows]
        return np.concatenate(
            [by_row(self._flat, part)[by_row(self._mask, part)] for part in parts]
        )


def _meet(ends: Array, box: Range) -> Array:
    """Mask of the members, as `_ranges` has them, of which a group is in the box."""
    return np.asarray((ends[1] >= box[0]) & (ends[0] < box[1]))


def _ranges(groups: list[Array], count: int) -> Array:
    """First and last group (2, count) of each member; of none: last before first."""
    first, last = np.full(count, len(groups)), np.full(count, -1)
    for i, members in enumerate(groups):
        first[members] = np.minimum(first[members], i)
        last[members] = i
    return np.array([first, last])


def _columns(
    connectivities: list[Array], symmetry: HalfTurn
) -> tuple[list[ElementColumn], Array, Array]:
    """Columns from the bead on; the nodes (q,) in that order, and of each the first and last
    column. Raises Refused."""
    place = np.full(symmetry.shape[1], -1)
    place[symmetry.nodes] = np.arange(len(symmetry.nodes))
    other = symmetry.other
    beyond = place < 0
    inner = (place >= 0) & (other != np.arange(symmetry.shape[1]))
    chosen = []  # elements on z >= 0, their images, and their nodes' places in the quarter
    for c in connectivities:
        if (beyond[c].any(1) & inner[c].any(1)).any():
            raise Refused("an element straddles the middle plane")
        inside = np.flatnonzero((place[c] >= 0).all(1))
        chosen.append((inside, *_images(c, inside, other), place[c[inside]]))
    level = _levels([c for *_, c in chosen], symmetry)
    highest = [level[c].max(1, initial=-1) for *_, c in chosen]
    groups = [
        [[a[high == i] for a in each] for each, high in zip(chosen, highest, strict=True)]
        for i in range(level.max() + 1)
        if any((high == i).any() for high in highest)
    ]
    free = [np.unique(np.concatenate([c.ravel() for *_, c in kinds])) for kinds in groups]
    free = [nodes[level[nodes] >= 0] for nodes in free]
    ends = _ranges(free, len(level))
    along = np.lexsort(ends)  # by columns, so that a column's nodes stand together
    rank = np.argsort(along)
    columns = []
    for nodes, kinds in zip(free, groups, strict=True):
        first = rank[nodes].min()
        place = np.where(level < 0, -1, rank - first)
        its = [Kind(here, there, turned, place[c]) for here, there, turned, c in kinds]
        columns.append(ElementColumn(slice(first, first + len(nodes)), its))
    return columns, along, ends[:, along]


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
    """Number of elements between each node and the nodes ``start`` (n,), along free nodes; -1: none
    leads there."""
    level = np.where(start & free, 0, -1)
    current = 0
    while (level == current).any():
        near = [c[(level[c] == current).any(1)].ravel() for c in connectivities]
        following = np.unique(np.concatenate(near))
        current += 1
        level[following[(level[following] == -1) & free[following]]] = current
    return level
