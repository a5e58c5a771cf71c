"""The pressed tyre drawn: pressure in the patch at each load, area and deflection over load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.ticker import MaxNLocator

from ..evaluate.pressed import Pressed
from ..studies.patch import Patch, patch_of
from ..tyre.mesh import SectionMesh
from .figure import COLOURS, GREY, headline, in_house_style, new_figure, save
from .vtu import write_pressed_vtu

COLOUR_MAP = colormaps["viridis"]
BANDS = 12  # of colour, at most
COLUMNS = 4
MARGIN = 10.0  # mm round the nodes next to the largest patch
STYLES: dict[str, dict[str, Any]] = {
    "initial": {"ls": (0, (4, 2)), "marker": "o", "mfc": "white"},
    "fitted": {"ls": "-", "marker": "s"},
}


def draw_footprint(
    folder: Path,
    designs: Mapping[str, Pressed],
    meshes: Mapping[str, SectionMesh],
    rows: Sequence[Mapping[str, Any]],
) -> None:
    """footprint.png, footprint_DESIGN.png, all in one scale, and footprint_DESIGN_LOADN.vtu."""
    draw_curves(folder / "footprint.png", rows)
    highest = max(row["peak_pressure_Pa"] for row in rows)
    for name, pressed in designs.items():
        patches = {x.load_N: patch_of(pressed, x, meshes[name]) for x in pressed.footprints}
        draw_patches(folder / f"footprint_{name}.png", name, patches, highest)
        for footprint in pressed.footprints:
            path = folder / f"footprint_{name}_{footprint.load_N:g}N.vtu"
            write_pressed_vtu(path, pressed, footprint, meshes[name])


@in_house_style
def draw_patches(path: Path, title: str, patches: Mapping[float, Patch], highest_Pa: float) -> None:
    """Draw the contact pressure, a patch a load (N), all at one scale, rolling direction upwards.

    highest_Pa: upper end of the colours; dots: nodes that touch.
    """
    halves = [1e3 * np.array(_reach(patch)) for patch in patches.values()]
    width, length = 2 * (np.max(halves, axis=0) + MARGIN)
    columns = min(COLUMNS, len(patches))
    lines = -(-len(patches) // columns)
    inch = min(2.4, 9.0 / columns) / width
    figure = new_figure(1.4 + columns * (inch * width + 0.25), 0.9 + lines * (inch * length + 0.35))
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    levels = np.array(MaxNLocator(BANDS).tick_values(0.0, highest_Pa / 1e3))
    levels[0] = 1e-6 * levels[-1]  # where nothing touches stays white
    for axes in grid.flat[len(patches) :]:
        axes.set_axis_off()
    for axes, (load, patch) in zip(grid.flat, patches.items(), strict=False):
        x, y = 1e3 * patch.across, 1e3 * patch.along
        bands = axes.contourf(x, y, patch.pressure / 1e3, levels, cmap=COLOUR_MAP)
        axes.plot(x[patch.touches], y[patch.touches], ".", color="k", ms=1.2, alpha=0.5)
        axes.set_title(f"{load:g} N", loc="left", fontsize=9)
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
    headline(figure, f"{title}: contact pressure at each load; dots: nodes that touch")
    save(figure, path)


def _reach(patch: Patch) -> tuple[float, float]:
    """Half the width and half the length, m, to the nodes beside those that touch, where the
    pressure is 0."""
    near = patch.touches.copy()
    near[1:] |= patch.touches[:-1]
    near[:-1] |= patch.touches[1:]
    near[:, 1:] |= patch.touches[:, :-1]
    near[:, :-1] |= patch.touches[:, 1:]
    return float(abs(patch.across[near]).max()), float(abs(patch.along[near]).max())


@in_house_style
def draw_curves(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Draw contact area and deflection over the load, every design of the rows in one plot."""
    figure = new_figure(8.6, 3.6)
    left, right = figure.subplots(1, 2)
    for colour, design in zip(COLOURS, dict.fromkeys(row["design"] for row in rows), strict=False):
        own = [row for row in rows if row["design"] == design]
        load = [row["load_N"] / 1e3 for row in own]
        style: dict[str, Any] = {"color": colour, "label": design, "ms": 4.5, "lw": 1.4}
        style |= STYLES.get(design, {})
        left.plot(load, [1e4 * row["area_m2"] for row in own], **style)
        right.plot(load, [1e3 * row["deflection_m"] for row in own], **style)
    for axes, what in ((left, "contact area, cm²"), (right, "deflection, mm")):
        top = 1.05 * axes.dataLim.ymax  # of one load or of equal designs no mark is cut
        axes.set(xlabel="load, kN", ylabel=what, xlim=(0, None), ylim=(0, top))
        axes.grid(True, color="0.92", lw=0.6)
        axes.tick_params(color=GREY)
    left.legend(frameon=False, loc="upper left")
    save(figure, path)
