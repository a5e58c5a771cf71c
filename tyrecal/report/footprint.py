"""The pressed tyre drawn: pressure in the patch at each load, what it comes to over the load;
and static stiffnesses over the load, one curve for each design and pressure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from ..studies.footprint import FootprintResult, FootprintRow
from ..studies.stiffness import StiffnessResult, StiffnessRow
from .figure import COLOUR_MAP, COLOURS, GREY, headline, in_house_style, new_figure
from .shape_data import PatchData

MAX_BANDS = 12  # of colour
MAX_COLUMNS = 4  # patches next to each other
MARGIN = 10.0  # mm round the largest patch
DESIGN_STYLES: dict[str, dict[str, Any]] = {
    "initial": {"ls": (0, (4, 2)), "marker": "o", "mfc": "white"},
    "fitted": {"ls": "-", "marker": "s"},
}
CURVES = {  # key of a row: words with the unit, factor from SI to it
    "area_m2": ("contact area, cm²", 1e4),
    "deflection_m": ("deflection, mm", 1e3),
    "vertical_stiffness_N_per_m": ("vertical stiffness, N/mm", 1e-3),
    "mean_pressure_Pa": ("mean contact pressure, kPa", 1e-3),
}


def draw_footprint(rows: Sequence[FootprintRow], patches: Sequence[PatchData]) -> dict[str, Figure]:
    """Figures by name: footprint and, all in one scale, footprint_DESIGN."""
    highest = max(row.peak_pressure_Pa for row in rows) / 1e3
    figures = {"footprint": draw_curves(rows)}
    for design in dict.fromkeys(patch.design for patch in patches):
        own = [patch for patch in patches if patch.design == design]
        figures[f"footprint_{design}"] = draw_patches(own, highest)
    return figures


def figures(result: FootprintResult) -> dict[str, Figure]:
    """The curves of the rows; the pressure in the patch is in another file."""
    return {"footprint": draw_curves(result.rows)}


@in_house_style
def draw_patches(patches: Sequence[PatchData], highest_kPa: float) -> Figure:
    """One design's contact pressure, a patch a load, all at one scale, rolling direction upwards.

    highest_kPa: upper end of the colours; dots: nodes that touch. The colours end at the patch's
    edge, so that a patch is drawn as long and as wide as its table says.
    """
    edges = [patch_edge(patch) for patch in patches]
    halves = np.max([np.abs(edge.vertices).max(axis=0) for edge in edges], axis=0)
    width, length = 2 * (halves + MARGIN)
    columns = min(MAX_COLUMNS, len(patches))
    lines = -(-len(patches) // columns)
    inch = min(2.4, 9.0 / columns) / width
    size = 1.4 + columns * (inch * width + 0.25), 0.9 + lines * (inch * length + 0.35)
    words = f"Contact pressure at each load, {patches[0].design} tyre; dots: nodes in contact"
    figure = new_figure(*size, caption=words)
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    levels = MaxNLocator(MAX_BANDS).tick_values(0.0, highest_kPa)
    for axes in grid.flat[len(patches) :]:
        axes.set_axis_off()
    for axes, patch, edge in zip(grid.flat, patches, edges, strict=False):
        x, y, p = np.array([patch.across_mm, patch.along_mm, patch.pressure_kPa])
        bands = axes.contourf(x, y, p, levels, cmap=COLOUR_MAP)
        bands.set_clip_path(edge, axes.transData)
        axes.add_patch(PathPatch(edge, fc="none", ec=GREY, lw=0.6))
        inside = edge.contains_points(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
        axes.plot(x[inside], y[inside], ".", color="k", ms=1.2, alpha=0.5)
        axes.set_title(f"{patch.load_N:g} N", loc="left", fontsize=9)
        axes.set(xlim=(-width / 2, width / 2), ylim=(-length / 2, length / 2), aspect="equal")
    for axes in grid.flat[max(0, len(patches) - columns) : len(patches)]:  # the lowest of a column
        axes.set_xlabel("across, mm")
        axes.tick_params(labelbottom=True)
    for axes in grid[:, 0]:
        axes.set_ylabel("along, mm")
    figure.colorbar(
        bands,
        ax=list(grid.flat),
        shrink=0.8,
        ticks=levels,
        format="%.0f",
        label="contact pressure, kPa",
    )
    headline(figure, f"{patches[0].design}: contact pressure at each load; dots: nodes in contact")
    return figure


def patch_edge(patch: PatchData) -> Path:
    """The closed lines round what touches, across and along in mm."""
    return Path.make_compound_path(*(Path(np.reshape(line, (-1, 2))) for line in patch.edge_mm))


@in_house_style
def draw_curves(rows: Sequence[FootprintRow]) -> Figure:
    """Area, deflection, stiffness and mean pressure over the load, every design of the rows."""
    words = "Contact area, deflection, vertical stiffness and mean contact pressure over the load"
    figure = new_figure(8.6, 6.2, caption=words)
    grid = figure.subplots(2, 2).ravel()
    for colour, design in zip(COLOURS, dict.fromkeys(row.design for row in rows), strict=False):
        own = [row for row in rows if row.design == design]
        load = [row.load_N / 1e3 for row in own]
        style: dict[str, Any] = {"color": colour, "label": design, "ms": 4.5, "lw": 1.4}
        style |= DESIGN_STYLES.get(design, {})
        for axes, (key, (_, unit)) in zip(grid, CURVES.items(), strict=True):
            axes.plot(load, [unit * getattr(row, key) for row in own], **style)
    for axes, (words, _) in zip(grid, CURVES.values(), strict=True):
        top = 1.05 * axes.dataLim.ymax  # of one load or of equal designs no mark is cut
        axes.set(xlabel="load, kN", ylabel=words, xlim=(0, None), ylim=(0, top))
        axes.grid(True, color="0.92", lw=0.6)
        axes.tick_params(color=GREY)
    grid[0].legend(frameon=False, loc="upper left")
    return figure


STIFFNESSES = [key for key in StiffnessRow.columns() if "_per_" in key]


def stiffness_figures(result: StiffnessResult) -> dict[str, Figure]:
    """The figure of a result by its name; none without rows."""
    return {"stiffness": draw_stiffness(result.rows)} if result.rows else {}


@in_house_style
def draw_stiffness(rows: Sequence[StiffnessRow]) -> Figure:
    """Vertical, lateral, longitudinal and torsional stiffness over the load. A pressure has a
    colour, a design a line style."""
    figure = new_figure(8.6, 6.2, caption="Static stiffnesses over the load")
    grid = figure.subplots(2, 2).ravel()
    pressures = sorted({row.pressure_kPa for row in rows})
    states = dict.fromkeys((row.design, row.pressure_kPa) for row in rows)
    for design, kPa in states:
        own = [row for row in rows if (row.design, row.pressure_kPa) == (design, kPa)]
        style = {"color": COLOURS[pressures.index(kPa) % len(COLOURS)], "ms": 4.5, "lw": 1.4}
        style |= DESIGN_STYLES.get(design, {}) | {"label": f"{design}, {kPa:g} kPa"}
        for axes, key in zip(grid, STIFFNESSES, strict=True):
            scale = StiffnessRow.columns()[key].per_unit  # from SI to the unit of the axis
            load = [row.load_N / 1e3 for row in own]
            axes.plot(load, [scale * getattr(row, key) for row in own], **style)
    for axes, key in zip(grid, STIFFNESSES, strict=True):
        top = 1.05 * axes.dataLim.ymax
        words = StiffnessRow.columns()[key].name.replace(" N", " stiffness, N")
        axes.set(xlabel="load, kN", ylabel=words, xlim=(0, None), ylim=(0, top))
        axes.grid(True, color="0.92", lw=0.6)
        axes.tick_params(color=GREY)
    grid[0].legend(frameon=False, loc="lower right")
    return figure
