"""Mode shapes as pictures, from four sides like Figure 3 of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from ..modes.mode import Mode
from ..tyre.mesh import SectionMesh
from .figure import in_house_style, new_figure, save
from .revolve import motion, skin, swept
from .words import motion as words

Array = np.ndarray

ANGLES = 72
LARGEST = 0.12  # displacement in the picture over the tyre's radius
VIEW = 1.15  # half a view's width over the tyre's radius
PERSPECTIVE = (22.0, -55.0)


@in_house_style
def draw_mode(path: Path, mode: Mode, mesh: SectionMesh, scale: float | None = None) -> None:
    """Draw a mode from the front (along the axle), the side, above, and in perspective.

    scale: m in the picture per unit of the shape; by default the largest motion is drawn as 12 %
    of the radius. Raises NoSectionShape.
    """
    surface = _surface(mode, mesh, scale)
    figure = new_figure(9.6, 5.2, None)
    for name, x, y, size, elevation, azimuth in (
        ("front, along the axle", 2.0, 1.95, 3.4, 0, -90),
        ("top", 2.0, 4.15, 3.4, 90, -90),
        ("side", 4.2, 1.95, 3.4, 0, 0),
        ("perspective", 7.4, 2.4, 4.3, *PERSPECTIVE),
    ):
        _view(figure, surface, (x, y), size, elevation, azimuth)
    figure.suptitle(_title(mode))
    save(figure, path)


@dataclass(frozen=True)
class _Surface:
    """rest, moved (k, angle, 3); share (k, angle): of the largest displacement."""

    rest: Array
    moved: Array
    share: Array


def _surface(mode: Mode, mesh: SectionMesh, scale: float | None) -> _Surface:
    nodes = skin(mesh)
    angles = 2 * np.pi * np.arange(ANGLES + 1) / ANGLES
    rest = swept(nodes, mesh, angles)
    u = motion(mode.raw, nodes, angles)
    if mode.label.c:
        # the member of the pair that moves most at the top
        quarter = motion(mode.raw, nodes, angles, np.pi / 2)
        top = 3 * ANGLES // 4
        k = np.argmax((u[:, top] ** 2 + quarter[:, top] ** 2).sum(-1))
        phase = -np.arctan2(*(v[k, top] @ (u[k, top] + quarter[k, top]) for v in (quarter, u)))
        u = motion(mode.raw, nodes, angles, phase)
    size = np.linalg.norm(u, axis=-1)
    scale = LARGEST * np.abs(rest).max() / size.max() if scale is None else scale
    return _Surface(rest, rest + scale * u, size / size.max())


def _title(mode: Mode) -> str:
    label = mode.label
    return f"[{label.c},{label.m}] {mode.frequency_Hz:.1f} Hz - {words(label.c, label.m, label.kind)}"
