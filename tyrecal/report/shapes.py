"""Mode shapes on one sheet, in perspective."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import Collection, LineCollection, TriMesh
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from ..simulate.modes.label import Mode
from ..tyre.section.mesh import SectionMesh
from .figure import COLOUR_MAP, COLOURS, in_house_style, new_figure, save
from .revolve import motion, swept

Array = np.ndarray

ANGLES = 72  # steps round the tyre
MAX_MERIDIAN_POINTS = 33  # more are not seen
MAX_IN_OVERVIEW = 12  # modes
MAX_MOTION = 0.12  # displacement in the picture over the tyre's radius
LINE_WIDTH = 0.009  # inches: meridians in bold
NEARER = 0.1  # inches: these, to the viewer, so that only other parts of the tyre hide them
VIEW, HALF = 1.3, 1.45  # half a view's width: over the tyre's radius, and in inches
# of the viewer: above the plane of x and y (y: axle), and in it from x towards y
ELEVATION, AZIMUTH = np.radians([22.0, -55.0])


@in_house_style
def draw_modes_overview(path: Path, modes: Sequence[Mode], mesh: SectionMesh) -> None:
    """Draw the `MAX_IN_OVERVIEW` lowest modes in perspective on one sheet. Raises InputError."""
    lowest = sorted(modes, key=lambda mode: mode.frequency_Hz)[:MAX_IN_OVERVIEW]
    height = 0.9 + 3.2 * -(-len(lowest) // 3)
    sheet = _Sheet(new_figure(9.0, height, None))
    for k, mode in enumerate(lowest):
        x, y = 1.5 + 3 * (k % 3), height - 1.8 - 3.2 * (k // 3)
        _view(sheet, _surface(mode, mesh), (x, y))
        sheet.text(x, y + 1.38, title(mode).replace(" - ", "\n"), ha="center")
    left_out = len(modes) - len(lowest)
    words = f"; the {len(lowest)} lowest of {len(modes)} modes" if left_out else ""
    _key(sheet, lowest, (0.3, 0.3), words)
    save(sheet.figure, path)


@dataclass(frozen=True)
class _Sheet:
    """A figure without axes, which cost more than faces: all in inches from its lower left."""

    figure: Figure

    def add(self, collection: Collection) -> None:
        collection.set_transform(self.figure.dpi_scale_trans)
        collection.set_rasterized(isinstance(collection, TriMesh))  # of SVG and PDF: small files
        self.figure.add_artist(collection)

    def text(self, x: float, y: float, words: str, **look: Any) -> None:
        self.figure.text(x, y, words, transform=self.figure.dpi_scale_trans, **look)


def _key(
    sheet: _Sheet, modes: Sequence[Mode], words_at: tuple[float, float], more: str = ""
) -> None:
    """Draw the key of the colours at the foot of the sheet, and at ``words_at`` (x, y), in inches
    from its lower left corner, what the lines mean."""
    left, right, low, high = 5.9, 8.3, 0.3, 0.38
    shades = np.linspace(0, 1, 65)
    x, y = np.meshgrid(left + shades * (right - left), [low, high])
    cells = np.arange(64)[:, None] + [0, 1, 66, 65]  # corners in two rows of 65 points
    colours = COLOUR_MAP(np.tile(shades, 2))
    sheet.add(TriMesh(Triangulation(x.ravel(), y.ravel(), _halves(cells)), facecolors=colours))
    words: dict[str, Any] = {"fontsize": 8, "color": "0.3"}
    for share in (0, 0.5, 1):
        at = left + share * (right - left)
        sheet.text(at, low - 0.04, f"{share:g}", ha="center", va="top", **words)
    middle = (left + right) / 2
    sheet.text(middle, high + 0.06, "displacement over the largest", ha="center", **words)
    lines = ["grey: outline at rest"]
    if any(_twists(mode) for mode in modes):
        lines.append("orange: meridians at rest")
    sheet.text(*words_at, "; ".join(lines) + more, **words)


def _twists(mode: Mode) -> bool:
    """Whether the tyre turns about its axle, so that its outline stays where it is."""
    return mode.label.kind == "torsional"


@dataclass(frozen=True)
class _Surface:
    """The tyre's outer surface at rest and in a mode: x, y, z in m, or a view of it in inches."""

    rest: Array  # (k, angle, 3)
    moved: Array  # (k, angle, 3)
    share: Array  # (k, angle) of the largest displacement
    twists: bool  # the meridians at rest are drawn
    sides: tuple[int, int]  # rows of the widest points


def _drawn(mesh: SectionMesh) -> Array:
    """The nodes (k,) of a drawn meridian: of the outer surface, its ends among them."""
    nodes = mesh.skin()
    count = min(len(nodes), MAX_MERIDIAN_POINTS)
    return nodes[np.linspace(0, len(nodes) - 1, count).round().astype(int)]


