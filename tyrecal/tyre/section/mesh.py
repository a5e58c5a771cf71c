"""Mesh of the whole section: element rows with their edges on the cord lines.

Numbers in the deck, with the row i counted from the inner surface and the column j from the bead at
-z, both from 0: a node has 1000 (j + 1) + i + 1, a solid the same with i, j of the elements. The
element in column j of cord line k has 1000000 k + j + 1; k of the innermost line is the number of
lines.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from .section import Section, SectionError, resample

Array = np.ndarray


@dataclass(eq=False)
class SectionMesh:
    """Nodes, solids and cord lines of both halves; everything keyed by its deck number."""

    quadratic: bool
    nodes: dict[int, tuple[float, float]]  # number to (r, z) in m
    # number to corner (and midside) nodes, counter-clockwise in (r, z)
    solids: dict[int, tuple[int, ...]]
    cells: dict[int, tuple[str, int]]  # number of a solid to (region, row)
    # line name to {number: nodes}, running from -z to +z
    cords: dict[str, dict[int, tuple[int, ...]]]
    rim: list[int]  # nodes that the rim holds
    inner: list[int]  # solids whose faces S4 are the inner surface
    outer: list[int]  # solids whose faces S2 are the outer surface
    shape: tuple[int, int]  # (elements along, rows)
    # nodes of the outer surface where the outermost cord line is below, from -z to +z
    crown_outer: list[int] = field(default_factory=list)

    def region_of(self, cord: int) -> str:
        """The region that an element of a cord line lies in."""
        return self.cells[1000 * (cord % 1_000_000) + 1][0]

    def corners(self) -> Array:
        """The solids' corner nodes: (row points, columns), from the inner surface out."""
        step = 2 if self.quadratic else 1
        along, rows = self.shape
        return 1000 * (step * np.arange(along + 1) + 1) + step * np.arange(rows + 1)[:, None] + 1

    def grid(self) -> tuple[Array, Array]:
        """Corner nodes (k,), and the places (element, 4) of each element's among them."""
        nodes = self.corners()
        k = np.arange(nodes.size).reshape(nodes.shape)
        quads = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], -1)
        return nodes.ravel(), quads.reshape(-1, 4)

    def skin(self) -> Array:
        """Corner nodes (k,) of the outer surface and the beads' ends, from one end of the inner
        surface, at -z, to the other."""
        grid = self.corners()
        return np.concatenate([grid[:-1, 0], grid[-1], grid[-2::-1, -1]])

    def outline(self) -> list[int]:
        """Numbers of the nodes round the section, closed."""
        step = 2 if self.quadratic else 1
        columns, rows = (step * n for n in self.shape)
        walk = [(0, j) for j in range(columns)] + [(i, columns) for i in range(rows)]
        walk += [(rows, j) for j in range(columns, 0, -1)] + [(i, 0) for i in range(rows, -1, -1)]
        return [1000 * (j + 1) + i + 1 for i, j in walk]

    # of a mesh that comes with materials, as a deck's; else the case has them

    @property
    def angles(self) -> dict[str, float]:
        """Angles of its own layers by name, degrees from the meridian."""
        return {}

    @property
    def layers(self) -> dict[str, list[tuple[int, ...]]]:
        """Nodes of the elements to draw each of its own layers with."""
        return {}

    @property
    def compounds(self) -> dict[str, list[tuple[int, ...]]]:
        """Corner nodes of the elements of each of its own compounds."""
        return {}

    @property
    def lines_by_cord(self) -> dict[str, list[tuple[int, ...]]]:
        """Nodes of the elements of its own layers, by their material."""
        return {}

    @property
    def inner_ends(self) -> tuple[int, int]:
        """First and last node of the inner surface."""
        return self.solids[self.inner[0]][0], self.solids[self.inner[-1]][3]

    @property
    def outer_nodes(self) -> list[int]:
        """Nodes of the outer surface from -z to +z, midside ones too."""
        faces = (self.solids[number] for number in self.outer)
        return sorted({nodes[k] for nodes in faces for k in (1, 2, 5) if k < len(nodes)})


@lru_cache(maxsize=32)  # of a tyre with as many fields of its section, each to either side
def kept_mesh(
    section: Section,
    elements: tuple[int, ...],
    rows: tuple[int, ...],
    quadratic: bool,
    grading: tuple[float, ...] | None,
    whole_bead: bool,
) -> SectionMesh:
    """`build_mesh`, kept: one mesh of a section for all who need it, who must not change it."""
    grades = list(grading or ()) or None
    return build_mesh(section, list(elements), list(rows), quadratic, grades, whole_bead)


