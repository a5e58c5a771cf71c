"""The section that a deck's blocks describe, halves made whole: elements, plies and surfaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from .assembly import Assembly, collect
from .classify import LOADS, ClassifiedDeck
from .constraints import Constraints, EmbeddedElements, lines_of_the_other_half
from .contact import DeckContact
from .scope import Element, Point, corner_areas, faces_of, mirror_of, reflected
from .surfaces import Face, boundary_of, surface_faces
from .text import Block, Row, element_types

AT_CROWN = 0.9  # of the largest radius: a cut that reaches it goes through the crown


@dataclass(frozen=True, eq=False)
class Assigned:
    """A section option and its elements."""

    block: Block
    name: str  # of the element set
    elements: tuple[int, ...]
    rebars: tuple[tuple[Block, Row], ...] = ()  # of a membrane, the same in all of its elements


@dataclass(frozen=True, eq=False)
class DeckModel:
    """Numbers are the deck's own where it has no instances."""

    nodes: dict[int, Point]
    elements: dict[int, Element]
    solids: tuple[Assigned, ...]
    plies: tuple[Assigned, ...]
    embedded: tuple[EmbeddedElements, ...]
    cavity: tuple[Face, ...]  # under the inflation pressure
    cavity_name: str
    pressure: tuple[tuple[Block, Row, int], ...]  # where it stands: data field of each load
    rim: tuple[int, ...]  # nodes that it holds
    reference: tuple[int, Point]  # the rim's node; its number is 0 where the deck has none
    boundary: tuple[Face, ...]  # free faces of the solids
    node_sets: dict[str, tuple[int, ...]]  # of the deck, for an output of modes
    reflected: bool
    left_out: tuple[str, ...] = ()  # contact that the held bead makes superfluous, in words


def build(deck: ClassifiedDeck) -> DeckModel:
    """The section. Raises OwnDeckError."""
    return _Builder(collect(deck.model), deck).model()


