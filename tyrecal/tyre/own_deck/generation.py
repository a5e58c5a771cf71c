"""Nodes, elements and sets that mesh keywords make in a scope, written out or generated."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from .scope import (
    BEGINNINGS,
    MOST,
    Array,
    Members,
    MeshTable,
    Point,
    Scope,
    along_arc,
    mirror_of,
    reflected,
)
from .text import Block, Row, element_types, is_label, named


def read(scope: Scope, block: Block) -> None:
    """Add the nodes, elements or sets of a mesh keyword to a scope. Raises OwnDeckError."""
    labels = scope.nodes if block.name[0] == "N" else scope.elements
    if block.name in ("NSET", "ELSET"):
        labels.add_to_set(block.need(block.name), block, members_of(scope, block))
    elif block.name == "SYSTEM":
        _system(scope, block)
    else:
        labels.put(block, list(MESH_READERS[block.name](scope, block)))


def _node(scope: Scope, block: Block) -> Iterator[int]:
    """Number, r, z in the *SYSTEM of the moment."""
    (r0, z0), (c, s) = scope.system
    for row in block.rows:
        r, z = row.number(1, 0.0), row.number(2, 0.0)
        if any(row.fields[3:]) and row.number(3, 0.0):
            raise block.refused("a third coordinate is not honoured: a section is in r, z", row)
        point = (
            (r, z) if (r0, z0, c, s) == (0, 0, 1, 0) else (r0 + c * r - s * z, z0 + s * r + c * z)
        )
        number = row.integer(0)
        scope.place(block, row, number, point)
        yield number


def _system(scope: Scope, block: Block) -> None:
    """Origin and a point on the first axis, of coordinates that follow; none: the deck's own."""
    if not block.rows:
        scope.system = (0.0, 0.0), (1.0, 0.0)
        return
    row = block.rows[0]
    x = [row.number(i, 0.0) for i in range(6)]
    if x[2] or x[5] or (len(block.rows) > 1 and any(block.rows[1].fields)):
        raise block.refused("a system out of the plane of the section is not honoured")
    dr, dz = (x[3] - x[0], x[4] - x[1]) if any(row.fields[3:]) else (1.0, 0.0)
    size = float(np.hypot(dr, dz))
    if not size:
        raise block.refused("its two points are one", row)
    scope.system = (x[0], x[1]), (dr / size, dz / size)


def _ngen(scope: Scope, block: Block) -> Iterator[int]:
    """First and last node, increment of the numbers: on a straight line, or on an arc about a
    node or a point."""
    for row in block.rows:
        first, last, step = row.integer(0), row.integer(1), row.integer(2, 1)
        for n in (first, last):
            if n not in scope.nodes:
                raise block.refused(f"node {n} is not defined above", row)
        if not step or (last - first) % step or (last - first) // step < 1:
            raise block.refused(f"{first} to {last} is no whole number of steps {step}", row)
        count = (last - first) // step
        a, b = np.array(scope.nodes[first]), np.array(scope.nodes[last])
        for k in range(1, count):
            scope.place(block, row, first + k * step, _between(scope, block, row, a, b, k / count))
        yield from range(first, last + step, step)
        if block.get("LINE") != "C" and any(row.fields[3:]):
            raise block.refused("a point of a curve needs LINE=C", row)


def _between(scope: Scope, block: Block, row: Row, a: Array, b: Array, share: float) -> Array:
    """The point at a share of a straight line, or of an arc, from a to b."""
    if block.get("LINE") != "C":
        return a + share * (b - a)
    centre = scope.nodes.get(row.integer(3)) if row.text(3) else (row.number(4), row.number(5))
    if centre is None:
        raise block.refused(f"node {row.text(3)} is not defined above", row)
    if any(row.fields[7:9]):
        raise block.refused("a normal of the arc is not honoured: the shorter arc is taken", row)
    c = np.array(centre)
    u, v = a - c, b - c
    radius, other = np.hypot(*u), np.hypot(*v)
    if abs(radius - other) > 1e-6 * radius or not radius:
        raise block.refused("the arc's ends are not equally far from its centre", row)
    return along_arc(a, b, c, share)


