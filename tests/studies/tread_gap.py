"""The tread beside the road: how deep it has sunk in, and the patch's area told by the gap, alike
for CalculiX's results and the bundled solver's.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from scipy.integrate import trapezoid
from tyrecal_solvers.calculix.results import read_fields

from tyrecal.simulate.evaluate.pressed import Footprint, Pressed

from ..solvers.press_deck import OUTER_NODES, read_press

Array = np.ndarray
GAUSS = np.polynomial.legendre.leggauss(3)
FINE = (np.arange(60) + 0.5) / 30 - 1, np.full(60, 1 / 30)
CROWN_M = 0.09  # half of what can touch, from the middle


def sunk_in(folder: Path, stiffness: float) -> list[float]:
    """Per deflection, how deep (m) the tread has sunk in that CalculiX does not yet count.

    The overclosure's mean over the faces' 3 x 3 Gauss points less force / (stiffness area).
    """
    kept = []
    for row, (_, over, area) in zip(read_press(folder), on_faces(folder, *GAUSS), strict=True):
        touching = over > 0
        whole = 2 * area[touching].sum()
        mean = 2 * (over * area)[touching].sum() / whole
        kept.append(float(mean - row.force_N / (stiffness * whole)))
    return kept


def on_faces(folder: Path, places: Array, weights: Array) -> list[tuple[Array, Array, Array]]:
    """Per deflection of a CalculiX run, at ``places`` (p,) by themselves of -1..1 of every face:
    where they are (face, p p, 3), their overclosure, m, and area, m2, by ``weights`` (p,)."""
    fields = read_fields(folder / "press.frd")
    place = {int(n): i for i, n in enumerate(fields.nodes)}
    faces = np.array([[place[n] for n in face] for face in tread_faces(folder)])
    N, by_a, by_b = serendipity(*(x.ravel() for x in np.meshgrid(places, places)))
    result = []
    for height, (_, _, moved) in zip(road_heights(folder), fields.blocks, strict=True):
        corners = (fields.points + moved)[faces]
        if faces.shape[1] == 4:
            corners = np.concatenate([corners, (corners + np.roll(corners, -1, 1)) / 2], 1)
        x = N @ corners
        area = np.linalg.norm(np.cross(by_a @ corners, by_b @ corners), axis=-1)
        result.append((x, x[..., 0] - height, area * np.outer(weights, weights).ravel()))
    return result


def areas_below(folder: Path, places: Array, weights: Array) -> list[float]:
    """Per deflection, area (m2) of what of the faces lies below the road, told at ``places``."""
    return [float(2 * area[over > 0].sum()) for _, over, area in on_faces(folder, places, weights)]


def area_of_gap(along: Array, across: Array, over: Array) -> float:
    """The patch's area (m2), its edge told by the gap beside it, alike for any solver and mesh.

    Places and overclosure (m) of the tread's nodes (ring from the patch's middle, node from the
    crown to one side); the patch is four such quarters, longest in its middle. Beyond the edge of
    a smooth contact the gap opens as distance^(3/2) (Johnson, Contact Mechanics, 4.2).
    """
    widths = [_edge(z, gap) for z, gap in zip(across, over, strict=True) if gap[0] > 0]
    y = along[: len(widths), 0]
    end = _edge(along[:, 0], over[:, 0])
    return float(4 * (trapezoid(widths, y) + 2 / 3 * widths[-1] * (end - y[-1])))


def _edge(place: Array, over: Array) -> float:
    """Place where a line's contact ends, between its last node that touches and the next;
    half-way if a coarse mesh has no two nodes beyond."""
    last = int(np.flatnonzero(over > 0)[-1])
    if last + 2 >= len(place):
        return float(place[last : last + 2].mean())
    one, other = -over[last + 1 : last + 3]
    growth = (other / max(one, 1e-12)) ** (2 / 3)
    step = place[last + 2] - place[last + 1]
    edge = place[last + 1] - step / (growth - 1) if growth > 1 else place[last + 1]
    return float(np.clip(edge, place[last], place[last + 1]))


def outside(pressed: Pressed, row: Footprint, side: int) -> tuple[Array, Array, Array]:
    """Rings of the crown's nodes on one ``side`` in the bundled solver: along, across,
    overclosure, m."""
    R, Z = pressed.points.T
    top = pressed.nodes % 1000 == (pressed.nodes % 1000).max()
    line = [i for i in np.argsort(side * Z) if top[i] and -1e-9 < side * Z[i] < CROWN_M]
    rings = np.flatnonzero(pressed.angles < np.radians(24.1))
    c, s = np.cos(pressed.angles[rings, None]), np.sin(pressed.angles[rings, None])
    u_r, u_theta, u_z = np.moveaxis(row.displacement[np.ix_(rings, line)], -1, 0)
    down = c * (R[line] + u_r) - s * u_theta
    along = s * (R[line] + u_r) + c * u_theta
    return along, side * (Z[line] + u_z), down - (pressed.free_radius_m - row.deflection_m)


def areas_of_gap(folder: Path) -> list[float]:
    """`area_of_gap` per deflection of a CalculiX run, of both sides' mean."""
    fields, heights = read_fields(folder / "press.frd"), road_heights(folder)
    used = np.isin(fields.nodes, np.unique(np.concatenate(tread_faces(folder))))
    X = fields.points[used]
    turn = np.round(np.degrees(-np.arctan2(X[:, 1], X[:, 0])), 2)
    areas = []
    for height, (_, _, moved) in zip(heights, fields.blocks, strict=True):
        sides = []
        for side in (1, -1):
            z = side * X[:, 2]
            rings = [
                [i for i in np.argsort(z) if turn[i] == angle and -1e-9 < z[i] < CROWN_M]
                for angle in np.unique(turn)
            ]
            full = [ring for ring in rings if len(ring) == len(rings[0])]
            x, y, w = np.moveaxis((X + moved[used])[full], -1, 0)
            sides.append(area_of_gap(-y, side * w, x - height))
        areas.append(float(np.mean(sides)))
    return areas