class _Builder:
    """Builds the model from what was collected."""

    def __init__(self, made: Assembly, deck: ClassifiedDeck):
        self.made, self.blocks, self.root = made, deck, made.root

    def model(self) -> DeckModel:
        """Raises OwnDeckError."""
        if not any(e.is_solid for e in self.root.elements.values()):
            raise self.blocks.model[-1].refused("is the last, but the deck has no CGAX element")
        solids, plies = self._sections()
        node_sets = self._all_sets()
        pressed, name, places = self._pressure()
        self.tied = Constraints(self.made, self.blocks)
        contact = self.blocks.contact and DeckContact(self.made, self.blocks, self.tied)
        left_out = contact.left_out() if contact else ()
        if not self.tied.rim:
            raise self.blocks.model[-1].refused(
                "is the last, but no *RIGID BODY or *BOUNDARY holds the bead on a rim"
            )
        for number, element in self.root.elements.items():
            if any(n in self.tied.same for n in element.nodes):
                nodes = tuple(self.tied.same.get(n, n) for n in element.nodes)
                self.root.elements[number] = replace(element, nodes=nodes)
        if self.made.reflect:
            solids, plies, pressed = self._reflect(solids, plies, pressed)
        elements = {k: e for k, e in self.root.elements.items() if not e.is_rigid}
        used = {n for e in elements.values() for n in e.nodes}
        boundary = boundary_of(self.root)
        self._check_areas()
        if not self.made.reflect:
            self._check_whole(boundary)
        cavity = self._on_solids(pressed, boundary)
        reference = self.tied.reference or (0, (0.0, 0.0))
        rubber = self.root.rubber_nodes()
        if loose := used - rubber - self.tied.guests:
            plies_of = ((k, e) for k, e in elements.items() if e.is_ply)
            number, element = next((k, e) for k, e in plies_of if loose & set(e.nodes))
            raise element.block.refused(
                f"element {number}: node {min(loose & set(element.nodes))} is of no rubber element:"
                " a ply shares its nodes with the rubber, or is an *EMBEDDED ELEMENT",
                element.row,
            )
        return DeckModel(
            {n: p for n, p in self.root.nodes.items() if n in used},
            elements,
            solids,
            plies,
            tuple(self.tied.embedded),
            cavity,
            name,
            places,
            tuple(n for n in self.tied.rim if n in rubber),
            reference,
            boundary,
            node_sets,
            self.made.reflect is not None,
            left_out,
        )

    def _sections(self) -> tuple[tuple[Assigned, ...], tuple[Assigned, ...]]:
        """Section options with their elements; every element has one."""
        owner: dict[int, Block] = {}
        solids, plies = list[Assigned](), list[Assigned]()
        for block, prefix in self.made.of("SOLID SECTION", "SURFACE SECTION", "MEMBRANE SECTION"):
            name = prefix + block.need("ELSET")
            elements = self.root.elements.members(name, block)
            if not elements:
                raise block.refused(f"the element set {name} is empty")
            solid = block.name == "SOLID SECTION"
            for n in elements:
                element = self.root.elements[n]
                if element_types.NODES_AND_SECTION[element.kind][1] != block.name:
                    raise block.refused(f"element {n} of {name} is a {element.kind}")
                if n in owner:
                    raise block.refused(f"element {n} has a section already, at {owner[n].place}")
                owner[n] = block
            (solids if solid else plies).append(Assigned(block, name, tuple(elements)))
        for n, element in self.root.elements.items():
            if n not in owner and not element.is_rigid:
                need = element_types.NODES_AND_SECTION[element.kind][1]
                raise element.block.refused(f"element {n} has no *{need}", element.row)
        return tuple(solids), tuple(self._with_rebars(plies))

    def _with_rebars(self, plies: Sequence[Assigned]) -> Iterator[Assigned]:
        """Plies, membranes split into elements with the same lines of *REBAR."""
        lines: dict[int, list[tuple[Block, Row]]] = {}
        for block, prefix in self.made.of("REBAR"):
            for row in block.rows:
                for n in self.root.elements.members(prefix + row.name(0), block, row):
                    if not (kind := self.root.elements[n].kind).startswith("MGAX"):
                        raise block.refused(f"element {n} is a {kind}, no membrane", row)
                    lines.setdefault(n, []).append((block, row))
        for ply in plies:
            alike: dict[tuple[tuple[Block, Row], ...], list[int]] = {}
            for n in ply.elements:
                alike.setdefault(tuple(lines.get(n, ())), []).append(n)
            for rebars, elements in alike.items():
                yield replace(ply, elements=tuple(elements), rebars=rebars)

    def _all_sets(self) -> dict[str, tuple[int, ...]]:
        """Every set is resolved, used or not: one that dangles is a mistake."""
        for name, defined in self.root.elements.sets.items():
            self.root.elements.members(name, defined[0][0])
        return {
            name: tuple(self.root.nodes.members(name, defined[0][0]))
            for name, defined in self.root.nodes.sets.items()
        }

    def _check_areas(self) -> None:
        """No element folds over, and none is on or beyond the axle."""
        points = self.root.nodes
        for number, element in self.root.elements.items():
            if not element.is_solid:
                continue
            area = corner_areas(element, points)
            beyond = any(points[n][0] < 0 for n in element.nodes)
            if (area <= 0).any() or beyond:
                order = "its nodes run clockwise" if (area < 0).all() else "it folds over"
                what = "it reaches beyond the axle" if beyond else order
                raise element.block.refused(f"element {number}: {what}", element.row)

    def _check_whole(self, boundary: Sequence[Face]) -> None:
        """The section does not end in a cut through the crown, as half a tyre does."""
        points = self.root.nodes
        solid = self.root.rubber_nodes()
        crown = max(points[n][0] for n in solid)
        for z in (min(points[n][1] for n in solid), max(points[n][1] for n in solid)):
            at_z = {n for n in solid if abs(points[n][1] - z) <= self.tied.near}
            cut = [face for face in boundary if at_z.issuperset(face[2])]
            if cut and max(points[n][0] for _, _, nodes in cut for n in nodes) > AT_CROWN * crown:
                element = self.root.elements[cut[0][0]]
                what = "the section ends in a cut through the crown, it is half a tyre"
                words = f"element {cut[0][0]}: {what}; add {lines_of_the_other_half(z)}"
                raise element.block.refused(words, element.row)

    def _pressure(self) -> tuple[list[Face], str, tuple[tuple[Block, Row, int], ...]]:
        """Faces under the step's pressure, and where its value stands."""
        faces: list[Face] = []
        places: list[tuple[Block, Row, int]] = []
        loads = [b for b in self.blocks.inflation if b.name in LOADS]
        for block, row in [(load, row) for load in loads for row in load.rows]:
            kind = row.name(1)
            if block.name == "DSLOAD":
                if kind != "P":
                    raise block.refused(f"the load {row.text(1)} is not honoured, only P", row)
                faces += surface_faces(self.made, row.name(0), block, row)
            elif kind not in ("P1", "P2", "P3", "P4"):
                hint = ": set spin_rad_per_s in the case" if kind == "CENTRIF" else ""
                raise block.refused(f"the load {kind} is not honoured, only P1 to P4{hint}", row)
            else:
                for n in self.root.elements.members(row.name(0), block, row):
                    own = dict(faces_of(self.root.elements[n]))
                    if f"S{kind[1]}" not in own:
                        raise block.refused(f"element {n} has no face {kind[1]}", row)
                    faces.append((n, f"S{kind[1]}", own[f"S{kind[1]}"]))
            if any(row.fields[3:]):
                raise block.refused(f"data '{row.fields[3]}' is not honoured", row)
            places.append((block, row, 2))
        if not places:
            raise self.blocks.inflation[0].refused("has no pressure: *DSLOAD needs a data line")
        values = {row.number(i) for _, row, i in places}
        if len(values) > 1:
            raise places[1][0].refused("one pressure is honoured, the same on all", places[1][1])
        if not values.pop() > 0:
            raise places[0][0].refused("the pressure must be positive", places[0][1])
        names = " and ".join(dict.fromkeys(row.name(0) for _, row, _ in places))
        return faces, names, tuple(places)

    def _on_solids(self, pressed: list[Face], boundary: Sequence[Face]) -> tuple[Face, ...]:
        """The free faces of solids that a pressure acts on, those under plies among them."""
        free = {frozenset((f[2][0], f[2][-1])): f for f in boundary}
        surface = self.blocks.inflation[0]
        faces: dict[int, Face] = {}
        for n, face, raw in pressed:
            start, end = (self.tied.same.get(each, each) for each in (raw[0], raw[-1]))
            own = free.get(frozenset((start, end)))
            if own is None:
                words = f"the pressure acts on face {face} of element {n}, which is no free surface"
                raise surface.refused(words)
            if (own[2][0], own[2][-1]) != (start, end):
                element = self.root.elements[n]
                words = f"element {n}: the pressure on its face {face} comes from the rubber's side"
                raise element.block.refused(words, element.row)
            if id(own) in faces:
                raise surface.refused(f"the pressure acts twice on face {face} of element {n}")
            faces[id(own)] = own
        return tuple(faces.values())

    def _reflect(
        self, solids: Sequence[Assigned], plies: Sequence[Assigned], pressed: list[Face]
    ) -> tuple[tuple[Assigned, ...], tuple[Assigned, ...], list[Face]]:
        """The other half: its half turn about the line, nodes on the line shared."""
        assert self.made.reflect
        root, mirror = self.root, mirror_of(self.made.reflect)
        used = {n for e in root.elements.values() for n in e.nodes}
        there = {n: mirror(root.nodes[n]) for n in used}
        shift = max(root.nodes)
        image = {n: n if self.tied.on_plane(root.nodes[n]) else n + shift for n in used}
        if all(n != m for n, m in image.items()):
            raise self.made.reflect.refused("no node is on the line: the halves do not meet")
        steps = [round((there[n][1] - root.nodes[n][1]) / self.tied.near) for n in used]
        if min(steps) < 0 < max(steps):
            raise self.made.reflect.refused("nodes are on both sides of the line: it is no half")
        root.nodes |= {m: there[n] for n, m in image.items() if n != m}
        further = max(root.elements)
        both_faces = list(pressed)
        for number, element in list(root.elements.items()):
            nodes = tuple(image[n] for n in element.nodes)
            root.elements[number + further] = replace(element, nodes=reflected(element, nodes))
        doubled = lambda numbers: (*numbers, *(n + further for n in numbers))
        both = lambda each: replace(each, elements=doubled(each.elements))
        for n, face, nodes in pressed:
            turned = tuple(image[self.tied.same.get(m, m)] for m in nodes)[::-1]
            both_faces.append((n + further, face, turned))
        self.tied.rim |= dict.fromkeys(image[n] for n in list(self.tied.rim) if n in image)
        self.tied.guests |= {image[n] for n in self.tied.guests}
        for k, e in enumerate(self.tied.embedded):
            lines = tuple((row, doubled(own)) for row, own in e.lines)
            self.tied.embedded[k] = EmbeddedElements(e.block, doubled(e.hosts), lines)
        return tuple(map(both, solids)), tuple(map(both, plies)), both_faces