def build_mesh(
    section: Section,
    elements: list[int],
    rows: list[int],
    quadratic: bool,
    grading: list[float] | None = None,
    whole_bead: bool = True,
) -> SectionMesh:
    """Mesh ``section`` with ``elements`` per region (half section) and ``rows`` between lines.

    ``grading``: thickness of a row over that of the row inside it, per gap between two lines.

    quadratic: 8-node elements, their midside nodes on the section's own curves, else 4-node ones.
    The rim holds the ``whole_bead`` where stations are rigid, or its outside and its end.
    Raises SectionError when an element folds over.
    """
    step = 2 if quadratic else 1
    lines, regions, rigid, present = resample(section, [step * n for n in elements])
    grid = _through_thickness(
        lines, rows, step, grading or [1.0] * len(rows)
    )  # (row points, columns, 2)
    mirrored = grid[:, :0:-1] * [1.0, -1.0]
    grid = np.concatenate([mirrored, grid], 1)
    regions = regions[::-1] + regions
    rigid = np.concatenate([rigid[:0:-1], rigid])
    present = np.concatenate([present[:, :0:-1], present], 1)
    _check_unfolded(grid, regions)

    height, width = grid.shape[0], grid.shape[1]
    number = lambda i, j: 1000 * (j + 1) + i + 1
    nodes, rim = {}, []
    for j in range(width):
        for i in range(0, height, step if j % step else 1):
            nodes[number(i, j)] = (float(grid[i, j, 0]), float(grid[i, j, 1]))
            if rigid[j] and (whole_bead or i == height - 1 or j in (0, width - 1)):
                rim.append(number(i, j))
    solids, cells, inner, outer = {}, {}, [], []
    for j in range(0, width - 1, step):
        for i in range(0, height - 1, step):
            corners = [(i, j), (i + step, j), (i + step, j + step), (i, j + step)]
            if quadratic:
                corners += [(i + 1, j), (i + 2, j + 1), (i + 1, j + 2), (i, j + 1)]
            name = number(i // step, j // step)
            solids[name] = tuple(number(*c) for c in corners)
            cells[name] = regions[j], i // step
            if i == 0:
                inner.append(name)
            if i + step == height - 1:
                outer.append(name)
    edges = np.concatenate([[0], np.cumsum(rows)]) * step
    cords = {}
    for k, line in enumerate(section.names):
        number_of = k or len(section.names)  # solids have those below a million
        cords[line] = {
            1000000 * number_of + j // step + 1: tuple(
                number(int(edges[k]), c) for c in range(j, j + step + 1)
            )
            for j in range(0, width - 1, step)
            if present[k, j : j + step + 1].all()
        }
    there = present[-2]  # the outermost line; of its runs, the one over the crown
    middle = width // 2
    run = [j for j in range(width) if there[min(j, middle) : max(j, middle) + 1].all()]
    crown = run or list(range(width))
    crown_outer = [number(height - 1, j) for j in crown]
    return SectionMesh(
        quadratic,
        nodes,
        solids,
        cells,
        cords,
        rim,
        inner,
        outer,
        ((width - 1) // step, (height - 1) // step),
        crown_outer,
    )


def _through_thickness(lines: Array, rows: list[int], step: int, grading: list[float]) -> Array:
    """Points on and between the lines (line, column, 2), (row points, columns, 2); midside points
    too if ``step`` is 2."""
    layers = [lines[:1]]
    for below, above, count, ratio in zip(lines, lines[1:], rows, grading, strict=False):
        edges = np.concatenate([[0.0], np.cumsum(ratio ** np.arange(count))])
        places = np.arange(1, count * step + 1) / step
        share = np.interp(places, np.arange(count + 1), edges / edges[-1])[:, None, None]
        layers.append(below + share * (above - below))
    return np.concatenate(layers)


def _check_unfolded(grid: Array, regions: list[str]) -> None:
    """Raises SectionError for a cell of the grid with no positive area at one of its corners."""
    along, across = np.diff(grid, axis=1), np.diff(grid, axis=0)

    def area(u: Array, v: Array) -> Array:  # of the parallelogram of vectors (..., 2)
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    corners = [
        area(across[:, c], along[r])
        for c in (slice(None, -1), slice(1, None))
        for r in (slice(None, -1), slice(1, None))
    ]
    folded = np.argwhere(np.minimum.reduce(corners) <= 0)
    if len(folded):
        i, j = folded[0]
        r, z = grid[i, j] * 1e3
        raise SectionError(
            f"the section folds over in region '{regions[j]}' near r = {r:.1f} mm, z = {z:.1f} mm"
        )
