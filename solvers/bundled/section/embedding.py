"""Cords in rubber of another mesh: each of their nodes moves with the point of the element that it
lies in, as *EMBEDDED ELEMENT has it,

    u = sum_i N_i(xi) u_i,    X = sum_i N_i(xi) X_i,

so that a line's own shape functions become those of its hosts' nodes: equations of its nodes there
are none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...language.spelling import named
from ...language.text import Block, DeckError, Row
from .shapes import TYPES, ElementType

Array = np.ndarray
EXTERIOR = 0.05  # of the hosts' size that a node may lie outside them (ABAQUS' default)
SAME_DISTANCE = 1e-12  # m: of less, rounding decides, which differs from processor to processor
ROUNDOFF = 1e-6  # weights below it are zero (likewise)
MAX_MAPPING_STEPS, XI_SETTLED = (
    20,
    1e-9,
)  # of Newton's method for xi, whose error is the square of a step


@dataclass(frozen=True)
class Guest:
    """A node in its host element."""

    X: Array  # (2,): R, Z, m
    kind: ElementType  # of the host
    nodes: Array  # (a,): rows of the mesh
    xi: Array  # (2,): its natural coordinates in the host
    kept: Array  # (a,): which shape functions of the host are not zero there

    @property
    def rows(self) -> Array:
        """The nodes (k,) that it moves with."""
        return self.nodes[self.kept]

    def renumbered(self, new: Array) -> Guest:
        """A copy with the nodes' new rows."""
        return replace(self, nodes=new[self.nodes])

    def weights(self, X: Array) -> Array:
        """Weights of the nodes in `rows`; X (n, 2) of all nodes, with tangents or without."""
        xi = self.xi
        # Newton's steps: xi is real and nearly exact; the second one rids its tangent of that error
        for _ in range(2 if np.iscomplexobj(X) or np.iscomplexobj(self.X) else 0):
            xi = xi + _step(self.kind, X[self.nodes], self.X, xi)
        N: Array = self.kind.at(xi[None])[0][0][self.kept]
        return N / N.sum()


@dataclass(frozen=True)
class Embedded:
    """Lines of one type with guests among their nodes, and as many host nodes each."""

    line: str
    points: Array  # (e, a): rows of the mesh, or of guests as -1, -2, ...
    rows: Array  # (e, h): the h host nodes of each element, rows of the mesh

    def weights(self, X: Array, guests: Sequence[Guest]) -> Array:
        """Weights of the host nodes in the line's own nodes (e, a, h)."""
        known = {-1 - k: (guests[k].rows, guests[k].weights(X)) for k in self._guests()}
        kind = np.result_type(float, *(w for _, w in known.values()))
        result = np.zeros((*self.points.shape, self.rows.shape[1]), kind)
        for e, j in np.ndindex(self.points.shape):
            point = int(self.points[e, j])
            rows, own = known.get(point, (np.array([point]), np.ones(1)))
            for row, weight in zip(rows, own, strict=True):
                result[e, j, self.rows[e] == row] = weight
        return result

    def renumbered(self, new: Array) -> Embedded:
        """A copy with the nodes' new rows."""
        points = np.where(self.points < 0, self.points, new[self.points])
        return replace(self, points=points, rows=new[self.rows])

    def points_at(self, X: Array, guests: Sequence[Guest]) -> Array:
        """Where its own nodes are (e, a, 2)."""
        places = np.concatenate([X, np.array([guest.X for guest in reversed(guests)])])
        return np.asarray(places[self.points])

    def some(self, kept: Array) -> Embedded:
        """Some of the elements."""
        return replace(self, points=self.points[kept], rows=self.rows[kept])

    def _guests(self) -> list[int]:
        return sorted({-1 - p for p in self.points.ravel().tolist() if p < 0})


@dataclass
class Embedding:
    """Elements and nodes that the keywords of a deck embed."""

    guests: list[Guest] = field(default_factory=list)
    of_node: dict[int, int] = field(default_factory=dict)  # guest by its row in the deck
    blocks: dict[str, Embedded] = field(default_factory=dict)
    place: dict[int, tuple[str, int]] = field(default_factory=dict)  # of the elements embedded


def embedding(
    keywords: Sequence[Block],
    X: Array,
    connectivity: Mapping[str, Array],
    place: Mapping[int, tuple[str, int]],
    sets: Mapping[str, Sequence[int]],
) -> Embedding:
    """The deck's; no guest is a node of rubber. Raises DeckError where one lies outside."""
    result = Embedding()
    lines = {
        number: connectivity[kind][row]
        for number, (kind, row) in place.items()
        if not TYPES[kind].faces
    }
    solids = {kind: rows for kind, rows in connectivity.items() if TYPES[kind].faces}
    rubber = {int(n) for rows in solids.values() for n in rows.ravel()}
    size = _mean_size(X.real, solids)
    for k in keywords:
        hosts = solids
        if k.get("HOST ELSET"):
            members = [place[n] for n in _members(k, None, k.need("HOST ELSET"), sets)]
            hosts = {
                kind: rows[sorted(row for own, row in members if own == kind)]
                for kind, rows in solids.items()
            }
        tolerance, roundoff = _tolerance(k, size), k.number("ROUNDOFF TOLERANCE") or ROUNDOFF
        for row in k.rows:
            for name in filter(None, row.fields):
                for number in _members(k, row, named(name), sets):
                    if number not in lines:
                        raise DeckError(
                            row.place, f"element {number} of {name} is no line of cords"
                        )
                    for n in sorted({*lines[number].tolist()} - rubber - result.of_node.keys()):
                        result.of_node[n] = len(result.guests)
                        guest = _guest(row, X, hosts, n, tolerance, roundoff)
                        result.guests.append(guest)
    _sort(result, lines, place)
    return result


