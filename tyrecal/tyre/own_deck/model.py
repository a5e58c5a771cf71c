"""The section that a deck's blocks describe: parts and instances made one, halves made whole, plies
that are embedded or tied put on the nodes that they share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .grammar import Sorted
from .scope import MESH_READERS, Element, Point, Scope, corner_areas, faces_of, mirror_of, reflected
from .text import Block, Row

MERGED = 1e-6  # of the section's size: nodes closer than this are one where they are tied
Face = tuple[int, str, tuple[int, ...]]  # of a solid: its number, the face, its nodes


@dataclass(frozen=True, eq=False)
class Assigned:
    """A section option and its elements."""

    block: Block
    name: str  # of the element set
    elements: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Embedded:
    """An *EMBEDDED ELEMENT some of whose nodes are no rubber's: elements of each data line."""

    block: Block
    hosts: tuple[int, ...]
    lines: tuple[tuple[Row, tuple[int, ...]], ...]


@dataclass(frozen=True, eq=False)
class Model:
    """Numbers are the deck's own where it has no instances."""

    nodes: dict[int, Point]
    elements: dict[int, Element]
    solids: tuple[Assigned, ...]
    plies: tuple[Assigned, ...]
    embedded: tuple[Embedded, ...]
    cavity: tuple[Face, ...]  # under the inflation pressure
    cavity_name: str
    pressure: tuple[tuple[Block, Row, int], ...]  # where it stands: data field of each load
    rim: tuple[int, ...]  # nodes that it holds
    reference: tuple[int, Point]  # the rim's node; its number is 0 where the deck has none
    boundary: tuple[Face, ...]  # free faces of the solids
    node_sets: dict[str, tuple[int, ...]]  # of the deck, for an output of modes
    reflected: bool


@dataclass
class _Made:
    """What is collected on the way."""

    root: Scope = field(default_factory=Scope)
    sections: list[tuple[Block, str]] = field(default_factory=list)  # with names' prefix
    surfaces: dict[str, tuple[Block, str]] = field(default_factory=dict)
    rules: list[tuple[Block, str]] = field(default_factory=list)  # rigid bodies, ties, embedded
    held: list[Block] = field(default_factory=list)
    reflect: Block | None = None


@dataclass
class _Part:
    """A *PART."""

    block: Block
    scope: Scope
    other: list[Block] = field(default_factory=list)
    instances: dict[str, tuple[dict[int, int], dict[int, int]]] = field(default_factory=dict)


def build(found: Sorted) -> Model:
    """The section. Raises OwnDeckError."""
    made = _collect(found.model)
    return _Builder(made, found).model()


def _collect(blocks: Sequence[Block]) -> _Made:
    made, parts = _Made(), dict[str, _Part]()
    part: _Part | None = None
    instance = False
    for block in blocks:
        if instance and block.name != "END INSTANCE":
            raise block.refused("stands in an *INSTANCE: give it in the *PART")
        if block.name == "PART":
            name = block.need("NAME")
            if name in parts:
                raise block.refused(f"the part {name} is defined twice")
            part = parts[name] = _Part(block, Scope(name))
        elif block.name == "END PART":
            part = None
        elif block.name == "INSTANCE":
            instance = True
            _instance(made, parts, block)
        elif block.name == "END INSTANCE":
            instance = False
        elif part is not None:
            if block.name in MESH_READERS:
                part.scope.read(block)
            part.other.append(block)
        elif block.name in MESH_READERS and not block.get("INSTANCE"):
            made.root.read(block)
        else:
            _other(made, block, "", parts)
    for each in parts.values():
        if not each.instances:
            raise each.block.refused("no *INSTANCE of it is in the assembly")
    return made