def _nfill(scope: Scope, block: Block) -> Iterator[int]:
    """Two sets, intervals between, increment: nodes on straight lines between their nodes."""
    bias = Row(block.place, block.parameters.get("BIAS", "1")).number(0)
    if bias <= 0:
        raise block.refused("BIAS must be positive")
    for row in block.rows:
        sets = [scope.nodes.members(row.name(i), block, row) for i in (0, 1)]
        for i, members in enumerate(sets):
            defined = scope.nodes.sets.get(row.name(i), ())
            if not any("UNSORTED" in each.parameters for each, _ in defined):
                members.sort()
        if len(sets[0]) != len(sets[1]):
            raise block.refused(f"the sets have {len(sets[0])} and {len(sets[1])} nodes", row)
        count, step = row.integer(2), row.integer(3, 1)
        if not 1 <= count <= MOST:
            raise block.refused(f"the number of intervals must be from 1 to {MOST}", row)
        lengths = bias ** -np.arange(count)  # each is bias times the one behind it
        shares = np.cumsum(lengths) / lengths.sum()
        for first, last in zip(*sets, strict=True):
            if not step or first + count * step != last:
                words = f"{count} steps of {step} do not lead from {first} to {last}"
                raise block.refused(words, row)
            a, b = np.array(scope.nodes[first]), np.array(scope.nodes[last])
            for k in range(1, count):
                scope.place(block, row, first + k * step, a + shares[k - 1] * (b - a))
            yield from range(first, last + step, step)


def _ncopy(scope: Scope, block: Block) -> Iterator[int]:
    """Copies of a set, shifted, or mirrored about a line."""
    shift = block.integer("CHANGE NUMBER")
    old = scope.nodes.members(block.need("OLD SET"), block)
    times = block.integer("MULTIPLE", "1")
    if not 1 <= times <= MOST:
        raise block.refused(f"MULTIPLE must be from 1 to {MOST}")
    if ("SHIFT" in block.parameters) == ("REFLECT" in block.parameters):
        raise block.refused("needs SHIFT or REFLECT=LINE")
    move: Callable[[Point, int], Point]
    if "SHIFT" in block.parameters:
        if not block.rows:
            raise block.refused("a shift is a line of displacements")
        dr, dz = shift_of(block)
        move = lambda point, k: (point[0] + k * dr, point[1] + k * dz)
    else:
        mirror = mirror_of(block)
        move = lambda point, k: mirror(point)
        if times != 1:
            raise block.refused("MULTIPLE goes with SHIFT")
    for k in range(1, times + 1):
        for n in old:
            scope.place(block, None, n + k * shift, move(scope.nodes[n], k))
            yield n + k * shift


def shift_of(block: Block) -> Point:
    """Displacement on the first of the data lines, a second one has a rotation."""
    rows = block.rows
    if len(rows) > 2 or (len(rows) == 2 and rows[1].number(6, 0.0)):
        raise block.refused("a rotation is not honoured")
    dr, dz, beyond = (rows[0].number(i, 0.0) if rows else 0.0 for i in range(3))
    if beyond:
        raise block.refused("a shift out of the section is not honoured", rows[0])
    return dr, dz


def members_of(scope: Scope, block: Block) -> Members:
    """Members that an *NSET or *ELSET puts into its set."""
    if block.name == "ELSET":
        return lambda: _listed(scope.elements, block)
    if of := block.get("ELSET"):
        elements = scope.elements
        return lambda: [n for e in elements.members(of, block) for n in elements[e].nodes]
    return lambda: _listed(scope.nodes, block)


