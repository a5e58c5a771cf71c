"""Faces and nodes of the surfaces of a user's axisymmetric deck. Coordinates are r, z, in the
deck's unit of length."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .assembly import Assembly
from .scope import Scope, along_arc, faces_of
from .text import Block, Row

PIECES_OF_ARC = 16  # straight pieces for a circular or parabolic arc
# number of the element, name of its face, nodes of the face in the order of `faces_of`
Face = tuple[int, str, tuple[int, ...]]


def surface_faces(made: Assembly, name: str, block: Block, row: Row | None = None) -> list[Face]:
    """Faces of a surface; a ply (a line element) is its own face, SPOS, to the left of its way
    from node 1 to 2 in r, z, or SNEG: nodes in the order that has the ply on their left. Raises
    OwnDeckError at ``block`` and ``row``, which use the surface."""
    if name not in made.surfaces:
        raise block.refused(f"the surface {name} is not defined", row)
    surface, prefix = made.surfaces[name]
    if surface.get("TYPE") in ("NODE", "SEGMENTS"):
        raise surface.refused("a surface of nodes or segments has no faces: use TYPE=ELEMENT")
    faces: list[Face] = []
    free = set(boundary_of(made.root))
    for n, face, line in elements_of(made, surface, prefix):
        element = made.root.elements[n]
        if not element.is_solid:
            if face not in ("SPOS", "SNEG"):
                raise surface.refused(f"element {n} has the faces SPOS and SNEG", line)
            faces.append((n, face, element.nodes[:: 1 if face == "SNEG" else -1]))
            continue
        own = [(n, *each) for each in faces_of(element)]
        if face and face not in [name for _, name, _ in own]:
            raise surface.refused(f"element {n} has no face {face}", line)
        faces += [each for each in own if each[1] == face or (not face and each in free)]
    if not faces:
        raise surface.refused(f"the surface {name} has no faces")
    return faces


def boundary_of(root: Scope) -> tuple[Face, ...]:
    """Faces that belong to one solid only."""
    seen: dict[frozenset[int], list[Face]] = {}
    for n, element in root.elements.items():
        for face, nodes in faces_of(element) if element.is_solid else ():
            seen.setdefault(frozenset((nodes[0], nodes[-1])), []).append((n, face, nodes))
    return tuple(faces[0] for faces in seen.values() if len(faces) == 1)


def surface_nodes(made: Assembly, name: str, block: Block, row: Row) -> list[int]:
    """Nodes of a surface of elements or of nodes. Raises OwnDeckError."""
    surface, prefix = made.surfaces.get(name, (None, ""))
    if not surface or surface.get("TYPE") != "NODE":
        faces = surface_faces(made, name, block, row)
        return list(dict.fromkeys(n for *_, nodes in faces for n in nodes))
    members = made.root.nodes.members
    nodes = [n for line in surface.rows for n in members(prefix + line.name(0), surface, line)]
    if not nodes:
        raise surface.refused(f"the surface {name} has no nodes")
    return nodes


def elements_of(made: Assembly, surface: Block, prefix: str) -> Iterator[tuple[int, str, Row]]:
    """Elements of a surface of elements, each with the face that its line names ("": none)."""
    for row in surface.rows:
        if any(row.fields[2:]):
            raise surface.refused(f"data '{row.fields[2]}' is not honoured", row)
        for n in made.root.elements.members(prefix + row.name(0), surface, row):
            yield n, row.name(1), row


def rigid_nodes(made: Assembly, surface: Block, prefix: str) -> set[int]:
    """Nodes of a surface all elements of which are rigid lines (RAX2), none of another surface."""
    if surface.get("TYPE") in ("NODE", "SEGMENTS"):
        return set()
    elements = [made.root.elements[n] for n, *_ in elements_of(made, surface, prefix)]
    return {n for e in elements for n in e.nodes} if all(e.is_rigid for e in elements) else set()


def rigid_pieces(made: Assembly, surface: Block, prefix: str) -> np.ndarray:
    """Straight pieces (piece, start or end, r or z) of a rigid surface, in the order that has the
    touching body on the left. Raises OwnDeckError."""
    if surface.get("TYPE") == "SEGMENTS":
        profile = _profile(surface) + np.array(made.shifts.get(prefix, (0.0, 0.0)))
        lines = np.stack([profile[:-1], profile[1:]], axis=1)
        return lines[(lines[:, 0] != lines[:, 1]).any(1)]
    pieces = []
    for n, face, _ in elements_of(made, surface, prefix):
        ends = made.root.elements[n].nodes[:: -1 if face == "SNEG" else 1]
        pieces.append([made.root.nodes[end] for end in ends])
    return np.array(pieces)


def _profile(surface: Block) -> np.ndarray:
    """Points (k, 2) along a surface of TYPE=SEGMENTS. Data: LINE end; CIRCL end, centre; PARAB
    middle point, end."""
    if len(surface.rows) < 2 or surface.rows[0].name(0) != "START":
        raise surface.refused("begins with START, r, z; then LINE, CIRCL or PARAB")
    first = surface.rows[0]
    points = [np.array([first.number(1), first.number(2)])]
    shares = np.linspace(0.0, 1.0, PIECES_OF_ARC + 1)[1:]
    for row in surface.rows[1:]:
        kind, start = row.name(0), points[-1]
        one = np.array([row.number(1), row.number(2)])
        if kind == "LINE":
            points.append(one)
            continue
        two = np.array([row.number(3), row.number(4)])
        if kind == "CIRCL":
            points += [along_arc(start, one, two, share) for share in shares[:-1]]
            points.append(one)
        elif kind == "PARAB":  # through its middle point
            for s in shares:
                points.append(
                    (1 - s) * (1 - 2 * s) * start + 4 * s * (1 - s) * one + s * (2 * s - 1) * two
                )
        else:
            raise surface.refused(f"{row.text(0)} is no LINE, CIRCL or PARAB", row)
    return np.array(points)
