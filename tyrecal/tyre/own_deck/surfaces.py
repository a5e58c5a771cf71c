"""Faces and nodes of a deck's surfaces."""

from __future__ import annotations

import numpy as np

from .assembly import Assembly
from .scope import Scope, along_arc, faces_of
from .text import Block, Row

PIECES_OF_ARC = 16
Face = tuple[int, str, tuple[int, ...]]  # of a solid: its number, the face, its nodes


def surface_faces(made: Assembly, name: str, block: Block, row: Row | None = None) -> list[Face]:
    """Faces of a surface; of a ply, the ply's with its face."""
    if name not in made.surfaces:
        raise block.refused(f"the surface {name} is not defined", row)
    surface, prefix = made.surfaces[name]
    if surface.get("TYPE") in ("NODE", "SEGMENTS"):
        raise surface.refused("a surface of nodes or segments has no faces: use TYPE=ELEMENT")
    faces: list[Face] = []
    for line in surface.rows:
        face = line.name(1)
        if any(line.fields[2:]):
            raise surface.refused(f"data '{line.fields[2]}' is not honoured", line)
        members = made.root.elements_in(prefix + line.name(0), surface, line)
        free = set(boundary_of(made.root)) if not face else set()
        for n in members:
            element = made.root.elements[n]
            if not element.is_solid:
                if face not in ("SPOS", "SNEG"):
                    raise surface.refused(f"element {n} has the faces SPOS and SNEG", line)
                nodes = element.nodes if face == "SNEG" else element.nodes[::-1]
                faces.append((n, face, nodes))
                continue
            own = dict(faces_of(element))
            if face and face not in own:
                raise surface.refused(f"element {n} has no face {face}", line)
            some = [face] if face else [f for f in own if (n, f, own[f]) in free]
            faces += [(n, f, own[f]) for f in some]
    if not faces:
        raise surface.refused(f"the surface {name} has no faces")
    return faces


def boundary_of(root: Scope) -> tuple[Face, ...]:
    """Faces of one solid alone."""
    seen: dict[frozenset[int], list[Face]] = {}
    for n, element in root.elements.items():
        for face, nodes in faces_of(element) if element.is_solid else ():
            seen.setdefault(frozenset((nodes[0], nodes[-1])), []).append((n, face, nodes))
    return tuple(faces[0] for faces in seen.values() if len(faces) == 1)


def surface_nodes(made: Assembly, name: str, block: Block, row: Row) -> list[int]:
    """Nodes of a surface of elements or of nodes."""
    surface, prefix = made.surfaces.get(name, (None, ""))
    if surface and surface.get("TYPE") == "NODE":
        return [
            n
            for line in surface.rows
            for n in made.root.nodes_in(prefix + line.name(0), surface, line)
        ]
    return list(
        dict.fromkeys(n for _, _, nodes in surface_faces(made, name, block, row) for n in nodes)
    )


def is_rigid(made: Assembly, surface: Block, prefix: str) -> bool:
    """Whether a surface is of RAX2 alone."""
    if surface.get("TYPE") in ("NODE", "SEGMENTS"):
        return False
    members = [
        n for row in surface.rows for n in made.root.elements_in(prefix + row.name(0), surface, row)
    ]
    return bool(members) and all(made.root.elements[n].kind == "RAX2" for n in members)


def rigid_nodes(made: Assembly, surface: Block, prefix: str) -> set[int]:
    """Nodes of the elements of a rigid surface."""
    return {
        node
        for row in surface.rows
        for n in made.root.elements_in(prefix + row.name(0), surface, row)
        for node in made.root.elements[n].nodes
    }


def rigid_pieces(made: Assembly, surface: Block, prefix: str) -> np.ndarray:
    """Straight pieces (k, 2, 2) of a rigid surface, from start to end, what may touch it on their
    left. Raises OwnDeckError."""
    if surface.get("TYPE") == "SEGMENTS":
        profile = _profile(surface) + np.array(made.shifts.get(prefix, (0.0, 0.0)))
        pieces = np.stack([profile[:-1], profile[1:]], axis=1)
        return pieces[(pieces[:, 0] != pieces[:, 1]).any(1)]
    ends_of = []
    for row in surface.rows:
        for n in made.root.elements_in(prefix + row.name(0), surface, row):
            nodes = made.root.elements[n].nodes
            ends = nodes[::-1] if row.name(1) == "SNEG" else nodes
            ends_of.append([made.root.nodes[end] for end in ends])
    return np.array(ends_of)


def _profile(surface: Block) -> np.ndarray:
    """Points (k, 2) along a surface of TYPE=SEGMENTS."""
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
