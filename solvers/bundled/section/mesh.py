"""The section's mesh from a deck: nodes, elements, sets, surfaces, with their operators."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import Inverted
from ...language.spelling import named
from ...language.text import COMPLEX_STEP, WHOLE_DECK, Block, DeckError, is_label
from . import elements
from .embedding import Embedded, Guest, embedding
from .shapes import TYPES
from .symmetry import Whole

Array = np.ndarray


@dataclass
class DeckMesh:
    """Nodes, elements, sets and operators: all that the materials do not touch."""

    X: Array  # (n, 2): R, Z, m
    index: dict[int, int]  # node number to row
    connectivity: dict[str, Array]  # element type to rows (e, a) of nodes
    place: dict[int, tuple[str, int]]  # element number to (type, row of its block)
    node_sets: dict[str, list[int]]
    element_sets: dict[str, list[int]]
    edges: dict[str, Array]  # surface name to rows (e, 2 or 3) of nodes
    reference_nodes: dict[int, list[int]]  # of rigid rims, to the nodes tied to them
    embedded: dict[str, Embedded] = field(default_factory=dict)  # of lines in other elements
    guests: list[Guest] = field(default_factory=list)  # their nodes that are no rubber's
    symmetry: Whole = field(default_factory=Whole)  # what the elements stand for
    like: DeckMesh | None = None  # the same without the tangents of X
    # what was made of the mesh, by its kind and what it depends on
    derived: dict[tuple[object, ...], Any] = field(default_factory=dict)

    @cached_property
    def blocks(self) -> dict[str, elements.Solids | elements.Lines]:
        """Element type to operators. Raises DeckError."""
        return {kind: self._block(kind, rows) for kind, rows in self.connectivity.items()}

    def _block(self, kind: str, rows: Array) -> elements.Solids | elements.Lines:
        """Operators of the elements of one type. Raises DeckError if one has no positive area."""
        share = self.symmetry.share(rows)
        if kind in self.embedded:
            weights = self.embedded[kind].weights(self.X, self.guests)
            return elements.lines(self.X, rows, share=share, weights=weights)
        if not TYPES[kind].faces:
            return elements.lines(self.X, rows, share=share)
        try:
            return elements.solids(self.X, rows, TYPES[kind], share)
        except Inverted as error:
            number = next(e for e, p in self.place.items() if p == (kind, error.element))
            raise DeckError(
                WHOLE_DECK,
                f"element {number} has no positive area: it folds over or its nodes run clockwise",
            ) from None

    def type_of(self, kind: str) -> str:
        """The element type of a block."""
        return self.embedded[kind].line if kind in self.embedded else kind

    @cached_property
    def faces(self) -> dict[str, elements.Lines]:
        """Surface name to lines."""
        return {
            name: elements.lines(
                self.X, rows, 3 if rows.shape[1] == 3 else 2, self.symmetry.share(rows)
            )
            for name, rows in self.edges.items()
        }


_MESHES: OrderedDict[tuple[object, ...], DeckMesh] = OrderedDict()
OF_THE_MESH = {"NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "RIGID BODY", "EMBEDDED ELEMENT"}


def read_mesh(keywords: list[Block]) -> DeckMesh:
    """The mesh of a section job, remembered while its blocks stay the same. Raises DeckError."""
    topology = [k for k in keywords if k.name in OF_THE_MESH]
    seeded = [k for k in topology if k.is_seeded]
    if any(k.name != "NODE" for k in seeded):
        return _mesh(topology)
    key = tuple(k.identity for k in topology)
    known = _MESHES.get(key)
    _MESHES[key] = mesh = known if known is not None else _mesh(topology)
    _MESHES.move_to_end(key)
    while len(_MESHES) > 8:
        _MESHES.popitem(last=False)
    if seeded and mesh.embedded:  # whose hosts' nodes move the places of others
        return _mesh(topology)
    return _with_tangents(mesh, seeded) if seeded else mesh


def _with_tangents(mesh: DeckMesh, seeded: list[Block]) -> DeckMesh:
    """The mesh with the tangents of its nodes' coordinates: the same elements and sets."""
    moved = [
        (mesh.index[row.integer(0)], place - 1, tangent)
        for k in seeded
        for row in k.rows
        for place, tangent in (row.tangents or {}).items()
        if place in (1, 2)  # R and Z
    ]
    rate = np.zeros_like(mesh.X)
    if moved:
        nodes, components, tangents = zip(*moved, strict=True)
        rate[list(nodes), list(components)] = tangents
    X = mesh.X + 1j * COMPLEX_STEP * rate
    return replace(mesh, X=X, like=mesh, derived={})