def _surface(mode: Mode, mesh: SectionMesh) -> _Surface:
    """The outer surface at rest and moved by a mode; of a pair, the member with its crest at the
    top."""
    nodes = _drawn(mesh)
    angles = 2 * np.pi * np.arange(ANGLES + 1) / ANGLES
    rest = swept(nodes, mesh, angles)
    u = motion(mode.raw, nodes, angles)
    if mode.label.c:
        # of all members of the pair the one whose crest stands at the top, out of Theta's direction
        quarter = motion(mode.raw, nodes, angles, np.pi / 2)
        top = 3 * ANGLES // 4  # z = -R sin Theta is largest
        a, b = u[:, top, 1:], quarter[:, top, 1:]
        k = np.argmax((a**2 + b**2).sum(-1))
        phase = np.arctan2(2 * a[k] @ b[k], a[k] @ a[k] - b[k] @ b[k]) / 2
        u = np.cos(phase) * u + np.sin(phase) * quarter
    size = np.linalg.norm(u, axis=-1)
    scale = MAX_MOTION * np.abs(rest).max() / size.max()
    sides = int(np.argmin(rest[:, 0, 1])), int(np.argmax(rest[:, 0, 1]))
    return _Surface(rest, rest + scale * u, size / size.max(), _twists(mode), sides)


def title(mode: Mode) -> str:
    """Label, frequency and words: '[2,1] 66.1 Hz: first out-of-plane bending'."""
    label = mode.label
    return f"[{label.c},{label.m}] {mode.frequency_Hz:.1f} Hz: {label.motion}"


def _view(sheet: _Sheet, surface: _Surface, centre: tuple[float, float]) -> None:
    """One orthographic view, `HALF` inches to each side of ``centre``."""
    right = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0])
    out = np.array([np.cos(AZIMUTH), np.sin(AZIMUTH), 0])
    viewer = np.cos(ELEVATION) * out + np.sin(ELEVATION) * np.array([0, 0, 1])
    inches = HALF / VIEW / np.abs(surface.rest).max()
    screen = inches * np.stack([right, np.cross(viewer, right), viewer], -1)
    rest, moved = (points @ screen + [*centre, 0] for points in (surface.rest, surface.moved))
    seen = replace(surface, rest=rest, moved=moved)
    sheet.add(_faces(seen))
    sheet.add(_outline(seen))


def _faces(seen: _Surface) -> TriMesh:
    """A surface on the screen (right, upwards, towards the viewer), its meridians in bold, as they
    show a twist; the farthest triangles first."""
    rows, columns = seen.share.shape
    node = np.arange(rows * columns).reshape(rows, columns)
    quads = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], -1)
    points, triangles = [seen.moved.reshape(-1, 3)], [_halves(quads)]
    colours = [COLOUR_MAP(seen.share.ravel())]
    for line, colour in ((seen.moved, "black"), (seen.rest, COLOURS[1]))[: 1 + seen.twists]:
        corners = _strips(line[:, : -1 : ANGLES // 12])
        first = sum(map(len, points))
        points.append(corners)
        triangles.append(_halves(first + np.arange(len(corners)).reshape(-1, 4)))
        colours.append(np.tile(to_rgba(colour), (len(corners), 1)))
    x, y, depth = np.concatenate(points).T
    faces = np.concatenate(triangles)
    order = np.argsort(depth[faces].mean(1), kind="stable")
    return TriMesh(Triangulation(x, y, faces[order]), facecolors=np.concatenate(colours))


def _halves(quads: Array) -> Array:
    """Two triangles for each of ``quads`` (..., 4)."""
    flat = quads.reshape(-1, 4)
    return np.concatenate([flat[:, [0, 1, 2]], flat[:, [0, 2, 3]]])


def _strips(lines: Array) -> Array:
    """Corners (4 a segment, 3) of strips along ``lines`` (point, line, 3)."""
    start, end = lines[:-1].reshape(-1, 3), lines[1:].reshape(-1, 3)
    right, up = (end - start)[:, :2].T
    across = np.stack([-up, right, np.zeros(len(start))], -1)
    across *= LINE_WIDTH / 2 / np.maximum(np.hypot(right, up), LINE_WIDTH)[:, None]
    corners = np.stack([start - across, start + across, end + across, end - across], 1)
    return corners.reshape(-1, 3) + np.array([0, 0, NEARER])


def _towards(points: Array) -> Array:
    """Whether each face (k, angle) between ``points`` on the screen is turned to the viewer."""
    along, around = points[1:, :-1] - points[:-1, :-1], points[:-1, 1:] - points[:-1, :-1]
    turned: Array = along[..., 0] * around[..., 1] < along[..., 1] * around[..., 0]
    return turned


def _outline(seen: _Surface) -> LineCollection:
    """The tyre at rest in silhouette: edges between faces turned to the viewer and away.

    Only outside the widest points: nearer the rim such edges are hidden or do not move.
    """
    first, last = sorted(seen.sides)
    rest = seen.rest[max(first - 1, 0) : last + 2]
    towards = _towards(rest)
    rings = np.argwhere(towards[1:] != towards[:-1])
    meridians = np.argwhere(towards != np.roll(towards, 1, axis=1))
    edges = [(rest[i + 1, j, :2], rest[i + 1, j + 1, :2]) for i, j in rings]
    edges += [(rest[i, j, :2], rest[i + 1, j, :2]) for i, j in meridians]
    return LineCollection(edges, colors="0.35", lw=0.8)
