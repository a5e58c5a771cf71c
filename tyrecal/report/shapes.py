"""Mode shapes as pictures, from four sides like Figure 3 of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from ..simulate.modes.mode import Mode
from ..tyre.section.mesh import SectionMesh
from .figure import COLOURS, in_house_style, new_figure, save
from .revolve import motion, skin, swept

Array = np.ndarray

ANGLES = 72
MAX_MOTION = 0.12  # displacement in the picture over the tyre's radius
NEARER = 0.03  # of the radius: bold lines over the surface that they lie on
VIEW = 1.15  # half a view's width over the tyre's radius
COLOUR_MAP = colormaps["viridis"]
PERSPECTIVE = (22.0, -55.0)


@in_house_style
def draw_mode(path: Path, mode: Mode, mesh: SectionMesh, scale: float | None = None) -> None:
    """Draw a mode from the front (along the axle), the side, above, and in perspective.

    scale: m in the picture per unit of the shape; by default the largest motion is drawn as 12 %
    of the radius. Raises InputError.
    """
    surface = _surface(mode, mesh, scale)
    figure = new_figure(9.2, 5.7, None)
    for name, x, y, half, below, elevation, azimuth in (
        ("top", 1.9, 4.55, 1.85, 0.95, 90, -90),
        ("front, along the axle", 1.9, 1.8, 1.85, 1.68, 0, -90),
        ("side", 4.3, 1.8, 1.85, 1.68, 0, 0),
        ("perspective", 7.1, 3.1, 2.3, 2.12, *PERSPECTIVE),
    ):
        _view(figure, surface, (x, y), half, elevation, azimuth)
        figure.text(x / 9.2, (y - below) / 5.7, name, ha="center", va="center", color="0.3")
    figure.suptitle(title(mode), x=0.5)
    _key(figure, [mode], (5.6, 5.2))
    save(figure, path)


@in_house_style
def draw_modes_overview(path: Path, modes: Sequence[Mode], mesh: SectionMesh) -> None:
    """Draw up to nine modes, lowest first, in perspective on one sheet. Raises InputError."""
    lowest = sorted(modes, key=lambda mode: mode.frequency_Hz)[:9]
    height = 0.9 + 3.2 * -(-len(lowest) // 3)
    figure = new_figure(9.0, height, None)
    for k, mode in enumerate(lowest):
        x, y = 1.5 + 3 * (k % 3), height - 1.8 - 3.2 * (k // 3)
        _view(figure, _surface(mode, mesh, None), (x, y), 1.45, *PERSPECTIVE)
        figure.text(x / 9.0, (y + 1.38) / height, title(mode).replace(" - ", "\n"), ha="center")
    _key(figure, lowest, (0.3, 0.3))
    save(figure, path)


def _key(figure: Figure, modes: Sequence[Mode], words_at: tuple[float, float]) -> None:
    """What the colours are, at the foot, and the lines, at inches from the lower left corner."""
    width, height = figure.get_size_inches()
    bar = figure.add_axes((5.9 / width, 0.3 / height, 2.4 / width, 0.08 / height))
    figure.colorbar(
        ScalarMappable(cmap=COLOUR_MAP), bar, orientation="horizontal", ticks=[0, 0.5, 1]
    )
    bar.set_title("displacement over the largest", fontsize=8, color="0.3")
    bar.tick_params(labelsize=8)
    words = ["grey: outline at rest"]
    if any(_twists(mode) for mode in modes):
        words.append("orange: meridians at rest")
    x, y = words_at
    figure.text(x / width, y / height, "; ".join(words), fontsize=8, color="0.3")


def _twists(mode: Mode) -> bool:
    """Whether the tyre turns about its axle, so that its outline stays where it is."""
    return mode.label.kind == "torsional"


@dataclass(frozen=True)
class _Surface:
    """rest, moved (k, angle, 3); share (k, angle): of the largest displacement; twists: the
    meridians at rest are drawn."""

    rest: Array
    moved: Array
    share: Array
    twists: bool = False


def _surface(mode: Mode, mesh: SectionMesh, scale: float | None) -> _Surface:
    nodes = skin(mesh)
    angles = 2 * np.pi * np.arange(ANGLES + 1) / ANGLES
    rest = swept(nodes, mesh, angles)
    u = motion(mode.raw, nodes, angles)
    if mode.label.c:
        # of all members of the pair the one whose crest stands at the top, out of Theta's direction
        quarter = motion(mode.raw, nodes, angles, np.pi / 2)
        top = 3 * ANGLES // 4
        a, b = u[:, top, 1:], quarter[:, top, 1:]
        k = np.argmax((a**2 + b**2).sum(-1))
        phase = np.arctan2(2 * a[k] @ b[k], a[k] @ a[k] - b[k] @ b[k]) / 2
        u = np.cos(phase) * u + np.sin(phase) * quarter
    size = np.linalg.norm(u, axis=-1)
    scale = MAX_MOTION * np.abs(rest).max() / size.max() if scale is None else scale
    return _Surface(rest, rest + scale * u, size / size.max(), _twists(mode))


def title(mode: Mode) -> str:
    """Label, frequency and words: '[2,1] 66.1 Hz: first out-of-plane bending'."""
    label = mode.label
    return f"[{label.c},{label.m}] {mode.frequency_Hz:.1f} Hz: {label.motion}"


def _view(
    figure: Figure,
    surface: _Surface,
    centre: tuple[float, float],
    half: float,
    elevation: float,
    azimuth: float,
) -> None:
    """One orthographic view, ``half`` inches to each side of ``centre``."""
    width, height = figure.get_size_inches()
    x, y = centre
    place = ((x - half) / width, (y - half) / height, 2 * half / width, 2 * half / height)
    axes = figure.add_axes(place, projection="3d", computed_zorder=False)
    assert isinstance(axes, Axes3D)
    axes.set_axis_off()
    axes.patch.set_alpha(0)
    axes.set_proj_type("ortho")
    axes.view_init(elevation, azimuth)
    reach = VIEW * np.abs(surface.rest).max()
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach))
    axes.set_box_aspect((1, 1, 1), zoom=1.5)
    axes.add_collection3d(_faces(surface, elevation, azimuth))
    axes.add_collection3d(_outline(surface.rest, elevation, azimuth))


def _viewer(elevation: float, azimuth: float) -> Array:
    """Unit vector towards the viewer."""
    up, round_ = np.radians([elevation, azimuth])
    return np.array([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)])


def _faces(surface: _Surface, elevation: float, azimuth: float) -> Poly3DCollection:
    p, share = surface.moved, surface.share
    quads = np.stack([p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]], 2).reshape(-1, 4, 3)
    mean = (share[:-1, :-1] + share[1:, :-1] + share[1:, 1:] + share[:-1, 1:]).ravel() / 4
    # meridians in bold, as faces without area so that nearer faces hide them: they show a twist;
    # towards the viewer by a little, which moves nothing in the picture, so that their own do not
    nearer = NEARER * np.abs(surface.rest).max() * _viewer(elevation, azimuth)
    lines = []
    for points in (p, surface.rest) if surface.twists else (p,):
        bold = points[:, : -1 : ANGLES // 12] + nearer
        lines.append(np.stack([bold[:-1], bold[1:], bold[1:], bold[:-1]], 2).reshape(-1, 4, 3))
    kinds = np.repeat(np.arange(1 + len(lines)), [len(quads), *map(len, lines)])
    edges = np.array([(0, 0, 0, 0.12), (0, 0, 0, 1), to_rgba(COLOURS[1])])
    return Poly3DCollection(
        np.concatenate([quads, *lines]),
        facecolors=COLOUR_MAP(np.append(mean, np.zeros(len(kinds) - len(quads)))),
        edgecolors=edges[kinds],
        linewidths=0.6,
    )


def _outline(rest: Array, elevation: float, azimuth: float) -> Line3DCollection:
    """The tyre at rest in silhouette: edges between faces turned to the viewer and away.

    Only outside the widest points: nearer the rim such edges are hidden or do not move.
    """
    widest = np.sort([np.argmin(rest[:, 0, 1]), np.argmax(rest[:, 0, 1])])
    rest = rest[max(widest[0] - 1, 0) : widest[1] + 2]
    viewer = _viewer(elevation, azimuth)
    along, around = rest[1:, :-1] - rest[:-1, :-1], rest[:-1, 1:] - rest[:-1, :-1]
    towards = np.cross(along, around) @ viewer > 0
    rings = np.argwhere(towards[1:] != towards[:-1])
    meridians = np.argwhere(towards != np.roll(towards, 1, axis=1))
    edges = [(rest[i + 1, j], rest[i + 1, j + 1]) for i, j in rings]
    edges += [(rest[i, j], rest[i + 1, j]) for i, j in meridians]
    return Line3DCollection(edges, colors="0.35", lw=0.8)
