"""One sector of the tyre in solid elements, its plies as thin rows about the cord lines.

The axle is z. The sector's section stands at Theta = 0, its copy one sector before it, so that
bricks keep the corners' order of the section's elements: bottom at Theta = 0, top behind. Sides
are straight in the section: a ply's material has one direction per element, and where the
element is curved away from it, the ply is too soft (0.4 to 0.7 % of the frequencies).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from ...tyre.section.curve import length_along
from ...tyre.section.mesh import SectionMesh, build_mesh
from ...tyre.section.section import Section

Array = np.ndarray
Corner = tuple[int, ...]  # a corner of the section's mesh, or the two corners of a side
# CalculiX's label of a pressure on a brick's face 6, over side 4 of the section's element
INNER_FACE = "P6"


@dataclass(frozen=True)
class PlyStrip:
    """An element of a ply."""

    element: int  # its number in the section
    along: tuple[float, float]  # unit vector (r, z) along its meridian, from -z to +z
    radius: float  # of the cord line's middle, m
    # its volume over the cord surface's area, m: less than the ply's where the line has a kink
    thickness: float


@dataclass(frozen=True, eq=False)
class Sector:
    """Bricks of one sector."""

    nodes: list[tuple[int, float, float, float]]  # number; x (r at Theta = 0), y, z in m
    bricks: dict[int, tuple[int, ...]]  # section element to nodes (8 or 20, in ABAQUS' order)
    # section element to its row in the mesh without plies, from 0 at the inner surface; a ply's is
    # that inside it
    rows: dict[int, int]
    regions: dict[int, str]  # section element to its region
    strips: dict[str, list[PlyStrip]]  # per line, from -z to +z
    section: list[int]  # nodes on the front face
    behind: list[int]  # nodes on the other face
    # (node halfway between the faces, node in front of it), the held ones left out
    between: list[tuple[int, int]]
    rim: list[int]  # held nodes except those behind
    inner: list[int]  # section elements at the inner surface, on which the pressure acts


@dataclass(frozen=True)
class Division:
    """Division of a section into elements."""

    elements: tuple[int, ...]  # along each region
    rows: tuple[int, ...]  # between neighbouring lines
    # thickness of a row over that of the row inside it, between neighbouring lines; None: 1
    grading: tuple[float, ...] | None


@lru_cache(maxsize=4)
def build_sector(
    section: Section,
    division: Division,
    quadratic: bool,
    sectors: int,
    thickness: float,
    whole_bead: bool,
) -> Sector:
    """A sector of 360/``sectors`` degrees, one element long, with plies of ``thickness`` (m).

    quadratic: bricks of 20 nodes, else 8; whole_bead: the mesh goes round the bead. Raises
    SectionError where rows fold over, as they do when plies overlap.
    """
    split = with_plies(section, thickness)
    rows = division.rows
    thin = [1] * len(rows[1:])
    counts = interleaved(list(rows), thin)
    grades = interleaved(list(division.grading or (1.0,) * len(rows)), [1.0] * len(thin))
    # elements of 4 nodes: `_extruded` adds midside nodes, straight ones, if quadratic
    mesh = build_mesh(
        split, list(division.elements), counts, False, grading=grades, whole_bead=whole_bead
    )
    plies = np.cumsum(counts)[0:-1:2]  # the thin row over each line
    row_of = {}
    for number, (_, row) in mesh.cells.items():
        below = int(np.sum(plies < row))
        row_of[number] = row - below - (row in plies)
    names = section.names[1:-1]
    # numbers of `mesh`, columns from 1: cords 1000000 line + column, elements 1000 column + row + 1
    strips = {
        name: [_strip(mesh, 1000 * (n % 1000000) + int(row) + 1) for n in mesh.cords[f"{name}-"]]
        for name, row in zip(names, plies, strict=True)
    }
    return Sector(**_extruded(mesh, 2 * math.pi / sectors, quadratic), rows=row_of, strips=strips)


def with_plies(section: Section, thickness: float) -> Section:
    """The section with each cord line as two, half a ply's thickness inside (-) and outside (+)."""
    points, names = [section.points[0]], [section.names[0]]
    for name, line in zip(section.names[1:-1], section.points[1:-1], strict=True):
        offset = thickness / 2 * _normals(line)
        points += [line - offset, line + offset]
        names += [f"{name}-", f"{name}+"]
    points.append(section.points[-1])
    return replace(section, names=(*names, section.names[-1]), points=np.array(points))


