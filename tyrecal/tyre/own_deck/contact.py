"""Contact of the bead with rims that are rigid surfaces: what a held bead makes superfluous.

No contact of the section is computed. Where the bead is held, its contact with a rim is left out;
else the deck is refused with the lines that hold the bead where the rim is after its last motion.
A bead is held if at least half of its nodes at the rim are. Lengths are in the deck's own unit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .assembly import Assembly
from .classify import ClassifiedDeck
from .constraints import Constraints
from .scope import FARTHEST, label_lines, nearest
from .surfaces import boundary_of, rigid_pieces, surface_nodes
from .text import Block, Row

TOUCHING = 0.01  # of the section's size: a node that near to the rim touches it
PUSHED = 0.1  # of the section's size: how far a rim pushes nodes of a bead that it is mounted on
MAX_NAMES = 100  # SEATED, SEATED_2, ... of sets that are proposed
MAX_DISTANCES = 5_000_000  # nodes times segments of a pair
Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Pair:
    """Nodes that may touch a rigid surface; row: the data line of a *CONTACT PAIR, else None."""

    block: Block
    row: Row | None
    name: str
    nodes: tuple[int, ...]
    pieces: Array  # (k, 2, 2) start and end (r, z) of the surface's pieces, the tyre on their left
    reference: int  # node of the rigid surface


class DeckContact:
    """The contact of a deck. Raises OwnDeckError."""

    def __init__(self, made: Assembly, blocks: ClassifiedDeck, tied: Constraints):
        self.made, self.blocks, self.tied, self.root = made, blocks, tied, made.root
        rubber = self.root.rubber_nodes()
        points = np.array([self.root.nodes[n] for n in rubber])
        self.middle = points[:, 0].min() / 2 + points[:, 0].max() / 2  # r; a rim is below it
        self.size = float(np.ptp(points, axis=0).max())

    def left_out(self) -> tuple[str, ...]:
        """Words on each contact that is left out. Raises OwnDeckError if a bead is not held."""
        words, free = list[str](), list[tuple[Pair, Array, Array]]()
        for pair in self._pairs():
            touching, distance = self._touching(pair)
            at_rim = touching.tolist() or pair.nodes
            held = [n for n in at_rim if n in self.tied.rim]
            if pair.pieces[..., 0].min() > self.middle:  # a road or a mould
                if len(touching):
                    raise pair.block.refused(
                        f"the contact of {pair.name} is not honoured, only that of a bead with its"
                        f" rim: node {touching[0]} is {distance[0]:.3g} from it",
                        pair.row,
                    )
                words.append(f"contact of {pair.name}, which do not touch in this step")
            elif held and 2 * len(held) >= len(touching):
                off = f", up to {distance.max():.3g} off the rim" if len(touching) else ""
                words.append(f"contact of {pair.name}, as {len(held)} of its nodes are held{off}")
            else:
                free.append((pair, touching, distance))
        if free:
            self._refuse(free)
        return tuple(words)

    def _pairs(self) -> Iterator[Pair]:
        """Pairs of *CONTACT PAIR; for *CONTACT the rubber's surface with each rigid one."""
        for block in self.blocks.contact:
            if block.name == "CONTACT":
                nodes = dict.fromkeys(n for _, _, face in boundary_of(self.root) for n in face)
                bodies = [name for body in self.tied.bodies for name in body.surfaces]
                if not bodies:
                    raise block.refused("contact of the rubber with itself is not honoured")
                for name in bodies:
                    yield self._pair(block, None, "all free surfaces", nodes, name)
            for row in block.rows if block.name == "CONTACT PAIR" else ():
                slave, master = row.name(0), row.name(1)
                if not any(master in body.surfaces for body in self.tied.bodies):
                    raise block.refused(
                        f"{master or slave} is no rigid surface: contact is honoured of a bead with"
                        " a rim, *SURFACE of TYPE=SEGMENTS or RAX2 elements in a *RIGID BODY",
                        row,
                    )
                members = surface_nodes(self.made, slave, block, row)
                yield self._pair(block, row, slave, members, master)

    def _pair(
        self, block: Block, row: Row | None, slave: str, nodes: Iterable[int], master: str
    ) -> Pair:
        """A pair, the rigid surface where it is at the end of the step that inflates."""
        body = next(body for body in self.tied.bodies if master in body.surfaces)
        pieces = rigid_pieces(self.made, *self.made.surfaces[master])
        motion = self.tied.motions.get(body.reference, {})  # 1: in r, 2: in z
        moved = pieces + np.array([motion.get(1, 0.0), motion.get(2, 0.0)])
        if not (len(moved) and np.abs(moved).max() < FARTHEST):
            raise block.refused(f"{master} has no length, or is where no tyre is", row)
        own = tuple(dict.fromkeys(self.tied.same.get(n, n) for n in nodes))  # one of each place
        if len(own) * len(moved) > MAX_DISTANCES:
            raise block.refused(f"{slave} and {master} have too many nodes and segments", row)
        return Pair(block, row, f"{slave} and {master}", own, moved, body.reference)

    def _touching(self, pair: Pair) -> tuple[Array, Array]:
        """Nodes (k,) that lie on the rigid surface or beyond it, and how far from it they are."""
        X = np.array([self.root.nodes[n] for n in pair.nodes])
        away, normal = nearest(X, pair.pieces[:, ::-1])  # reversed: normals point to the tyre
        points, count = np.unique(pair.pieces.reshape(-1, 2), axis=0, return_counts=True)
        ends = points[count == 1]
        to_end = np.hypot(*(X[:, None] - ends).T).min(0, initial=np.inf)
        past_an_end = to_end <= away * (1 + 1e-9)
        # a step towards the tyre brings a node nearer to the surface only from beyond it
        further, _ = nearest(X + 1e-6 * self.size * normal, pair.pieces)
        beyond = (further < away) & ~past_an_end & (away < PUSHED * self.size)
        touching = (away <= TOUCHING * self.size) | beyond
        away[away < self.tied.near] = 0.0
        return np.array(pair.nodes)[touching], away[touching]

    def _refuse(self, free: Sequence[tuple[Pair, Array, Array]]) -> None:
        """Raises OwnDeckError with the lines that hold the beads."""
        pair = free[0][0]
        for each, touching, _ in free:
            if not {1, 2} <= self.tied.motions.get(each.reference, {1: 0.0, 2: 0.0}).keys():
                raise each.block.refused(
                    f"contact of {each.name} is not honoured, and the place of the rim is not"
                    f" known: *BOUNDARY must hold or move its node {each.reference} in 1 and 2",
                    each.row,
                )
            if not len(touching):
                X = np.array([self.root.nodes[n] for n in each.nodes])
                away, _ = nearest(X, each.pieces)
                raise each.block.refused(
                    f"contact of {each.name} is not honoured, and none of the nodes touches the"
                    " rim at its place after its last motion: node"
                    f" {each.nodes[int(away.argmin())]} is the nearest, {away.min():.3g} away;"
                    " hold the bead by *BOUNDARY, ENCASTRE",
                    each.row,
                )
        nodes = sorted({int(n) for _, touching, _ in free for n in touching})
        most = max(distance.max() for *_, distance in free)
        raise pair.block.refused(
            f"contact of {' and '.join(each.name for each, *_ in free)} is not honoured; hold the"
            f" bead where it touches the rim (its nodes stay where they are, up to {most:.3g} off"
            f" it) by adding {self._lines(nodes)}",
            pair.row,
        )

    def _lines(self, nodes: Sequence[int]) -> str:
        """The lines that hold nodes, and where they belong."""
        names = ("SEATED", *(f"SEATED_{k}" for k in range(2, MAX_NAMES)))
        name = next(each for each in names if each not in self.root.nodes.sets)
        lines, known = list[str](), self.made.instance_nodes
        own = [known.get(n, ("", n)) for n in nodes]
        for instance in dict.fromkeys(each for each, _ in own):
            lines.append(f"*NSET, NSET={name}" + f", INSTANCE={instance}" * bool(instance))
            lines += label_lines([n for each, n in own if each == instance])
        where = "before *END ASSEMBLY" if known else "before the first *STEP"
        steps = [block for block in self.blocks.inflation if block.name == "BOUNDARY"]
        blocks = (*(block for block, _ in self.made.of("BOUNDARY")), *steps)
        released = [block for block in blocks if block.get("OP") == "NEW"]
        head = "*BOUNDARY" + ", OP=NEW" * any(block in released for block in steps)
        held = [head, f"{name}, ENCASTRE"]
        if known or released:
            place = "before *END STEP of the step that inflates" if released else "before *STEP"
            held.insert(0, f"and {place}:")
        return "\n".join((f"{where}:", *lines, *held))
