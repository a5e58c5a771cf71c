"""Nodes, elements and sets of a part, or of what stands outside parts, as they are generated."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from .text import Block, Row, is_label, language

Array = np.ndarray
Point = tuple[float, float]  # r, z in the deck's unit of length
Members = Callable[[], list[int]]  # numbers in a set, looked up once all are known
Content = TypeVar("Content")
CORNERS_OF = {3: 3, 4: 4, 6: 3, 8: 4}  # of solids by their number of nodes
FARTHEST = 1e9  # coordinate, in any unit
MOST = 200_000  # nodes or elements that a deck generates
# beginnings of ABAQUS' types of elements: solids; surfaces and membranes; rigid lines
SOLID, PLIES, RIGID = "CGAX", ("SFMGAX", "MGAX"), "RAX"
BEGINNINGS = (SOLID, *PLIES, RIGID)


@dataclass(frozen=True, eq=False)
class Element:
    """An element: its type, nodes (labels of its scope) and the line that it stands on."""

    kind: str
    nodes: tuple[int, ...]
    block: Block
    row: Row

    @property
    def is_solid(self) -> bool:
        """Whether it fills an area."""
        return self.kind.startswith(SOLID)

    @property
    def is_ply(self) -> bool:
        """Whether it holds cords."""
        return self.kind.startswith(PLIES)

    @property
    def is_rigid(self) -> bool:
        """Whether it is a line of a rim."""
        return self.kind.startswith(RIGID)


class MeshTable(dict[int, Content]):
    """Nodes, or elements, by number, and the sets of them by name, in pieces. what: node or
    element; block, and row if any: the lines that errors name."""

    def __init__(self, what: str):
        super().__init__()
        self.what, self.keyword = what, {"node": "NSET", "element": "ELSET"}[what]
        self.sets: dict[str, list[tuple[Block, Members]]] = {}
        self._asked: list[str] = []  # sets whose members are being looked up

    def members(self, name: str, block: Block, row: Row | None = None) -> list[int]:
        """Numbers in a set, or the number that a name is. Raises OwnDeckError."""
        if is_label(name) and int(name) in self:
            return [int(name)]
        if name not in self.sets:
            raise block.refused(f"{self.what} set {name} is not defined", row)
        if name in self._asked:
            raise block.refused(f"{self.what} set {name} holds itself", row)
        self._asked.append(name)
        members = dict.fromkeys(n for _, of in self.sets[name] for n in of())
        self._asked.pop()
        return list(members)

    def add_to_set(self, name: str, block: Block, members: Members) -> None:
        """Add members that a keyword puts into a set."""
        self.sets.setdefault(name, []).append((block, members))

    def put(self, block: Block, numbers: list[int]) -> None:
        """New ones go to the set that their keyword names, if it names one."""
        if name := block.get("NEW SET") or block.get(self.keyword):
            self.add_to_set(name, block, lambda: numbers)

    def add(self, number: int, content: Content, block: Block, row: Row | None) -> None:
        """A new one. Raises OwnDeckError for a number that none can have, or too many."""
        if not 1 <= number <= language.MAX_LABEL:
            words = f"numbers go from 1 to {language.MAX_LABEL}"
            raise block.refused(f"{self.what} {number}: {words}", row)
        if len(self) > MOST:
            raise block.refused(f"there are more than {MOST} {self.what}s", row)
        self[number] = content


@dataclass
class Scope:
    """Nodes, elements and sets that the mesh keywords of one *PART, or of the model, make."""

    nodes: MeshTable[Point] = field(default_factory=lambda: MeshTable("node"))
    elements: MeshTable[Element] = field(default_factory=lambda: MeshTable("element"))
    # of *SYSTEM: origin, and direction of its first axis
    system: tuple[Point, Point] = (0.0, 0.0), (1.0, 0.0)

    def rubber_nodes(self) -> set[int]:
        """Nodes of the solids."""
        return {n for e in self.elements.values() if e.is_solid for n in e.nodes}

    def place(self, block: Block, row: Row | None, number: int, place: Point | Array) -> None:
        """A new node."""
        point, old = (float(place[0]), float(place[1])), self.nodes.get(number)
        if old is not None and max(abs(old[0] - point[0]), abs(old[1] - point[1])) > 0:
            raise block.refused(f"node {number} is defined twice, at two places", row)
        if not max(map(abs, point)) < FARTHEST:
            raise block.refused(f"node {number} is at {point}: no tyre is so large", row)
        self.nodes.add(number, point, block, row)

    def make(self, block: Block, row: Row, number: int, kind: str, nodes: tuple[int, ...]) -> None:
        """A new element."""
        if number in self.elements:
            raise block.refused(f"element {number} is defined twice", row)
        missing = [n for n in nodes if n not in self.nodes]
        if missing:
            raise block.refused(f"node {missing[0]} of element {number} is not defined", row)
        if len(set(nodes)) < len(nodes):
            raise block.refused(f"element {number} has a node twice", row)
        self.elements.add(number, Element(kind, nodes, block, row), block, row)


def label_lines(numbers: Sequence[int]) -> list[str]:
    """Data lines of numbers of nodes or elements."""
    return [", ".join(map(str, numbers[k : k + 12])) for k in range(0, len(numbers), 12)]


def mirror_of(block: Block) -> Callable[[Point], Point]:
    """The mirror image about a line through two points, r, z, 0 each, on one data line or on
    two. Raises OwnDeckError."""
    values = [row.number(i, 0.0) for row in block.rows for i in range(len(row.fields))]
    if len(block.rows) == 2 and all(len(row.fields) <= 3 for row in block.rows):
        values = [row.number(i, 0.0) for row in block.rows for i in range(3)]
    values += [0.0] * (6 - len(values))
    ar, az, a3, br, bz, b3 = values[:6]
    d = np.array([br - ar, bz - az])
    if len(values) > 6 or a3 or b3 or not d.any():
        raise block.refused("the line goes through two points of the section: r, z, 0, r, z, 0")
    d /= np.hypot(*d)

    def mirror(point: Point) -> Point:
        u = np.array([point[0] - ar, point[1] - az])
        r, z = 2 * (u @ d) * d - u
        return float(ar + r), float(az + z)

    return mirror


def reflected(element: Element, nodes: tuple[int, ...]) -> tuple[int, ...]:
    """The nodes of a mirrored element in an order that keeps its area positive, and a line's
    direction from one bead to the other."""
    if not element.is_solid:
        return nodes[::-1]
    corners = CORNERS_OF[len(nodes)]
    first = (nodes[0], *nodes[corners - 1 : 0 : -1])
    return first + nodes[: corners - 1 : -1]


def faces_of(element: Element) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Names and nodes of a solid's faces, in the order that has the solid on the left in r, z."""
    corners = CORNERS_OF[len(element.nodes)]
    for i in range(corners):
        ends = element.nodes[i], element.nodes[(i + 1) % corners]
        middle = element.nodes[corners + i : corners + i + 1]
        yield f"S{i + 1}", (ends[0], *middle, ends[1])