def _normals(line: Array) -> Array:
    """Unit normals (station, 2) outwards, (1, 0) at a crown from which stations go to z > 0; NaN
    where the line is absent or has a single point."""
    normals = np.full_like(line, np.nan)
    have = np.flatnonzero(~np.isnan(line).any(1))
    for run in np.split(have, np.flatnonzero(np.diff(have) > 1) + 1):
        p = line[run]
        if len(p) < 2:
            continue
        mirrored = abs(p[0, 1]) < 1e-9  # on the centre plane the line runs on by symmetry
        if mirrored:
            p = np.concatenate([p[1:2] * [1, -1], p])
        length = length_along(p)
        tangent = np.gradient(p, length, axis=0)[int(mirrored) :]
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        normals[run] = np.stack([tangent[:, 1], -tangent[:, 0]], -1)
    return normals


def _strip(mesh: SectionMesh, number: int) -> PlyStrip:
    """The strip of an element of a ply, by its number in the section."""
    corner = np.array([mesh.nodes[n] for n in mesh.solids[number][:4]])
    start, end = (corner[0] + corner[1]) / 2, (corner[3] + corner[2]) / 2
    length = np.linalg.norm(end - start)
    along, radius = (end - start) / length, (start[0] + end[0]) / 2
    return PlyStrip(
        number,
        (float(along[0]), float(along[1])),
        float(radius),
        float(_moment(corner) / (length * radius)),
    )


def _moment(corner: Array) -> float:
    """Integral of r, m3, over a quadrilateral of corners (4, 2): its volume per radian."""
    total = 0.0
    for a, b, c in (corner[[0, 1, 2]], corner[[0, 2, 3]]):
        (p, q), (s, t) = b - a, c - a
        total += (p * t - q * s) / 2 * (a[0] + b[0] + c[0]) / 3
    return abs(total)


def _extruded(mesh: SectionMesh, angle: float, quadratic: bool) -> dict[str, Any]:
    """The other fields of `Sector`, its nodes numbered without gaps from 1; ``angle`` in rad."""
    points: dict[Corner, tuple[float, float]] = {(n,): rz for n, rz in mesh.nodes.items()}
    sides: dict[int, list[Corner]] = {number: [] for number in mesh.solids}
    for number, corners in mesh.solids.items():
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True) if quadratic else ():
            (r, z), (s, y) = mesh.nodes[a], mesh.nodes[b]
            sides[number].append((min(a, b), max(a, b)))
            points[sides[number][-1]] = (r + s) / 2, (z + y) / 2
    corner_points: list[Corner] = [p for p in points if len(p) == 1]
    front = {p: k for k, p in enumerate(points, start=1)}
    behind = {p: len(points) + k for p, k in front.items()}
    between = {p: 2 * len(points) + k for k, p in enumerate(corner_points, start=1)}
    planes: list[tuple[dict[Corner, int], float]] = [
        (front, 0.0),
        (behind, -angle),
        (between, -angle / 2),
    ]
    nodes = []
    for plane, turn in planes if quadratic else planes[:2]:
        for p, k in plane.items():
            r, z = points[p]
            nodes.append((k, r * math.cos(turn), r * math.sin(turn), z))
    bricks = {}
    for number, corners in mesh.solids.items():
        around = [(n,) for n in corners]
        flat = [
            plane[p] for part in (around, sides[number]) for plane in (front, behind) for p in part
        ]
        bricks[number] = (*flat, *(between[p] for p in around if quadratic))
    rim = {p for p in points if set(p) <= set(mesh.rim)}
    held = [front[p] for p in points if p in rim]
    held += [between[p] for p in corner_points if p in rim and quadratic]
    return {
        "nodes": nodes,
        "bricks": bricks,
        "regions": {number: region for number, (region, _) in mesh.cells.items()},
        "section": list(front.values()),
        "behind": list(behind.values()),
        "between": [(k, front[p]) for p, k in between.items() if quadratic and p not in rim],
        "rim": held,
        "inner": mesh.inner,
    }


def interleaved(outer: list[Any], inner: list[Any]) -> list[Any]:
    """a, x, b, y, c from (a, b, c) and (x, y)."""
    return [outer[0], *(item for pair in zip(inner, outer[1:], strict=True) for item in pair)]