def _instance(made: _Made, parts: dict[str, _Part], block: Block) -> None:
    """Put a part's nodes, elements, sets and options in the model under INSTANCE.NAME."""
    name, part = block.need("NAME"), parts.get(block.need("PART"))
    if part is None:
        raise block.refused(f"the part {block.get('PART')} is not defined above")
    if any(name in each.instances for each in parts.values()):
        raise block.refused(f"the instance {name} is defined twice")
    dr = block.rows[0].number(0, 0.0) if block.rows else 0.0
    dz = block.rows[0].number(1, 0.0) if block.rows else 0.0
    if len(block.rows) > 2 or (len(block.rows) == 2 and block.rows[1].number(6, 0.0)):
        raise block.refused("a rotation of an instance is not honoured")
    root, own = made.root, part.scope
    more = max(root.nodes, default=0) if root.nodes.keys() & own.nodes.keys() else 0
    further = max(root.elements, default=0) if root.elements.keys() & own.elements.keys() else 0
    nodes = {n: n + more for n in own.nodes}
    elements = {n: n + further for n in own.elements}
    for n, (r, z) in own.nodes.items():
        root.nodes[nodes[n]] = (r + dr, z + dz)
    for n, e in own.elements.items():
        moved = tuple(nodes[each] for each in e.nodes)
        root.elements[elements[n]] = Element(e.kind, moved, e.block, e.row)
    part.instances[name] = nodes, elements
    for sets, own_sets, numbers, members in (
        (root.node_sets, own.node_sets, nodes, own.nodes_in),
        (root.element_sets, own.element_sets, elements, own.elements_in),
    ):
        for each, defined in own_sets.items():
            of = _mapped(members, each, defined[0][0], numbers)
            sets[f"{name}.{each}"] = [(defined[0][0], of)]
        for n, m in numbers.items():
            sets[f"{name}.{n}"] = [(block, lambda m=m: [m])]  # type: ignore[misc]
    for other in part.other:
        if other.name not in MESH_READERS:
            _other(made, other, f"{name}.", parts)


def _mapped(
    members: Callable[[str, Block], list[int]], name: str, block: Block, numbers: dict[int, int]
) -> Callable[[], list[int]]:
    return lambda: [numbers[n] for n in members(name, block)]


def _other(made: _Made, block: Block, prefix: str, parts: dict[str, _Part]) -> None:
    name = block.name
    if name in ("NSET", "ELSET"):  # of an instance, from outside it
        for part in parts.values():
            if numbers := part.instances.get(block.get("INSTANCE")):
                what = 0 if name == "NSET" else 1
                own = block.need(name)
                inside = replace(
                    part.scope,
                    node_sets={k: v for k, v in part.scope.node_sets.items() if k != own},
                    element_sets={k: v for k, v in part.scope.element_sets.items() if k != own},
                )
                inside.read(block)
                members = (inside.nodes_in, inside.elements_in)[what]
                sets = (made.root.node_sets, made.root.element_sets)[what]
                of = _mapped(members, own, block, numbers[what])
                sets.setdefault(own, []).append((block, of))
                return
        raise block.refused(f"the instance {block.get('INSTANCE')} is not defined above")
    if name in ("SOLID SECTION", "SURFACE SECTION"):
        made.sections.append((block, prefix))
    elif name == "SURFACE":
        if prefix + block.need("NAME") in made.surfaces:
            raise block.refused(f"the surface {block.get('NAME')} is defined twice")
        made.surfaces[prefix + block.need("NAME")] = block, prefix
    elif name in ("RIGID BODY", "TIE", "EMBEDDED ELEMENT"):
        made.rules.append((block, prefix))
    elif name == "BOUNDARY":
        made.held.append(block)
    elif name == "SYMMETRIC MODEL GENERATION":
        if made.reflect:
            raise block.refused("stands there twice")
        made.reflect = block