def corner_areas(element: Element, points: Mapping[int, Point]) -> Array:
    """Twice the area of the triangle at each corner (corner,) of a solid: positive, or it folds."""
    X = np.array([points[n] for n in element.nodes[: CORNERS_OF[len(element.nodes)]]])
    along, back = np.roll(X, -1, 0) - X, np.roll(X, 1, 0) - X
    return np.asarray(along[:, 0] * back[:, 1] - along[:, 1] * back[:, 0])


def along_arc(a: Array, b: Array, centre: Array, share: float) -> Array:
    """The point at a share of the shorter arc from a to b, points (2,) as the centre."""
    u, v = a - centre, b - centre
    angle = np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v) * share
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(centre + np.array([cos * u[0] - sin * u[1], sin * u[0] + cos * u[1]]))


def nearest(X: Array, pieces: Array) -> tuple[Array, Array]:
    """Distance (n,) of points X (n, 2) to the nearest piece (k, 2, 2), from start to end, and unit
    normal (n, 2) there, to the right of the piece; of an end that pieces share, their normals'
    mean."""
    start, along = pieces[:, 0], pieces[:, 1] - pieces[:, 0]
    share = ((X[:, None] - start) * along).sum(-1) / (along**2).sum(-1)
    foot = start + np.clip(share, 0, 1)[..., None] * along
    away = np.hypot(*np.moveaxis(X[:, None] - foot, -1, 0))
    distance = away.min(1)
    near = away <= distance[:, None] + 1e-9 * np.ptp(pieces)
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    normal = near @ outward
    return distance, normal / np.hypot(*normal.T)[:, None]