def _mesh(keywords: list[Block]) -> DeckMesh:
    """The mesh of a deck's nodes, elements, sets and surfaces. Raises DeckError."""
    index: dict[int, int] = {}
    coordinates: list[tuple[complex | float, complex | float]] = []
    node_sets: dict[str, list[int]] = {}
    element_sets: dict[str, list[int]] = {}
    connectivity: dict[str, list[list[int]]] = {}
    place: dict[int, tuple[str, int]] = {}
    for k in keywords:
        if k.name == "NODE":
            numbers = []
            for row in k.rows:
                number = row.integer(0)
                if number in index:
                    raise DeckError(row.place, f"node {number} is defined twice")
                index[number] = len(coordinates)
                coordinates.append((row.value(1), row.value(2, 0.0)))
                numbers.append(number)
            if k.get("NSET"):
                node_sets.setdefault(k.get("NSET"), []).extend(numbers)
        elif k.name == "ELEMENT":
            _elements(k, index, connectivity, place, element_sets)
        elif k.name == "NSET":
            node_sets.setdefault(k.need("NSET"), []).extend(_members(k, node_sets, index))
        elif k.name == "ELSET":
            element_sets.setdefault(k.need("ELSET"), []).extend(_members(k, element_sets, place))
    X = np.array(coordinates)
    tables = {kind: np.array(rows) for kind, rows in connectivity.items()}
    inside = [k for k in keywords if k.name == "EMBEDDED ELEMENT"]
    edges = {
        k.need("NAME"): _surface(k, connectivity, place, element_sets)
        for k in keywords
        if k.name == "SURFACE"
    }
    bodies = {}
    for k in keywords:
        if k.name == "RIGID BODY":
            reference, tied = int(k.number("REF NODE") or 0), k.need("TIE NSET")
            if reference not in index or tied not in node_sets:
                raise DeckError(k.place, f"node {reference} or node set {tied} is not defined")
            bodies[reference] = node_sets[tied]
    mesh = DeckMesh(X, index, tables, place, node_sets, element_sets, edges, bodies)
    return _with_embedded(mesh, inside) if inside else mesh


def _with_embedded(mesh: DeckMesh, keywords: list[Block]) -> DeckMesh:
    """The mesh without the nodes that move with host elements. Raises DeckError."""
    embedded = embedding(keywords, mesh.X, mesh.connectivity, mesh.place, mesh.element_sets)
    kept = np.setdiff1d(np.arange(len(mesh.X)), list(embedded.of_node))
    new = np.full(len(mesh.X), -1)
    new[kept] = np.arange(len(kept))
    connectivity, place = {}, dict(mesh.place)
    for kind, rows in mesh.connectivity.items():
        own = [number for number, (k, _) in mesh.place.items() if k == kind]
        own = [number for number in own if number not in embedded.place]
        if own:
            connectivity[kind] = new[rows[[mesh.place[number][1] for number in own]]]
            place |= {number: (kind, k) for k, number in enumerate(own)}
    blocks = {kind: block.renumbered(new) for kind, block in embedded.blocks.items()}
    for name, rows in mesh.edges.items():
        if (new[rows] < 0).any():
            raise DeckError(keywords[0].place, f"surface {name} is on an embedded element")
    index = {number: int(new[row]) for number, row in mesh.index.items() if new[row] >= 0}
    sets = {name: [n for n in nodes if n in index] for name, nodes in mesh.node_sets.items()}
    return replace(
        mesh,
        X=mesh.X[kept],
        index=index,
        connectivity=connectivity | {kind: block.rows for kind, block in blocks.items()},
        place=place | embedded.place,
        node_sets=sets,
        edges={name: new[rows] for name, rows in mesh.edges.items()},
        reference_nodes={n: [m for m in s if m in index] for n, s in mesh.reference_nodes.items()},
        embedded=blocks,
        guests=[guest.renumbered(new) for guest in embedded.guests],
    )


