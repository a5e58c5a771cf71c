"""The section as a drawing: its layers, or a map of its parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..studies.diagnose.where import PartChange
from ..units import signed
from .figure import COLOURS, GREY, RUBBER, headline, in_house_style, new_figure
from .shape_data import DiagnosisSection, Flat, SectionData
from .table import MINUS, map_resolution

Array = np.ndarray

LETTERS = 110  # of all columns of the legend
AXES_WIDTH, LINE_HEIGHT = 8.4, 0.2  # inches: of the drawing, of a line of text
REST = 1.05  # inches: height of all else
DETAIL = 4.0  # magnification of the belt's edge
CORD_COLOURS = (*COLOURS, "#8C6D31")  # a truck has seven layers
EVIDENCE_COLOURS = LinearSegmentedColormap.from_list("evidence", ["#EDEDED", "#F5C98A", "#D55E00"])
FULL_COLOUR = 5.0  # ln evidence from which on a part has the last colour
MAP_WIDTH = 7.4  # inches: of the map of parts
MAX_BARS = 12  # parts with a bar
AXIS_LABELS = {"xlabel": "z along the axle, mm", "ylabel": "r from the axle, mm"}


@in_house_style
def draw_section(section: SectionData, name: str, pressure_kPa: float) -> Figure:
    """Rubber by compound or region, elements, cords of each layer and what the rim holds, in mm.

    The belt's edge is repeated four times as large. Where the inflation is known, the inflated
    outline is dashed, at true scale.
    """
    words = "Section in mm: elements, cords, and what the rim holds"
    figure = new_figure(9.0, 8.0, caption=words)
    axes = figure.add_subplot(aspect="equal", anchor="N", **AXIS_LABELS)
    entries = _draw(axes, section, 1.0)
    axes.axvline(0, color=GREY, lw=0.8, ls=(0, (12, 3, 2, 3)))
    if section.inflated:
        z, r = _points(section.inflated).T
        (line,) = axes.plot(z, r, color="black", lw=1.0, ls=(0, (5, 3)))
        entries[f"inflated to {pressure_kPa:g} kPa"] = line
    _detail(axes, section)
    name = fill(name, 64)
    figure.suptitle(name, fontsize=13)
    axes.set_title(size_words(section), fontsize=9, color="0.3")
    columns = max(1, min(3, LETTERS // max(map(len, entries))))
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=columns, frameon=False
    )
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    lines = name.count("\n") - (-len(entries) // columns)
    height = AXES_WIDTH * (high - low) / (right - left)
    figure.set_figheight(height + REST + LINE_HEIGHT * lines)
    return figure


def size_words(section: SectionData) -> str:
    """The section's size."""
    z, r = _points(section.outline).T
    return (
        f"outer diameter {2 * r.max():.1f} mm, section width {np.ptp(z):.1f} mm,"
        f" {sum(map(len, section.areas.values()))} elements"
    )


def _draw(axes: Axes, section: SectionData, size: float) -> dict[str, Artist]:
    """Fill ``axes``, lines ``size`` times as thick; returns the legend's entries."""
    entries: dict[str, Artist] = {}
    for k, (name, layer) in enumerate(section.cords.items()):
        colour = CORD_COLOURS[k % len(CORD_COLOURS)]
        dashed = "-" if k < len(CORD_COLOURS) else (0, (2, 1))  # where colours begin again
        lines = LineCollection(
            _all(layer.lines), color=colour, lw=1.3 * size, capstyle="butt", ls=dashed, zorder=3
        )
        axes.add_collection(lines)
        words = f"{name.replace('_', ' ')}: {layer.angle_deg:g}° from the meridian"
        entries[words] = Line2D([], [], color=colour, lw=2, ls=dashed)
    for k, (region, cells) in enumerate(section.areas.items()):
        look: dict[str, Any] = {"fc": RUBBER[k % len(RUBBER)], "ec": "0.62"}
        axes.add_collection(PolyCollection(_all(cells), lw=0.3 * size, **look))
        entries[region.replace("_", " ")] = Patch(**look)
    held = _all(section.rim)
    sides, elements = [each for each in held if len(each) == 2], [e for e in held if len(e) > 2]
    if sides:
        at_rim: dict[str, Any] = {"color": "0.25", "lw": 2.4 * size}
        axes.add_collection(LineCollection(sides, zorder=2, **at_rim))
        entries["held by the rim"] = Line2D([], [], **at_rim)
    if elements:
        look = {"fc": "none", "ec": "0.25", "hatch": "/////", "lw": 0.0}
        axes.add_collection(PolyCollection(elements, **look))
        entries["held by the rim"] = Patch(**look)
    axes.autoscale_view()  # collections alone do so from Matplotlib 3.11 on
    return entries


