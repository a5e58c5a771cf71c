"""Nodes that the rim holds, and plies that are tied to or embedded in rubber."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .assembly import Assembly
from .classify import ClassifiedDeck
from .scope import Point, mirror_of, nearest
from .surfaces import rigid_nodes, rigid_pieces, surface_nodes
from .text import Block, Row

MERGED = 1e-6  # of the section's size: nodes closer than this are one where they are tied
# ABAQUS' degrees of freedom of a section: 1 r, 2 z, 5 twist about the axle, 6 turn in its plane.
# At the middle of a half u_z and twist change their sign from one half to the other
HELD_BY_SYMMETRY = {2, 4, 5, 6}


@dataclass(frozen=True, eq=False)
class EmbeddedElements:
    """An *EMBEDDED ELEMENT some of whose nodes are no rubber's: elements of each data line;
    hosts: elements of the rubber that it is in."""

    block: Block
    hosts: tuple[int, ...]
    lines: tuple[tuple[Row, tuple[int, ...]], ...]


@dataclass(frozen=True, eq=False)
class RigidBody:
    """A *RIGID BODY: its reference node, the nodes that it holds, and its surfaces' names."""

    block: Block
    reference: int
    nodes: frozenset[int]
    surfaces: tuple[str, ...]


class Constraints:
    """Constraints of a deck, in its own unit of length.

    rim: nodes that it holds; reference: its node and place, None without a rigid rim; same: node to
    the node that it is one with; guests: embedded nodes where the rubber has none; bodies: rigid
    ones; motions: displacements of reference nodes of those that only touch, by degree of freedom,
    1: r, 2: z; near: distance up to which nodes are in one place. Raises OwnDeckError.
    """

    def __init__(self, made: Assembly, deck: ClassifiedDeck):
        self.made, self.blocks, self.root = made, deck, made.root
        self.rim: dict[int, None] = {}
        self.reference: tuple[int, Point] | None = None
        self.same: dict[int, int] = {}
        self.embedded: list[EmbeddedElements] = []
        self.guests: set[int] = set()
        self.bodies: list[RigidBody] = []
        self.seats: set[str] = set()  # rigid surfaces that nodes are tied to
        self.motions: dict[int, dict[int, float]] = {}
        sizes = np.array(list(self.root.nodes.values()) or [(0.0, 0.0)])
        self.near = MERGED * float(np.ptp(sizes, axis=0).max())
        for block, prefix in made.of("RIGID BODY"):
            self._rigid(block, prefix)
        for block, prefix in made.of("TIE", "EMBEDDED ELEMENT"):
            (self._tie if block.name == "TIE" else self._embed)(block, prefix)
        self._choose_rim()
        self._held()

    def _choose_rim(self) -> None:
        """The one rigid body that holds rubber; others only touch it."""
        rubber = self.root.rubber_nodes()
        rims = [b for b in self.bodies if b.nodes & rubber or self.seats & set(b.surfaces)]
        if not rims and not self.blocks.contact:
            rims = self.bodies
        if len(rims) > 1:
            raise rims[1].block.refused("one rigid body is honoured, the rim")
        self.motions = {body.reference: {} for body in self.bodies if body not in rims}
        for body in rims:
            self.reference = body.reference, self.root.nodes[body.reference]

    def _rigid(self, block: Block, prefix: str) -> None:
        """A rigid body: the nodes that it holds, and the surfaces that move with it."""
        name = block.need("REF NODE")
        reference = self.root.nodes.members(prefix + name, block)
        if len(reference) != 1:
            raise block.refused(f"REF NODE={name} is {len(reference)} nodes, one is needed")
        if not {"TIE NSET", "ELSET", "ANALYTICAL SURFACE"} & block.parameters.keys():
            raise block.refused("needs TIE NSET=, ELSET= or ANALYTICAL SURFACE=")
        tied, surfaces = block.get("TIE NSET"), list[str]()
        nodes = dict.fromkeys(self.root.nodes.members(prefix + tied, block) if tied else ())
        if elements := block.get("ELSET"):
            members = self.root.elements.members(prefix + elements, block)
            nodes |= dict.fromkeys(n for each in members for n in self.root.elements[each].nodes)
            for each, place in self.made.surfaces.items():
                own = rigid_nodes(self.made, *place)
                if own and nodes.keys() >= own:
                    surfaces.append(each)
        if profile := block.get("ANALYTICAL SURFACE"):
            surface, _ = self.made.surfaces.get(prefix + profile, (block, ""))
            if surface.get("TYPE") != "SEGMENTS":
                raise block.refused(f"ANALYTICAL SURFACE={profile} is no surface of TYPE=SEGMENTS")
            surfaces.append(prefix + profile)
        nodes.pop(reference[0], None)
        self.rim |= nodes
        self.bodies.append(RigidBody(block, reference[0], frozenset(nodes), tuple(surfaces)))

    def _tie(self, block: Block, prefix: str) -> None:
        """The bead on the rim's elements, or two surfaces of the same places."""
        for row in block.rows:
            slaves = surface_nodes(self.made, prefix + row.name(0), block, row)
            name = prefix + row.name(1)
            surface = self.made.surfaces.get(name)
            if not (surface and rigid_nodes(self.made, *surface)):
                masters = surface_nodes(self.made, name, block, row)
                for n, distance in self._merge(slaves, masters).items():
                    raise block.refused(
                        f"node {n} is {distance:.3g} from the nearest node that it could be tied"
                        " to: only nodes in the same place are, mesh both alike",
                        row,
                    )
                continue
            places = np.array([self.root.nodes[n] for n in slaves])
            away, _ = nearest(places, rigid_pieces(self.made, *surface))
            given = block.number("POSITION TOLERANCE") or 0.0
            allowed = given if block.get("ADJUST") == "NO" else 0.0
            for n, distance in zip(slaves, away, strict=True):
                if distance > max(allowed, self.near):
                    raise block.refused(
                        f"node {n} is {distance:.3g} from the rim: ABAQUS leaves it free, or moves"
                        " it there; with ADJUST=NO and a POSITION TOLERANCE as large it is held",
                        row,
                    )
            self.rim |= dict.fromkeys(slaves)
            self.seats.add(name)

    def _embed(self, block: Block, prefix: str) -> None:
        """Plies on nodes of their own: those where the rubber has nodes are the rubber's."""
        hosts = [n for n, e in self.root.elements.items() if e.is_solid]
        if name := block.get("HOST ELSET"):
            hosts = self.root.elements.members(prefix + name, block)
            if not hosts:
                raise block.refused(f"the element set {name} is empty")
        rubber = list(dict.fromkeys(n for e in hosts for n in self.root.elements[e].nodes))
        lines, before = [], len(self.guests)
        for row in block.rows:
            for name in filter(None, row.fields):
                members = self.root.elements.members(prefix + name.strip('"').upper(), block, row)
                wrong = [n for n in members if not self.root.elements[n].is_ply]
                if wrong:
                    raise block.refused(f"element {wrong[0]} of {name} is no SFMGAX or MGAX", row)
                own = dict.fromkeys(n for e in members for n in self.root.elements[e].nodes)
                own = dict.fromkeys(own.keys() - set(rubber))
                self.guests |= self._merge(list(own), rubber).keys()
                lines.append((row, tuple(members)))
        if len(self.guests) > before:
            self.embedded.append(EmbeddedElements(block, tuple(hosts), tuple(lines)))

    def _merge(self, some: Sequence[int], others: Sequence[int]) -> dict[int, float]:
        """Each of ``some`` nodes is one with that of ``others`` which lies there; distance to the
        nearest of those where none does."""
        from scipy.spatial import KDTree  # late: a quarter of a second

        if not some:
            return {}
        far: dict[int, float] = {}
        places = np.array([self.root.nodes[n] for n in others])
        away, nearest = KDTree(places).query(np.array([self.root.nodes[n] for n in some]))
        for n, distance, k in zip(some, away, nearest, strict=True):
            if distance > self.near:
                far[n] = float(distance)
            elif n != others[k]:
                self.same[n] = others[k]
                if n in self.rim:
                    self.rim[others[k]] = None
        return far

    def _held(self) -> None:
        """Collect what *BOUNDARY holds: the rim's reference node, the bead, or the plane of a
        half."""
        blocks = [b for b, _ in self.made.of("BOUNDARY")]
        blocks += [b for b in self.blocks.inflation if b.name == "BOUNDARY"]
        fixed: dict[int, dict[int, tuple[Block, Row]]] = {}  # by node and degree of freedom
        for block in blocks:
            for row in block.rows:
                nodes = self.root.nodes.members(row.name(0), block, row)
                if nodes and self.motions.keys() >= set(nodes):
                    self._move(nodes, block, row)
                    continue
                for n in nodes:
                    held = fixed.setdefault(n, {})
                    held |= dict.fromkeys(_freedoms(block, row) - held.keys(), (block, row))
        if self.reference and not {1, 2, 6} <= fixed.pop(self.reference[0], {}).keys():
            rim = self.reference[0]
            block = next(b.block for b in self.bodies if b.reference == rim)
            raise block.refused(f"*BOUNDARY must hold the rim's node {rim} in 1, 2 and 6")
        used = {n for e in self.root.elements.values() for n in e.nodes}
        for n in [n for n in fixed if n in used]:
            point, freedoms = self.root.nodes[n], fixed[n].keys()
            if {1, 2} <= freedoms and (5 in freedoms or n in self.rim):
                self.rim[n] = None
            elif n in self.rim or (
                freedoms <= HELD_BY_SYMMETRY and self.made.reflect and self.on_plane(point)
            ):
                continue
            else:
                block, row = next(iter(fixed[n].values()))
                hint = "a rim holds 1, 2 and 5 (ENCASTRE)"
                if freedoms <= HELD_BY_SYMMETRY:
                    hint = f"a half is made whole by {lines_of_the_other_half(point[1])}"
                raise block.refused(f"node {n} is held in {sorted(freedoms)} only: {hint}", row)

    def _move(self, nodes: Sequence[int], block: Block, row: Row) -> None:
        """Note displacements of rigid bodies that only touch the tyre; the last one counts."""
        size = row.number(3, 0.0)
        freedoms = range(row.integer(1), row.integer(2, row.integer(1)) + 1) if size else ()
        if not {1, 2} >= set(freedoms):
            raise block.refused("a rigid surface may move in 1 and 2, it does not turn", row)
        for n in nodes:
            for freedom in freedoms or _freedoms(block, row):
                self.motions[n][freedom] = size

    def on_plane(self, point: Point) -> bool:
        """Whether a point is its own mirror image, in the middle plane of a half."""
        assert self.made.reflect
        r, z = mirror_of(self.made.reflect)(point)
        return max(abs(r - point[0]), abs(z - point[1])) <= self.near


def lines_of_the_other_half(z: float) -> str:
    """The lines that make a half whole that ends at z, in words."""
    return (
        "the lines '*SYMMETRIC MODEL GENERATION, REFLECT=LINE' and"
        f" '0., {z + 0.0:g}, 0., 1., {z + 0.0:g}, 0.' before *STEP"
    )


def _freedoms(block: Block, row: Row) -> set[int]:
    """Degrees of freedom that a data line holds at 0."""
    kind = row.name(1)
    named = {"ENCASTRE": range(1, 7), "PINNED": range(1, 4), "YSYMM": (2, 4, 6)}
    if kind in named:
        return set(named[kind])
    first = row.integer(1)
    last = row.integer(2, first)
    if not 1 <= first <= last <= 6:
        raise block.refused(f"{first} to {last} are no degrees of freedom of a section", row)
    if row.number(3, 0.0):
        raise block.refused("only displacements of 0 are honoured", row)
    return set(range(first, last + 1))