def _elements(
    k: Block,
    index: dict[int, int],
    connectivity: dict[str, list[list[int]]],
    place: dict[int, tuple[str, int]],
    sets: dict[str, list[int]],
) -> None:
    """Add the elements of an *ELEMENT block to ``connectivity``, ``place`` and ``sets``. Raises
    DeckError."""
    kind = k.need("TYPE")
    if kind not in TYPES:
        raise DeckError(
            k.place, f"TYPE={kind} of *ELEMENT is not honoured, only {' or '.join(TYPES)}"
        )
    table, count = connectivity.setdefault(kind, []), TYPES[kind].nodes
    for row in k.rows:
        number, nodes = row.integer(0), [row.integer(i + 1) for i in range(count)]
        if len(row.fields) != count + 1:
            raise DeckError(row.place, f"a {kind} element has {count} nodes")
        if number in place:
            raise DeckError(row.place, f"element {number} is defined twice")
        missing = [n for n in nodes if n not in index]
        if missing:
            raise DeckError(row.place, f"node {missing[0]} of element {number} is not defined")
        place[number] = kind, len(table)
        table.append([index[n] for n in nodes])
        if k.get("ELSET"):
            sets.setdefault(k.get("ELSET"), []).append(number)


def _members(k: Block, sets: dict[str, list[int]], known: dict) -> list[int]:
    """Numbers in a set by a *NSET or *ELSET block. Raises DeckError."""
    members: list[int] = []
    in_order = sorted(known) if "GENERATE" in k.parameters else []
    for row in k.rows:
        if "GENERATE" in k.parameters:
            first, last = row.integer(0), row.integer(1)
            numbers = range(first, last + 1, max(row.integer(2, 1), 1))
            some = [n for n in in_order if n in numbers]  # a range may have gaps
            if not some:
                raise DeckError(row.place, f"no member of the set is from {first} to {last}")
            members += some
            continue
        for position, text in enumerate(row.fields):
            if not text:
                continue
            if is_label(text):
                members.append(row.integer(position))
            elif named(text) in sets:
                members += sets[named(text)]
            else:
                raise DeckError(row.place, f"set {text} is not defined")
    unknown = [m for m in members if m not in known]
    if unknown:
        raise DeckError(k.place, f"member {unknown[0]} of the set is not defined")
    return members


def _surface(
    k: Block,
    connectivity: dict[str, list[list[int]]],
    place: dict[int, tuple[str, int]],
    sets: dict[str, list[int]],
) -> Array:
    """Nodes (edges, 2 or 3) of the edges of a *SURFACE. Raises DeckError."""
    rows: list[list[int]] = []
    for row in k.rows:
        name, face = row.name(0), row.name(1)
        members = sets.get(name) or ([int(name)] if is_label(name) else None)
        if members is None:
            raise DeckError(row.place, f"element set {name} is not defined")
        if face not in ("S1", "S2", "S3", "S4", "SPOS"):
            raise DeckError(row.place, f"face '{face}' is not one of S1, S2, S3, S4, SPOS")
        for number in members:
            kind, position = place[number]
            order = TYPES[kind].faces
            if face == "SPOS" and not order:
                # seen from the left of its direction, as a solid's face is from the right
                rows.append(connectivity[kind][position][::-1])
                continue
            if not order or face == "SPOS":
                raise DeckError(row.place, f"element {number} of type {kind} has no face {face}")
            rows.append([connectivity[kind][position][i] for i in order[int(face[1]) - 1]])
    if len({len(nodes) for nodes in rows}) > 1:
        raise DeckError(k.place, "a surface with edges of two and of three nodes is not honoured")
    return np.array(rows)