def _sort(
    embedded: Embedding, lines: Mapping[int, Array], place: Mapping[int, tuple[str, int]]
) -> None:
    """Blocks of lines that have as many host nodes."""
    blocks: dict[str, tuple[str, list[list[int]], list[list[int]]]] = {}
    for number, nodes in lines.items():
        points = [-1 - embedded.of_node[n] if n in embedded.of_node else int(n) for n in nodes]
        if min(points) >= 0:
            continue
        own = [embedded.guests[-1 - p].rows.tolist() if p < 0 else [p] for p in points]
        rows = sorted({n for each in own for n in each})
        line = place[number][0]
        name = f"{line} in {len(rows)}"
        _, all_points, all_rows = blocks.setdefault(name, (line, [], []))
        embedded.place[number] = name, len(all_rows)
        all_points.append(points)
        all_rows.append(rows)
    embedded.blocks = {
        name: Embedded(line, np.array(points), np.array(rows))
        for name, (line, points, rows) in blocks.items()
    }


def _members(
    k: Block, row: Row | None, name: str, sets: Mapping[str, Sequence[int]]
) -> Sequence[int]:
    if name not in sets:
        raise DeckError(row.place if row else k.place, f"element set {name} is not defined")
    return sets[name]


def _mean_size(X: Array, solids: Mapping[str, Array]) -> float:
    """Mean square root of the elements' areas, m."""
    areas = []
    for kind, rows in solids.items():
        corners = X[rows[:, : len(TYPES[kind].faces)]]
        after = np.roll(corners, -1, 1)
        cross = corners[..., 0] * after[..., 1] - corners[..., 1] * after[..., 0]
        areas.append(abs(cross.sum(1)) / 2)
    return float(np.sqrt(np.concatenate(areas)).mean())


def _tolerance(k: Block, size: float) -> float:
    """The smaller one, m, of those that are given."""
    absolute, share = k.number("ABSOLUTE EXTERIOR TOLERANCE"), k.number("EXTERIOR TOLERANCE")
    if absolute and share is None:
        return absolute
    own = (EXTERIOR if share is None else share) * size
    return min(own, absolute) if absolute else own


def _guest(
    row: Row, X: Array, hosts: Mapping[str, Array], node: int, tolerance: float, roundoff: float
) -> Guest:
    """The node in the host that it is in or, within the tolerance, nearest to. Raises DeckError."""
    place, all_X = X[node].real, X.real
    best, nearest = None, np.inf
    for kind, elements in hosts.items():
        corners = all_X[elements]
        beyond = np.maximum(corners.min(1) - place, place - corners.max(1)).max(1)
        slack = tolerance + 0.2 * np.ptp(corners, axis=1).max(1)  # curved sides bulge
        for nodes in elements[beyond < slack]:
            xi = _inverse(TYPES[kind], all_X[nodes], place)
            if xi is None:
                continue
            inside = TYPES[kind].clipped(xi)
            away = float(np.hypot(*(TYPES[kind].at(inside[None])[0][0] @ all_X[nodes] - place)))
            if away < nearest - SAME_DISTANCE:
                best, nearest = (TYPES[kind], nodes, xi), away
    if best is None or nearest > tolerance + SAME_DISTANCE:
        far = "in no host element" if best is None else f"{nearest:.3g} m outside its hosts"
        raise DeckError(
            row.place,
            f"the node at r, z = {place[0]:.6g}, {place[1]:.6g} m is {far}, more than the exterior"
            f" tolerance {tolerance:.3g} m",
        )
    host, nodes, xi = best
    kept = abs(host.at(xi[None])[0][0]) > roundoff
    if not kept.any():
        words = (
            f"a ROUNDOFF TOLERANCE of {roundoff:g} leaves a node without a host: it is below 0.2"
        )
        raise DeckError(row.place, words)
    return Guest(X[node], host, nodes, xi, kept)


def _inverse(kind: ElementType, corners: Array, place: Array) -> Array | None:
    """xi of a point of the isoparametric map, by Newton's method; None where it does not settle."""
    xi = kind.clipped(np.full(2, 0.25 if len(kind.faces) == 3 else 0.0))
    for _ in range(MAX_MAPPING_STEPS):
        step = _step(kind, corners, place, xi)
        if not np.isfinite(step).all() or abs(xi).max() > 10:
            return None
        xi = xi + step
        if abs(step).max() < XI_SETTLED:
            return xi
    return None


def _step(kind: ElementType, corners: Array, place: Array, xi: Array) -> Array:
    """Newton step of the natural coordinates xi (2,) of ``place`` (2,) in an element with nodes
    ``corners`` (a, 2)."""
    N, dN = (each[0] for each in kind.at(xi[None]))
    tangent = corners.T @ dN  # dX_j / dxi_k
    off = place - N @ corners
    det = tangent[0, 0] * tangent[1, 1] - tangent[0, 1] * tangent[1, 0]
    if abs(det) < 1e-300:
        return np.full(2, np.nan)
    first = tangent[1, 1] * off[0] - tangent[0, 1] * off[1]
    second = tangent[0, 0] * off[1] - tangent[1, 0] * off[0]
    return np.array([first, second]) / det