class _Builder:
    """From what was collected to the model."""

    def __init__(self, made: _Made, found: Sorted):
        self.made, self.found, self.root = made, found, made.root
        self.rim: dict[int, None] = {}
        self.reference: tuple[int, Point] | None = None
        self.same: dict[int, int] = {}  # node to the node that it is one with
        self.embedded: list[Embedded] = []
        self.guests: set[int] = set()  # embedded nodes where the rubber has none
        sizes = np.array(list(self.root.nodes.values()) or [(0.0, 0.0)])
        self.near = MERGED * float(np.ptp(sizes, axis=0).max())

    def model(self) -> Model:
        """Raises OwnDeckError."""
        if not any(e.is_solid for e in self.root.elements.values()):
            raise self.found.model[-1].refused("is the last, but the deck has no CGAX element")
        solids, plies = self._sections()
        node_sets = self._all_sets()
        pressed, name, places = self._pressure()
        self._rules()
        self._held()
        if not self.rim:
            raise self.found.model[-1].refused(
                "is the last, but no *RIGID BODY or *BOUNDARY holds the bead on a rim"
            )
        for number, element in self.root.elements.items():
            if any(n in self.same for n in element.nodes):
                nodes = tuple(self.same.get(n, n) for n in element.nodes)
                self.root.elements[number] = Element(
                    element.kind, nodes, element.block, element.row
                )
        if self.made.reflect:
            solids, plies, pressed = self._reflect(solids, plies, pressed)
        used = {
            n for e in self.root.elements.values() if not e.kind.startswith("RAX") for n in e.nodes
        }
        boundary = self._boundary()
        self._check_areas(used)
        cavity = self._on_solids(pressed, boundary)
        reference = self.reference or (0, (0.0, 0.0))
        rubber = {n for e in self.root.elements.values() if e.is_solid for n in e.nodes}
        if loose := used - rubber - self.guests:
            number, element = next(
                (k, e) for k, e in self.root.elements.items() if e.is_ply and loose & set(e.nodes)
            )
            raise element.block.refused(
                f"element {number}: node {min(loose & set(element.nodes))} is of no rubber element:"
                " a ply shares its nodes with the rubber, or is an *EMBEDDED ELEMENT",
                element.row,
            )
        return Model(
            {n: p for n, p in self.root.nodes.items() if n in used},
            {k: e for k, e in self.root.elements.items() if not e.kind.startswith("RAX")},
            solids,
            plies,
            tuple(self.embedded),
            cavity,
            name,
            places,
            tuple(n for n in self.rim if n in rubber),
            reference,
            boundary,
            node_sets,
            self.made.reflect is not None,
        )

    def _sections(self) -> tuple[tuple[Assigned, ...], tuple[Assigned, ...]]:
        """Section options with their elements; every element has one."""
        owner: dict[int, Block] = {}
        solids, plies = list[Assigned](), list[Assigned]()
        for block, prefix in self.made.sections:
            name = prefix + block.need("ELSET")
            elements = self.root.elements_in(name, block)
            if not elements:
                raise block.refused(f"the element set {name} is empty")
            solid = block.name == "SOLID SECTION"
            for n in elements:
                element = self.root.elements[n]
                if not (element.is_solid if solid else element.is_ply):
                    raise block.refused(f"element {n} of {name} is a {element.kind}")
                if n in owner:
                    before = owner[n].place
                    raise block.refused(
                        f"element {n} has a section already, at {before.file}, line {before.line}"
                    )
                owner[n] = block
            (solids if solid else plies).append(Assigned(block, name, tuple(elements)))
        for n, element in self.root.elements.items():
            if n not in owner and not element.kind.startswith("RAX"):
                need = "*SOLID SECTION" if element.is_solid else "*SURFACE SECTION"
                raise element.block.refused(f"element {n} has no {need}", element.row)
        return tuple(solids), tuple(plies)

    def _all_sets(self) -> dict[str, tuple[int, ...]]:
        """Every set is resolved, used or not: one that dangles is a mistake."""
        for name, defined in self.root.element_sets.items():
            self.root.elements_in(name, defined[0][0])
        return {
            name: tuple(self.root.nodes_in(name, defined[0][0]))
            for name, defined in self.root.node_sets.items()
        }

    def faces(self, name: str, block: Block, row: Row | None = None) -> list[Face]:
        """Faces of a surface; of a ply, the ply's with its face."""
        if name not in self.made.surfaces:
            raise block.refused(f"the surface {name} is not defined", row)
        surface, prefix = self.made.surfaces[name]
        if surface.get("TYPE") == "NODE":
            raise surface.refused("a surface of nodes has no faces: use TYPE=ELEMENT")
        found: list[Face] = []
        for line in surface.rows:
            face = line.name(1)
            if any(line.fields[2:]):
                raise surface.refused(f"data '{line.fields[2]}' is not honoured", line)
            members = self.root.elements_in(prefix + line.name(0), surface, line)
            free = set(self._boundary()) if not face else set()
            for n in members:
                element = self.root.elements[n]
                if not element.is_solid:
                    if face not in ("SPOS", "SNEG"):
                        raise surface.refused(f"element {n} has the faces SPOS and SNEG", line)
                    nodes = element.nodes if face == "SNEG" else element.nodes[::-1]
                    found.append((n, face, nodes))
                    continue
                own = dict(faces_of(element))
                if face and face not in own:
                    raise surface.refused(f"element {n} has no face {face}", line)
                some = [face] if face else [f for f in own if (n, f, own[f]) in free]
                found += [(n, f, own[f]) for f in some]
        if not found:
            raise surface.refused(f"the surface {name} has no faces")
        return found

    def _boundary(self) -> tuple[Face, ...]:
        """Faces of one solid alone."""
        seen: dict[frozenset[int], list[Face]] = {}
        for n, element in self.root.elements.items():
            for face, nodes in faces_of(element) if element.is_solid else ():
                seen.setdefault(frozenset((nodes[0], nodes[-1])), []).append((n, face, nodes))
        return tuple(faces[0] for faces in seen.values() if len(faces) == 1)

    def _check_areas(self, used: set[int]) -> None:
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

    def _pressure(self) -> tuple[list[Face], str, tuple[tuple[Block, Row, int], ...]]:
        """Faces under the step's pressure, and where its value stands."""
        faces: list[Face] = []
        places: list[tuple[Block, Row, int]] = []
        names: list[str] = []
        for block in self.found.inflation:
            for row in block.rows if block.name == "DSLOAD" else ():
                if row.name(1) != "P":
                    raise block.refused(f"the load {row.text(1)} is not honoured, only P", row)
                faces += self.faces(row.name(0), block, row)
                names.append(row.name(0))
                places.append((block, row, 2))
            for row in block.rows if block.name == "DLOAD" else ():
                kind = row.name(1)
                if kind not in ("P1", "P2", "P3", "P4"):
                    hint = ": set spin_rad_per_s in the case" if kind == "CENTRIF" else ""
                    raise block.refused(
                        f"the load {kind} is not honoured, only P1 to P4{hint}", row
                    )
                for n in self.root.elements_in(row.name(0), block, row):
                    own = dict(faces_of(self.root.elements[n]))
                    if f"S{kind[1]}" not in own:
                        raise block.refused(f"element {n} has no face {kind[1]}", row)
                    faces.append((n, f"S{kind[1]}", own[f"S{kind[1]}"]))
                names.append(row.name(0))
                places.append((block, row, 2))
            for row in block.rows if block.name in ("DSLOAD", "DLOAD") else ():
                if any(row.fields[3:]):
                    raise block.refused(f"data '{row.fields[3]}' is not honoured", row)
        if not places:
            raise self.found.inflation[0].refused("has no pressure: *DSLOAD needs a data line")
        values = {row.number(i) for _, row, i in places}
        if len(values) > 1:
            raise places[1][0].refused("one pressure is honoured, the same on all", places[1][1])
        if not values.pop() > 0:
            raise places[0][0].refused("the pressure must be positive", places[0][1])
        return faces, " and ".join(dict.fromkeys(names)), tuple(places)

    def _on_solids(self, pressed: list[Face], boundary: Sequence[Face]) -> tuple[Face, ...]:
        """The free faces of solids that a pressure acts on, those under plies among them."""
        free = {frozenset((f[2][0], f[2][-1])): f for f in boundary}
        surface = self.found.inflation[0]
        found: dict[int, Face] = {}
        for n, face, raw in pressed:
            nodes = tuple(self.same.get(each, each) for each in raw)
            own = free.get(frozenset((nodes[0], nodes[-1])))
            element = self.root.elements[n]
            if own is None:
                raise surface.refused(
                    f"the pressure acts on face {face} of element {n}, which is no free surface"
                )
            if (own[2][0], own[2][-1]) != (nodes[0], nodes[-1]):
                raise element.block.refused(
                    f"element {n}: the pressure on its face {face} comes from the rubber's side",
                    element.row,
                )
            if id(own) in found:
                raise surface.refused(f"the pressure acts twice on face {face} of element {n}")
            found[id(own)] = own
        return tuple(found.values())

    def _rules(self) -> None:
        """Rigid bodies, then what is tied or embedded."""
        for block, prefix in self.made.rules:
            if block.name == "RIGID BODY":
                self._rigid(block, prefix)
        for block, prefix in self.made.rules:
            if block.name == "TIE":
                self._tie(block, prefix)
            elif block.name == "EMBEDDED ELEMENT":
                self._embed(block, prefix)

    def _rigid(self, block: Block, prefix: str) -> None:
        if self.reference:
            raise block.refused("one rigid body is honoured, the rim")
        name = block.need("REF NODE")
        reference = self.root.nodes_in(prefix + name, block)
        if len(reference) != 1:
            raise block.refused(f"REF NODE={name} is {len(reference)} nodes, one is needed")
        self.reference = reference[0], self.root.nodes[reference[0]]
        if not (block.get("TIE NSET") or block.get("ELSET")):
            raise block.refused("needs TIE NSET= or ELSET=")
        if tied := block.get("TIE NSET"):
            self.rim |= dict.fromkeys(self.root.nodes_in(prefix + tied, block))
        if body := block.get("ELSET"):
            for n in self.root.elements_in(prefix + body, block):
                self.rim |= dict.fromkeys(self.root.elements[n].nodes)
        self.rim.pop(reference[0], None)

    def _surface_nodes(self, name: str, block: Block, row: Row) -> list[int]:
        surface, prefix = self.made.surfaces.get(name, (None, ""))
        if surface and surface.get("TYPE") == "NODE":
            return [
                n
                for line in surface.rows
                for n in self.root.nodes_in(prefix + line.name(0), surface, line)
            ]
        return list(dict.fromkeys(n for _, _, nodes in self.faces(name, block, row) for n in nodes))

    def _tie(self, block: Block, prefix: str) -> None:
        """The bead on the rim's elements, or two surfaces of the same places."""
        for row in block.rows:
            slaves = self._surface_nodes(prefix + row.name(0), block, row)
            name = prefix + row.name(1)
            surface = self.made.surfaces.get(name)
            if surface and self._is_rigid(*surface):
                self.rim |= dict.fromkeys(slaves)
                continue
            for n, distance in self._merge(slaves, self._surface_nodes(name, block, row)).items():
                raise block.refused(
                    f"node {n} lies {distance:.3g} from the nearest node that it could be tied to:"
                    " only nodes in the same place are, mesh both alike",
                    row,
                )

    def _is_rigid(self, surface: Block, prefix: str) -> bool:
        if surface.get("TYPE") == "NODE":
            return False
        members = [
            n
            for row in surface.rows
            for n in self.root.elements_in(prefix + row.name(0), surface, row)
        ]
        return bool(members) and all(self.root.elements[n].kind == "RAX2" for n in members)

    def _embed(self, block: Block, prefix: str) -> None:
        """Plies on nodes of their own: those where the rubber has nodes are the rubber's."""
        hosts = (
            self.root.elements_in(prefix + block.get("HOST ELSET"), block)
            if block.get("HOST ELSET")
            else [n for n, e in self.root.elements.items() if e.is_solid]
        )
        rubber = list(dict.fromkeys(n for e in hosts for n in self.root.elements[e].nodes))
        lines, before = [], len(self.guests)
        for row in block.rows:
            for name in filter(None, row.fields):
                members = self.root.elements_in(prefix + name.strip('"').upper(), block, row)
                wrong = [n for n in members if not self.root.elements[n].is_ply]
                if wrong:
                    raise block.refused(f"element {wrong[0]} of {name} is no SFMGAX", row)
                own = dict.fromkeys(n for e in members for n in self.root.elements[e].nodes)
                own = dict.fromkeys(own.keys() - set(rubber))
                self.guests |= self._merge(list(own), rubber).keys()
                lines.append((row, tuple(members)))
        if len(self.guests) > before:
            self.embedded.append(Embedded(block, tuple(hosts), tuple(lines)))

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
        """What *BOUNDARY holds: the rim's reference node, the bead, or the plane of a half."""
        blocks = [*self.made.held, *(b for b in self.found.inflation if b.name == "BOUNDARY")]
        fixed: dict[int, set[int]] = {}
        for block in blocks:
            for row in block.rows:
                freedoms = _freedoms(block, row)
                for n in self.root.nodes_in(row.name(0), block, row):
                    fixed.setdefault(n, set()).update(freedoms)
        if self.reference:
            own = fixed.pop(self.reference[0], set())
            if not {1, 2, 6} <= own:
                raise self.made.rules[0][0].refused(
                    f"*BOUNDARY must hold the rim's node {self.reference[0]} in 1, 2 and 6"
                )
        solid = {n for e in self.root.elements.values() for n in e.nodes}
        for n, freedoms in fixed.items():
            if n not in solid:
                continue
            point = self.root.nodes[n]
            if {1, 2} <= freedoms and (5 in freedoms or n in self.rim):
                self.rim[n] = None
            elif n in self.rim or (
                freedoms <= {2, 4, 6} and self.made.reflect and self._on_plane(point)
            ):
                continue
            else:
                block, row = self._where(n, blocks)
                hint = (
                    "a half is made whole by *SYMMETRIC MODEL GENERATION, REFLECT=LINE"
                    if freedoms <= {2, 4, 6}
                    else "a rim holds 1, 2 and 5 (ENCASTRE)"
                )
                raise block.refused(f"node {n} is held in {sorted(freedoms)} only: {hint}", row)

    def _where(self, number: int, blocks: Sequence[Block]) -> tuple[Block, Row]:
        return next(
            (block, row)
            for block in blocks
            for row in block.rows
            if number in self.root.nodes_in(row.name(0), block, row)
        )

    def _on_plane(self, point: Point) -> bool:
        assert self.made.reflect
        r, z = mirror_of(self.made.reflect)(point)
        return max(abs(r - point[0]), abs(z - point[1])) <= self.near

    def _reflect(
        self, solids: Sequence[Assigned], plies: Sequence[Assigned], pressed: list[Face]
    ) -> tuple[tuple[Assigned, ...], tuple[Assigned, ...], list[Face]]:
        """The other half: its half turn about the line, nodes on the line shared."""
        assert self.made.reflect
        root, mirror = self.root, mirror_of(self.made.reflect)
        used = {n for e in root.elements.values() for n in e.nodes}
        shift = max(root.nodes)
        image = {n: n if self._on_plane(root.nodes[n]) else n + shift for n in used}
        if all(n != m for n, m in image.items()):
            raise self.made.reflect.refused("no node lies on the line: the halves do not meet")
        sides = {
            np.sign(round((mirror(root.nodes[n])[1] - root.nodes[n][1]) / self.near)) for n in used
        } - {0}
        if len(sides) > 1:
            raise self.made.reflect.refused("nodes lie on both sides of the line: it is no half")
        for n, m in image.items():
            if n != m:
                root.nodes[m] = mirror(root.nodes[n])
        further = max(root.elements)
        both_faces = list(pressed)
        for number, element in list(root.elements.items()):
            nodes = tuple(image[n] for n in element.nodes)
            root.elements[number + further] = Element(
                element.kind, reflected(element, nodes), element.block, element.row
            )
        both = lambda each: Assigned(
            each.block, each.name, each.elements + tuple(n + further for n in each.elements)
        )
        for n, face, nodes in pressed:
            turned = tuple(image[self.same.get(m, m)] for m in nodes)[::-1]
            both_faces.append((n + further, face, turned))
        self.rim |= dict.fromkeys(image[n] for n in list(self.rim) if n in image)
        self.guests |= {image[n] for n in self.guests}
        doubled = lambda numbers: (*numbers, *(n + further for n in numbers))
        self.embedded = [
            Embedded(e.block, doubled(e.hosts), tuple((row, doubled(own)) for row, own in e.lines))
            for e in self.embedded
        ]
        return tuple(map(both, solids)), tuple(map(both, plies)), both_faces


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
