"""The mesh of half a section: its elements on z >= 0, which stand for all (see `symmetry`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import Refused
from .embedding import Guest
from .mesh import DeckMesh
from .shapes import TYPES
from .symmetry import SAME_PLACE, MirrorHalf

Array = np.ndarray


def half_mesh(mesh: DeckMesh) -> DeckMesh | None:
    """The same nodes with half of the elements, and those of the sets and surfaces that are their
    own mirror images; remembered with the mesh. None: a node has no mirror image."""
    if ("half",) not in mesh.derived:
        mesh.derived["half",] = _half_like(mesh, mesh.like) if mesh.like else _half(mesh)
    known: DeckMesh | None = mesh.derived["half",]
    return known


def _half_like(mesh: DeckMesh, like: DeckMesh) -> DeckMesh | None:
    """Half mesh of a mesh that differs in the nodes' tangents alone; None: that has none."""
    if (half := half_mesh(like)) is None:
        return None
    assert isinstance(half.symmetry, MirrorHalf)
    return replace(half, X=half.symmetry.alike(mesh.X), derived={})


def _half(mesh: DeckMesh) -> DeckMesh | None:
    """The elements on z >= 0 of a mirror-symmetric mesh; None if it is not mirror-symmetric."""
    try:
        symmetry = MirrorHalf(mesh.X)
        guests = _alike(mesh.guests)
    except Refused:
        return None
    rows = mesh.connectivity
    keep = {kind: symmetry.keeps(nodes) for kind, nodes in rows.items()}
    new_row = {kind: np.cumsum(kept) - 1 for kind, kept in keep.items()}
    place = {
        number: (kind, int(new_row[kind][row]))
        for number, (kind, row) in mesh.place.items()
        if keep[kind][row]
    }
    sets = {
        name: [number for number in numbers if number in place]
        for name, numbers in mesh.element_sets.items()
        if _own_image(mesh, symmetry, numbers)
    }
    edges = {
        name: lines[symmetry.keeps(lines)]
        for name, lines in mesh.edges.items()
        if _same(lines, symmetry.images(lines)) and _halves(symmetry, lines)
    }
    return replace(
        mesh,
        X=symmetry.alike(mesh.X),
        connectivity={kind: nodes[keep[kind]] for kind, nodes in rows.items()},
        place=place,
        element_sets=sets,
        guests=guests,
        embedded={kind: each.some(keep[kind]) for kind, each in mesh.embedded.items()},
        edges=edges,
        symmetry=symmetry,
        derived={},
    )


def _own_image(mesh: DeckMesh, symmetry: MirrorHalf, numbers: list[int]) -> bool:
    """Whether the elements of a set are those of its mirror image: lines with the nodes in the
    order in which the angle of their cords counts, solids with the same nodes."""
    of_kind: dict[str, list[int]] = {}
    for number in numbers:
        kind, row = mesh.place[number]
        of_kind.setdefault(kind, []).append(row)
    for kind, own in of_kind.items():
        nodes = mesh.connectivity[kind][own]
        images = symmetry.images(nodes)
        if TYPES[mesh.type_of(kind)].faces:  # solids: in any order
            nodes, images = np.sort(nodes), np.sort(images)
        same = _same(nodes, images)
        if kind in mesh.embedded:  # whose hosts' nodes are in no such order
            places = mesh.embedded[kind].points_at(mesh.X, mesh.guests)[own].real
            spots, other = (
                np.round(x / SAME_PLACE).astype(int).reshape(len(own), -1)
                for x in (places, places[:, ::-1] * [1, -1])
            )
            same = _same(spots, other)
        if not (same and _halves(symmetry, nodes)):
            return False
    return True


def _alike(guests: list[Guest]) -> list[Guest]:
    """With tangents that move both sides alike. Raises Refused where one has no mirror image."""
    if not guests:
        return []
    X = np.array([guest.X for guest in guests])
    return [replace(g, X=x) for g, x in zip(guests, MirrorHalf(X).alike(X), strict=True)]


def _same(some: Array, others: Array) -> bool:
    """Whether rows are the same but for their order."""
    return sorted(some.tolist()) == sorted(others.tolist())


def _halves(symmetry: MirrorHalf, rows: Array) -> bool:
    """Whether the elements that are kept, with their share, are half of all."""
    kept = rows[symmetry.keeps(rows)]
    return bool(2 * symmetry.share(kept).sum() == len(rows))
