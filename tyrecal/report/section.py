"""The section as a drawing."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..tyre.mesh import SectionMesh
from .figure import COLOURS, GREY, in_house_style, new_figure, save

if TYPE_CHECKING:
    from ..case import LoadedCase

Array = np.ndarray

RUBBER = ("#D9D9D9", "#BFD3E6", "#F3E0B5", "#C9B8A3", "#DCCBE3", "#C8E0C4")  # pale: cords stand out
DETAIL = 4.0  # magnification of the belt's edge


@in_house_style
def draw_section(
    path: Path,
    case: LoadedCase,
    mesh: SectionMesh,
    displacement: Mapping[int, Array] | None = None,
) -> None:
    """Draw rubber by region, elements, the cords of each rebar layer and what the rim holds.

    displacement: node number to (r, theta, z) of the inflation in m; draws the inflated outline.
    """
    drawing = _Drawing(case, mesh)
    figure = new_figure(9.0, 7.2)
    axes = figure.add_subplot()
    drawing.draw(axes, 1.0)
    if displacement is not None:
        drawing.inflated(axes, displacement)
    axes.set_aspect("equal")
    axes.set_xlabel("z (along the axle), mm")
    axes.set_ylabel("r, mm")
    axes.set_title(case.case.name)
    axes.margins(0.04)
    save(figure, path)