def _detail(axes: Axes, section: SectionData) -> None:
    """The edge of the belt, or the crown of a tyre without one, enlarged inside the cavity."""
    held = {tuple(point) for cell in section.rim for point in _points(cell)}
    lasts = [_points(layer.lines[-1])[-1] for layer in section.cords.values() if layer.lines]
    ends = [point for point in lasts if tuple(point) not in held]
    around = _points(section.outline)
    crown = _inner_crown(around)
    half_width, height = abs(around[0, 0]) * 0.9, (crown - around[0, 1]) * 0.6
    top = crown - 0.16 * (crown - around[0, 1])
    inset = axes.inset_axes(
        (-half_width, top - height, 2 * half_width, height), transform=axes.transData
    )
    _draw(inset, section, 2.0)
    z, r = np.mean(ends, axis=0) if ends else (0.0, crown)
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


def _inner_crown(around: Array) -> float:
    """r of the inner surface amid the outline's points, which begin on it."""
    z, r = around.T
    return float(r[np.argmax(np.sign(z) != np.sign(z[0]))])


@in_house_style
def draw_section_map(
    parts: DiagnosisSection, places: Sequence[PartChange], effective_rank: int | None = None
) -> Figure:
    """Parts of the section, coloured by the evidence for a change of them alone; below, that
    evidence as bars, the largest first.

    effective_rank: number of combinations of parts that the data see, for the title; None: not
    known.
    """
    by_name: dict[str, PartChange] = {}
    for place in places:  # of several rubbers in a region the likelier one
        by_name.setdefault(place.region.split(",")[0], place)
    caption = "Evidence that one part of the section is changed alone, over no change"
    figure = new_figure(MAP_WIDTH, 8.0, caption=caption)
    axes, bars = figure.subplots(2, 1)
    axes.set(aspect="equal", **AXIS_LABELS)
    for name, cells in parts.areas.items():
        look: dict[str, Any] = {"fc": _colour(by_name.get(name)), "ec": "0.7", "lw": 0.3}
        axes.add_collection(PolyCollection(_all(cells), **look))
    for name, flat in parts.cords.items():
        lines, colour = _all(flat), _colour(by_name.get(name))
        axes.add_collection(LineCollection(lines, color=colour, lw=2.2, zorder=2))
        axes.add_collection(LineCollection(lines, color="0.3", lw=0.5, zorder=3))
    axes.autoscale_view()
    _draw_bars(bars, places)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    heights = 0.5 + 0.85 * MAP_WIDTH * (high - low) / (right - left), 0.8 + 0.23 * len(bars.patches)
    axes.get_gridspec().set_height_ratios(heights)
    figure.set_figheight(sum(heights) + 0.9)
    words = "One part changed alone: how well it explains what calibration leaves."
    rank_words = "" if effective_rank is None else map_resolution(effective_rank)
    headline(figure, f"{words} {rank_words}".rstrip())
    return figure


def _draw_bars(axes: Axes, places: Sequence[PartChange]) -> None:
    """The evidence of the `MAX_BARS` likeliest parts in the colours of the map, with numbers."""
    shown = places[:MAX_BARS]
    rows, evidence = range(len(shown)), [place.evidence for place in shown]
    axes.barh(rows, evidence, color=[_colour(p) for p in shown], ec="0.7", lw=0.3)
    for row, value in zip(rows, evidence, strict=True):
        axes.text(max(value, 0.0), row, f" {_signed(value, 1)}", va="center", fontsize=8)
    axes.axvline(0, color=GREY, lw=0.8)
    axes.set_yticks(rows, [place.region.replace("_", " ") for place in shown])
    axes.set_xlim(min(0.0, 1.2 * min(evidence)), max(1.0, 1.12 * max(evidence)))
    axes.set_xlabel("ln evidence: the part changed, over no change")
    axes.invert_yaxis()
    if len(places) > len(shown):
        title = f"the {len(shown)} likeliest of {len(places)} parts"
        axes.set_title(title, loc="left", fontsize=9, color="0.3")


def _colour(place: PartChange | None) -> tuple[float, ...]:
    return EVIDENCE_COLOURS(
        0.0 if place is None else min(max(place.evidence, 0.0) / FULL_COLOUR, 1.0)
    )


def _signed(value: float, digits: int) -> str:
    """A number with a sign, a true minus, and no -0."""
    return signed(value, digits).replace("-", MINUS)


def _points(flat: Sequence[float]) -> Array:
    """Points (n, 2): z, r in mm."""
    return np.reshape(flat, (-1, 2))


def _all(lines: Iterable[Flat]) -> list[Array]:
    return [_points(line) for line in lines]
