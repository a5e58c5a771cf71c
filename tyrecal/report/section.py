"""The section as a drawing."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..effects import with_effects
from ..tyre.mesh import SectionMesh
from .figure import COLOURS, GREY, in_house_style, new_figure, save

if TYPE_CHECKING:
    from ..case import LoadedCase

Array = np.ndarray

RUBBER = ("#E3E3E3", "#C9DCEB", "#F5E6C0", "#D3C3B3", "#E2D3E8", "#CFE5CB")  # pale: cords stand out
LETTERS = 110  # of all columns of the legend
AXES_WIDTH, LINE, REST = 8.4, 0.2, 1.05  # inches: of the drawing, of a line of text, of all else
DETAIL = 4.0  # magnification of the belt's edge


@in_house_style
def draw_section(
    path: Path, case: LoadedCase, mesh: SectionMesh, displacement: Mapping[int, Array] | None = None
) -> None:
    """Draw rubber by region, elements, the cords of each layer and what the rim holds, in mm.

    The belt's edge is repeated four times as large. displacement: node number to (r, theta, z)
    of the inflation, m; with it the inflated outline is dashed, at true scale.
    """
    case = with_effects(case)
    place = {n: np.array([z, r]) * 1e3 for n, (r, z) in mesh.nodes.items()}
    around = outline(mesh)
    figure = new_figure(9.0, 8.0)
    axes = figure.add_subplot(aspect="equal", anchor="N")
    entries = _draw(axes, case, mesh, place, 1.0)
    axes.axvline(0, color=GREY, lw=0.8, ls=(0, (12, 3, 2, 3)))
    if displacement is not None:
        moved = [place[n] + np.take(displacement[n], [2, 0]) * 1e3 for n in around]
        (line,) = axes.plot(*np.transpose(moved), color="black", lw=1.0, ls=(0, (5, 3)))
        entries[f"inflated to {case.case.pressure_kPa:g} kPa"] = line
    _detail(axes, case, mesh, place)
    axes.set_xlabel("z along the axle, mm")
    axes.set_ylabel("r from the axle, mm")
    z, r = np.transpose([place[n] for n in around])
    name = fill(case.case.name, 64)
    figure.suptitle(name, fontsize=13)
    facts = (
        f"outer diameter {2 * r.max():.1f} mm, section width {np.ptp(z):.1f} mm,"
        f" {len(mesh.solids)} elements"
    )
    axes.set_title(facts, fontsize=9, color="0.3")
    columns = max(1, min(3, LETTERS // max(map(len, entries))))
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=columns, frameon=False
    )
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    lines = name.count("\n") - (-len(entries) // columns)
    height = AXES_WIDTH * (high - low) / (right - left)
    figure.set_figheight(height + REST + LINE * lines)
    save(figure, path)


def outline(mesh: SectionMesh) -> list[int]:
    """Numbers of the nodes round the section, closed."""
    step = 2 if mesh.quadratic else 1
    columns, rows = (step * n for n in mesh.shape)
    walk = [(0, j) for j in range(columns)] + [(i, columns) for i in range(rows)]
    walk += [(rows, j) for j in range(columns, 0, -1)] + [(i, 0) for i in range(rows, -1, -1)]
    return [1000 * (j + 1) + i + 1 for i, j in walk]


def turns(case: LoadedCase, mesh: SectionMesh, name: str) -> list[tuple[int, ...]]:
    """Nodes of the elements to draw a layer with: layers on one line take turns."""
    layers = case.case.rebar_layers
    layer = layers[name]
    sharing = [
        other
        for other, its in layers.items()
        if (its.line, its.regions) == (layer.line, layer.regions)
    ]
    own = [
        nodes
        for cord, nodes in mesh.cords[layer.line].items()
        if not layer.regions or mesh.region_of(cord) in layer.regions
    ]
    return own[sharing.index(name) :: len(sharing)]


def _draw(
    axes: Axes, case: LoadedCase, mesh: SectionMesh, place: dict[int, Array], size: float
) -> dict[str, Artist]:
    """Fill ``axes``, lines ``size`` times as thick; returns the legend's entries."""
    entries: dict[str, Artist] = {}
    layers = case.case.rebar_layers
    for k, (name, layer) in enumerate(layers.items()):
        lines = [[place[n] for n in nodes] for nodes in turns(case, mesh, name)]
        colour = COLOURS[k % len(COLOURS)]
        axes.add_collection(
            LineCollection(lines, color=colour, lw=1.3 * size, capstyle="butt", zorder=3)
        )
        words = f"{name.replace('_', ' ')}: {layer.angle_deg:g}° from the meridian"
        entries[words] = Line2D([], [], color=colour, lw=2)

    names = [name for name, _ in case.section.regions]
    colours = dict(zip(names, RUBBER * 9, strict=False))
    cells = {number: [place[n] for n in _round(nodes)] for number, nodes in mesh.solids.items()}
    for region, colour in colours.items():
        own = [cells[k] for k, (name, _) in mesh.cells.items() if name == region]
        axes.add_collection(PolyCollection(own, fc=colour, ec="0.62", lw=0.3 * size))
        entries[region.replace("_", " ")] = Patch(fc=colour, ec="0.62")
    held = set(mesh.rim)
    rim = [cells[k] for k, nodes in mesh.solids.items() if held.issuperset(nodes)]
    look: dict[str, Any] = {"fc": "none", "ec": "0.25", "hatch": "/////", "lw": 0.0}
    axes.add_collection(PolyCollection(rim, **look))
    entries["held by the rim"] = Patch(**look)
    return entries


def _round(nodes: tuple[int, ...]) -> list[int]:
    """An element's nodes in the order in which they lie round it."""
    if len(nodes) == 4:
        return list(nodes)
    return [n for pair in zip(nodes[:4], nodes[4:], strict=True) for n in pair]


def _detail(axes: Axes, case: LoadedCase, mesh: SectionMesh, place: dict[int, Array]) -> None:
    """The edge of the belt, or the crown of a tyre without one, enlarged inside the cavity."""
    held = set(mesh.rim)
    lasts = [list(elements.values())[-1][-1] for elements in mesh.cords.values()]
    ends = [place[n] for n in lasts if n not in held]
    inner = np.array([place[n] for k in mesh.inner for n in mesh.solids[k][:1]])
    half_width, height = abs(inner[0, 0]) * 0.9, np.ptp(inner[:, 1]) * 0.6
    top = inner[:, 1].max() - 0.16 * np.ptp(inner[:, 1])
    inset = axes.inset_axes(
        (-half_width, top - height, 2 * half_width, height), transform=axes.transData
    )
    _draw(inset, case, mesh, place, 2.0)
    z, r = np.mean(ends, axis=0) if ends else inner[len(inner) // 2]
    across, up = half_width / DETAIL, height / DETAIL / 2
    inset.set(xlim=(z - across, z + across), ylim=(r - up, r + up), xticks=[], yticks=[])
    for spine in inset.spines.values():
        spine.set(visible=True, color=GREY)
    inset.text(
        0.02,
        0.03,
        f"belt edge, {DETAIL:g} : 1" if ends else f"{DETAIL:g} : 1",
        transform=inset.transAxes,
        color="0.3",
    )
    axes.indicate_inset_zoom(inset, edgecolor=GREY, alpha=1.0)
