"""Nodes, elements, sets and surfaces of the deck that a solver gets for a user's deck, and the
outlines of the section.

That deck is flat: without parts, assembly and generated sets, in m, its nodes and elements numbered
from 1. A face is (solid, name of the face such as S3, its nodes in order).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from .model import DeckModel
from .numbers import written
from .scope import Point, label_lines
from .surfaces import Face
from .text import Block, OwnDeckError, Place

REFERENCE_NODE = 900001  # far above the other nodes' numbers, from 1 to their count
Line = tuple[str, Place]  # of the flat deck, and the place in the user's that it comes from
OVER_THE_BELT = 0.94  # of the largest radius: nodes of the outer surface beyond are the crown's


@dataclass(frozen=True, eq=False)
class SolverMesh:
    """Nodes and elements under the flat deck's numbers, m."""

    nodes: dict[int, Point]  # number to (r, z)
    solids: dict[int, tuple[int, ...]]  # number to nodes
    plies: dict[int, tuple[int, ...]]  # number to nodes
    section_of: dict[int, int]  # solid to its place among the solid sections
    rim: tuple[int, ...]  # nodes that the rim holds
    cavity: tuple[Face, ...]  # faces on which the pressure acts
    tread: tuple[Face, ...]  # faces that are free
    outer: tuple[int, ...]  # nodes of the outer surface in order, from -z to +z
    inner: tuple[int, ...]  # nodes of the inner surface in order, from -z to +z
    crown: tuple[int, ...]  # nodes of the outer surface over the belt
    around: tuple[int, ...]  # nodes of the whole boundary, closed, from the inner surface's first
    reference: Point  # (r, z) of the rim's reference node
    element_at: dict[int, int]  # number of an element in the user's deck to the flat one
    lines: tuple[Line, ...]  # of the flat deck: its model, without materials and steps


def _tolerances(block: Block, length: float) -> str:
    """Tolerances of an *EMBEDDED ELEMENT that are given: EXTERIOR over the hosts' size, ROUNDOFF a
    weight of a host's node (both without a unit), ABSOLUTE EXTERIOR in m."""
    units = {"ROUNDOFF": 1.0, "EXTERIOR": 1.0, "ABSOLUTE EXTERIOR": length}
    numbers = {word: block.number(f"{word} TOLERANCE") for word in units}
    given = {word: written(x * units[word]) for word, x in numbers.items() if x is not None}
    return "".join(f", {word} TOLERANCE={text}" for word, text in given.items())