def road_heights(folder: Path) -> list[float]:
    """Height of the road (m) at each deflection of a CalculiX run."""
    text = (folder / "press.inp").read_text()
    road = float(re.findall(r"^\*NODE, NSET=ROAD\n\d+, (\S+),", text, re.M)[0])
    return [road + float(d) for d in re.findall(r"^\*\* deflection .*\n\S+, (\S+)$", text, re.M)]


def tread_faces(folder: Path) -> list[list[int]]:
    """Nodes of the faces that can touch, corners in turn, then those between them."""
    text = (folder / "wheel.inp").read_text()
    numbers = lambda lines: [int(n) for n in re.findall(r"\d+", lines)]
    tread = set(
        numbers(re.findall(r"^\*ELSET, ELSET=TREAD_ELEMENTS\n((?:\d.*\n)+)", text, re.M)[0])
    )
    turn = [OUTER_NODES[i] for i in (0, 1, 3, 2, 4, 7, 5, 6)]
    faces = []
    for kind, lines in re.findall(r"^\*ELEMENT, TYPE=(\w+),.*\n((?:\d.*\n| .*\n)+)", text, re.M):
        rows = np.reshape(numbers(lines), (-1, 9 if kind == "C3D8" else 21))
        faces += [
            [int(row[1 + i]) for i in turn if 1 + i < len(row)] for row in rows if row[0] in tread
        ]
    return faces


def serendipity(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """The eight functions (point, 8) of a face at a, b in -1..1, and their derivatives."""
    s, t = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    a, b = a[:, None], b[:, None]
    corner = (1 + s * a) * (1 + t * b) * (s * a + t * b - 1) / 4
    corner_a = s * (1 + t * b) * (2 * s * a + t * b) / 4
    corner_b = t * (1 + s * a) * (s * a + 2 * t * b) / 4
    A, B = 1 - a * a, 1 - b * b
    side = [A * (1 - b) / 2, (1 + a) * B / 2, A * (1 + b) / 2, (1 - a) * B / 2]
    side_a = [-a * (1 - b), B / 2, -a * (1 + b), -B / 2]
    side_b = [-A / 2, -b * (1 + a), A / 2, -b * (1 - a)]
    return tuple(
        np.concatenate([c, *e], 1)
        for c, e in ((corner, side), (corner_a, side_a), (corner_b, side_b))
    )  # type: ignore[return-value]