def _listed(labels: MeshTable, block: Block) -> list[int]:
    """Members of a set's data lines: numbers and names of other sets, or first, last, step."""
    result: list[int] = []
    in_order = sorted(labels) if "GENERATE" in block.parameters else []
    for row in block.rows:
        if "GENERATE" in block.parameters:
            first, last, step = row.integer(0), row.integer(1), row.integer(2, 1)
            if step < 1 or last < first or (last - first) % step:
                raise block.refused(f"{first} to {last} is no whole number of steps {step}", row)
            numbers = range(first, last + 1, step)
            some = [n for n in in_order if n in numbers]  # a range may have gaps
            if not some:
                raise block.refused(f"no {labels.what} from {first} to {last} is defined", row)
        else:
            some = []
            for text in filter(None, row.fields):
                some += [int(text)] if is_label(text) else labels.members(named(text), block, row)
        missing = [n for n in some if n not in labels]
        if missing:
            raise block.refused(f"{labels.what} {missing[0]} of the set is not defined", row)
        result += some
    return result


def _element(scope: Scope, block: Block) -> Iterator[int]:
    kind = block.need("TYPE")
    count, _ = element_types.NODES_AND_SECTION.get(kind, (0, ""))
    if not count or not kind.startswith(BEGINNINGS):
        raise block.refused(
            f"TYPE={kind} is no element of a revolved tyre: CGAX for rubber, SFMGAX or MGAX"
            " for plies, RAX2 for a rim; give decks in three dimensions in deck.decks of a case"
        )
    for row in block.rows:
        fields = [field for field in row.fields if field]
        if len(fields) != count + 1:
            raise block.refused(f"a {kind} element has {count} nodes, got {len(fields) - 1}", row)
        number = row.integer(0)
        nodes = tuple(Row(row.place, text).integer(0) for text in fields[1:])
        scope.make(block, row, number, kind, nodes)
        yield number


def _elgen(scope: Scope, block: Block) -> Iterator[int]:
    """Master element; elements of a row with increments of nodes and of numbers; rows likewise."""
    for row in block.rows:
        master = row.integer(0)
        if master not in scope.elements:
            raise block.refused(f"element {master} is not defined above", row)
        element = scope.elements[master]
        if any(row.fields[7:]):
            raise block.refused("layers of elements are not honoured in a section", row)
        along, nodes, numbers = row.integer(1), row.integer(2, 1), row.integer(3, 1)
        rows, row_nodes, row_numbers = row.integer(4, 1), row.integer(5, 1), row.integer(6, 1)
        if along < 1 or rows < 1:
            raise block.refused("the numbers of elements and of rows must be 1 or more", row)
        for j in range(rows):
            for i in range(along):
                number = master + i * numbers + j * row_numbers
                if i or j:
                    shifted = (n + i * nodes + j * row_nodes for n in element.nodes)
                    scope.make(block, row, number, element.kind, tuple(shifted))
                yield number


def _elcopy(scope: Scope, block: Block) -> Iterator[int]:
    """Copies of a set, on nodes of shifted numbers; of mirrored nodes in the reverse order."""
    shift, nodes = block.integer("ELEMENT SHIFT"), block.integer("SHIFT NODES")
    for n in scope.elements.members(block.need("OLD SET"), block):
        element = scope.elements[n]
        shifted = tuple(node + nodes for node in element.nodes)
        if "REFLECT" in block.parameters:
            shifted = reflected(element, shifted)
        row = block.rows[0] if block.rows else element.row
        scope.make(block, row, n + shift, element.kind, shifted)
        yield n + shift


MESH_READERS: dict[str, Callable[[Scope, Block], Iterator[int]]] = {
    "NODE": _node,
    "NGEN": _ngen,
    "NFILL": _nfill,
    "NCOPY": _ncopy,
    "ELEMENT": _element,
    "ELGEN": _elgen,
    "ELCOPY": _elcopy,
}
MESH_KEYWORDS = (*MESH_READERS, "SYSTEM", "NSET", "ELSET")