@lru_cache(maxsize=8)
def solver_mesh(model: DeckModel, length: float) -> SolverMesh:
    """The mesh of a model whose unit of length is so many m, remembered. Raises OwnDeckError."""
    number = {n: k for k, n in enumerate(sorted(model.nodes), start=1)}
    nodes = {number[n]: (length * r, length * z) for n, (r, z) in sorted(model.nodes.items())}
    lines = list[Line]()
    line = lambda text, place: lines.append((text, place))
    labels = lambda numbers, place: lines.extend((text, place) for text in label_lines(numbers))
    start = model.solids[0].block.place
    line("*NODE, NSET=TYRE", start)
    for n, (r, z) in nodes.items():
        line(f"{n}, {r!r}, {z!r}", start)
    r, z = model.reference[1]
    reference = (length * r, length * z)
    line("*NODE, NSET=RIM_REFERENCE", start)
    line(f"{REFERENCE_NODE}, {reference[0]!r}, {reference[1]!r}", start)
    element_at = {n: k for k, n in enumerate(sorted(model.elements), start=1)}
    solids, plies = dict[int, tuple[int, ...]](), dict[int, tuple[int, ...]]()
    section_of: dict[int, int] = {}
    for word, group, nodes_of in (("SOLID", model.solids, solids), ("PLY", model.plies, plies)):
        for k, section in enumerate(group, start=1):
            kinds: dict[str, list[int]] = {}
            for n in section.elements:
                kinds.setdefault(model.elements[n].kind, []).append(n)
            for kind, members in kinds.items():
                first = model.elements[members[0]]
                line(f"*ELEMENT, TYPE={kind}, ELSET={word}_{k}", first.block.place)
                for n in members:
                    element = model.elements[n]
                    own = nodes_of[element_at[n]] = tuple(number[each] for each in element.nodes)
                    if word == "SOLID":
                        section_of[element_at[n]] = k - 1
                    line(", ".join(map(str, (element_at[n], *own))), element.row.place)
    rim = tuple(sorted(number[n] for n in model.rim))
    renumbered = lambda face: (element_at[face[0]], face[1], tuple(number[n] for n in face[2]))
    cavity = [renumbered(face) for face in model.cavity]
    boundary = [renumbered(face) for face in model.boundary]
    held, under = set(rim), {face[:2] for face in cavity}
    tread = [f for f in boundary if f[:2] not in under and not held.issuperset(f[2])]
    if not tread:
        raise OwnDeckError(start, "no free surface of the rubber is left for the tread")
    outer, inner = _chain(tread, nodes), _chain(cavity, nodes)
    line("*NSET, NSET=RIM", start)
    labels(rim, start)
    most = max(nodes[n][0] for n in outer)
    crown = tuple(n for n in outer if nodes[n][0] > OVER_THE_BELT * most)
    line("*NSET, NSET=CROWN", start)
    labels(crown, start)
    for name, faces in (("CAVITY", cavity), ("TREAD", tread)):
        line(f"*SURFACE, NAME={name}, TYPE=ELEMENT", start)
        for n, face, _ in faces:
            line(f"{n}, {face}", start)
    for k, each in enumerate(model.embedded, start=1):
        line(f"*ELSET, ELSET=HOSTS_{k}", each.block.place)
        labels([element_at[n] for n in each.hosts], each.block.place)
        for j, (row, own_lines) in enumerate(each.lines, start=1):
            line(f"*ELSET, ELSET=EMBEDDED_{k}_{j}", row.place)
            labels([element_at[n] for n in own_lines], row.place)
        line(f"*EMBEDDED ELEMENT, HOST ELSET=HOSTS_{k}{_tolerances(each.block, length)}", start)
        for j, (row, _) in enumerate(each.lines, start=1):
            line(f"EMBEDDED_{k}_{j}", row.place)
    line(f"*RIGID BODY, REF NODE={REFERENCE_NODE}, TIE NSET=RIM", start)
    return SolverMesh(
        nodes,
        solids,
        plies,
        section_of,
        rim,
        tuple(cavity),
        tuple(tread),
        tuple(outer),
        tuple(inner),
        crown,
        tuple(_around(boundary, inner)),
        reference,
        element_at,
        tuple(lines),
    )


def _around(boundary: Sequence[Face], inner: Sequence[int]) -> list[int]:
    """Nodes of the closed boundary that the inner surface is part of, in its direction."""
    following = {face[2][0]: face[2] for face in boundary}
    chain = _follow(inner[0] if inner[0] in following else boundary[0][2][0], following)
    return chain if chain[1] == inner[1] else chain[::-1]


def _follow(start: int, following: Mapping[int, tuple[int, ...]]) -> list[int]:
    """Nodes of the faces that begin where another ends, from a node to an end or once round."""
    chain, seen = [start], {start}
    while chain[-1] in following:
        chain += following[chain[-1]][1:]
        if chain[-1] in seen:
            break
        seen.add(chain[-1])
    return chain


def _chain(faces: Sequence[Face], nodes: Mapping[int, Point]) -> list[int]:
    """Nodes of the longest chain of faces, from -z to +z."""
    following = {face[2][0]: face[2] for face in faces}
    ends = {face[2][-1] for face in faces}
    starts = [n for n in following if n not in ends] or [faces[0][2][0]]
    best = max((_follow(start, following) for start in starts), key=len)
    return best if nodes[best[0]][1] <= nodes[best[-1]][1] else best[::-1]
