"""Faces and nodes of a deck's surfaces."""

from __future__ import annotations

from .assembly import Assembly
from .scope import Scope, faces_of
from .text import Block, Row

Face = tuple[int, str, tuple[int, ...]]  # of a solid: its number, the face, its nodes


def surface_faces(made: Assembly, name: str, block: Block, row: Row | None = None) -> list[Face]:
    """Faces of a surface; of a ply, the ply's with its face."""
    if name not in made.surfaces:
        raise block.refused(f"the surface {name} is not defined", row)
    surface, prefix = made.surfaces[name]
    if surface.get("TYPE") == "NODE":
        raise surface.refused("a surface of nodes has no faces: use TYPE=ELEMENT")
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
    if surface.get("TYPE") == "NODE":
        return False
    members = [
        n for row in surface.rows for n in made.root.elements_in(prefix + row.name(0), surface, row)
    ]
    return bool(members) and all(made.root.elements[n].kind == "RAX2" for n in members)
