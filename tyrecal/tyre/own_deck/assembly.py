"""The parts and instances of a deck joined into one set of nodes, elements, sets and options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from .generation import MESH_KEYWORDS, members_of, read, shift_of
from .scope import Members, MeshTable, Point, Scope
from .text import Block


@dataclass
class Assembly:
    """Contents of a deck. A name in an instance gets the prefix "INSTANCE." of that instance; a
    block comes with the prefix ("" outside instances) that the names in its data need."""

    root: Scope = field(default_factory=Scope)
    others: list[tuple[Block, str]] = field(default_factory=list)  # sections, rigid bodies, ...
    # by name with its prefix: block, prefix
    surfaces: dict[str, tuple[Block, str]] = field(default_factory=dict)
    # number in the model to the instance's name and the number in its part
    instance_nodes: dict[int, tuple[str, int]] = field(default_factory=dict)
    shifts: dict[str, Point] = field(default_factory=dict)  # of instances, by their prefix
    reflect: Block | None = None  # the *SYMMETRIC MODEL GENERATION that makes a half whole

    def of(self, *names: str) -> list[tuple[Block, str]]:
        """Blocks of these keywords in their order, each with its prefix."""
        return [(block, prefix) for block, prefix in self.others if block.name in names]


@dataclass
class DeckPart:
    """A *PART; instances: by name, numbers of nodes and of elements in the model by its own."""

    block: Block
    scope: Scope
    other: list[Block] = field(default_factory=list)
    instances: dict[str, tuple[dict[int, int], dict[int, int]]] = field(default_factory=dict)


def collect(blocks: Sequence[Block]) -> Assembly:
    """The assembly of a deck's model blocks. Raises OwnDeckError."""
    made, parts = Assembly(), dict[str, DeckPart]()
    part: DeckPart | None = None
    instance: Block | None = None
    later: list[Block] = []  # what waits for the numbers of all nodes and elements outside parts
    for block in blocks:
        if block.name == "PART":
            name = block.need("NAME")
            if name in parts:
                raise block.refused(f"the part {name} is defined twice")
            part = parts[name] = DeckPart(block, Scope())
        elif block.name == "END PART":
            part = None
        elif block.name == "INSTANCE":
            instance, part = block, parts.get(block.need("PART"))
            if part is None:
                raise block.refused(f"the part {block.get('PART')} is not defined above")
        elif block.name == "END INSTANCE" and instance:
            later.append(instance)
            instance = part = None
        elif part is not None:
            if instance and any(each.get("PART") == instance.get("PART") for each in later):
                raise block.refused("is in an *INSTANCE: give it in the *PART")
            if block.name in MESH_KEYWORDS:
                read(part.scope, block)
            part.other.append(block)
        elif block.name in MESH_KEYWORDS and not block.get("INSTANCE"):
            read(made.root, block)
        else:
            later.append(block)
    for block in later:
        if block.name == "INSTANCE":
            _instance(made, parts, block)
        else:
            _other(made, block, "", parts)
    for each in parts.values():
        if not each.instances:
            raise each.block.refused("no *INSTANCE of it is in the assembly")
    return made


def _instance(made: Assembly, parts: dict[str, DeckPart], block: Block) -> None:
    """Put a part's nodes, elements, sets and options in the model under INSTANCE.NAME; numbers that
    are taken there go up by the model's largest."""
    name, part = block.need("NAME"), parts[block.need("PART")]
    if any(name in each.instances for each in parts.values()):
        raise block.refused(f"the instance {name} is defined twice")
    made.shifts[f"{name}."] = dr, dz = shift_of(block)
    root, own = made.root, part.scope
    pairs: list[tuple[MeshTable[Any], MeshTable[Any]]]
    pairs = [(root.nodes, own.nodes), (root.elements, own.elements)]
    new = []  # numbers of nodes and elements in the model
    for labels, of_part in pairs:
        more = max(labels) if labels.keys() & of_part.keys() else 0
        new.append({n: n + more for n in of_part})
    nodes, elements = new
    for n, (r, z) in own.nodes.items():
        root.nodes[nodes[n]] = (r + dr, z + dz)
        made.instance_nodes[nodes[n]] = name, n
    for n, e in own.elements.items():
        root.elements[elements[n]] = replace(e, nodes=tuple(nodes[each] for each in e.nodes))
    part.instances[name] = nodes, elements
    for (labels, of_part), numbers in zip(pairs, new, strict=True):
        for each, defined in of_part.sets.items():
            of = partial(of_part.members, each, defined[0][0])
            labels.sets[f"{name}.{each}"] = [(defined[0][0], _renumbered(of, numbers))]
        for n, m in numbers.items():
            labels.sets[f"{name}.{n}"] = [(block, partial(list, [m]))]
        labels.put(block, list(numbers.values()))
    for other in part.other:
        if other.name not in MESH_KEYWORDS:
            _other(made, other, f"{name}.", parts)


def _renumbered(members: Members, numbers: dict[int, int]) -> Members:
    """The members of a part's set under their numbers in the model, looked up when asked for."""
    return lambda: [numbers[n] for n in members()]


def _other(made: Assembly, block: Block, prefix: str, parts: dict[str, DeckPart]) -> None:
    """Put a block into the assembly that is no mesh keyword, or a set of an instance's members."""
    name = block.name
    if name in ("NSET", "ELSET"):  # of an instance, from outside it
        for part in parts.values():
            if numbers := part.instances.get(block.get("INSTANCE")):
                labels = made.root.nodes if name == "NSET" else made.root.elements
                of = _renumbered(members_of(part.scope, block), numbers[name == "ELSET"])
                labels.add_to_set(block.need(name), block, of)
                return
        raise block.refused(f"the instance {block.get('INSTANCE')} is not defined above")
    made.others.append((block, prefix))
    if name == "SURFACE":
        if prefix + block.need("NAME") in made.surfaces:
            raise block.refused(f"the surface {block.get('NAME')} is defined twice")
        made.surfaces[prefix + block.need("NAME")] = block, prefix
    elif name == "SYMMETRIC MODEL GENERATION":
        if made.reflect:
            raise block.refused("is there twice")
        made.reflect = block
