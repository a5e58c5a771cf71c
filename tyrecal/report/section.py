"""The section as a drawing: its layers, or a map of its parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..studies.diagnose.where import PartChange
from .figure import COLOURS, GREY, RUBBER, headline, in_house_style, new_figure
from .shape_data import DiagnosisSection, Flat, SectionData
from .table import MINUS, map_resolution

Array = np.ndarray

LETTERS = 110  # of all columns of the legend
AXES_WIDTH, LINE_HEIGHT, REST = (
    8.4,
    0.2,
    1.05,
)  # inches: of the drawing, of a line of text, of all else
DETAIL = 4.0  # magnification of the belt's edge
# of 40 steps: a colour bar of 50 or more would be a bitmap
EVIDENCE_COLOURS = LinearSegmentedColormap.from_list(
    "evidence", ["#EDEDED", "#F5C98A", "#D55E00"], 40
)
FULL_COLOUR = 5.0  # ln evidence
AXIS_LABELS = {"xlabel": "z along the axle, mm", "ylabel": "r from the axle, mm"}


@in_house_style
def draw_section(section: SectionData, name: str, pressure_kPa: float) -> Figure:
    """Rubber by compound or region, elements, cords of each layer and what the rim holds, in mm.

    The belt's edge is repeated four times as large. Where the inflation is known, the inflated
    outline is dashed, at true scale.
    """
    figure = new_figure(9.0, 8.0)
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
        colour = COLOURS[k % len(COLOURS)]
        dashed = "-" if k < len(COLOURS) else (0, (2, 1))  # where colours begin again
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
    """Parts of the section, coloured by the evidence for a change of them alone; with an
    ``effective_rank`` a table of them beside, and what the data see."""
    by_name: dict[str, PartChange] = {}
    for place in places:  # of several rubbers in a region the likelier one
        by_name.setdefault(place.region.split(",")[0], place)
    table = effective_rank is not None
    figure = new_figure(10.0 if table else 6.0, 5.2)
    widths = [5, 4] if table else [1]
    axes, *beside = figure.subplots(1, len(widths), squeeze=False, width_ratios=widths)[0]
    axes.set(aspect="equal", **AXIS_LABELS)
    for name, cells in parts.areas.items():
        look: dict[str, Any] = {"fc": _colour(by_name.get(name)), "ec": "0.7", "lw": 0.3}
        axes.add_collection(PolyCollection(_all(cells), **look))
    for name, flat in parts.cords.items():
        lines, colour = _all(flat), _colour(by_name.get(name))
        axes.add_collection(LineCollection(lines, color=colour, lw=2.2, zorder=2))
        axes.add_collection(LineCollection(lines, color="0.3", lw=0.5, zorder=3))
    axes.autoscale_view()
    if effective_rank is not None:
        _write_table(beside[0], places, effective_rank)
    headline(figure, "One part changed alone: how well it explains what calibration leaves")
    scale = ScalarMappable(Normalize(0, FULL_COLOUR), EVIDENCE_COLOURS)
    bar = figure.colorbar(scale, ax=axes, orientation="horizontal", shrink=0.6, extend="max")
    bar.set_label("ln evidence against no change")
    return figure


def _write_table(axes: Axes, places: Sequence[PartChange], effective_rank: int) -> None:
    """Parts as lines of text, and what can be told from them."""
    axes.axis("off")
    table = [f"{'part':22s}   stiffness, %     mass, %   ln evidence"]
    table += [
        f"{p.region[:22]:22s}   {_spread(p.stiffness_percent, p.stiffness_sigma)}"
        f"   {_spread(p.mass_percent, p.mass_sigma)}   {_signed(p.evidence, 1):>8s}"
        for p in places
    ]
    same = [f"{p.region} looks like {', '.join(p.same_as)}" for p in places if p.same_as]
    words = [fill(map_resolution(effective_rank), 62), *same]
    small: dict[str, Any] = {"transform": axes.transAxes, "fontsize": 7.5}
    axes.text(0.0, 0.98, "\n".join(table), va="top", family="monospace", **small)
    axes.text(0.0, 0.02, "\n".join(words), va="bottom", color="0.3", **small)


def _colour(place: PartChange | None) -> tuple[float, ...]:
    return EVIDENCE_COLOURS(
        0.0 if place is None else min(max(place.evidence, 0.0) / FULL_COLOUR, 1.0)
    )


def _signed(value: float, digits: int) -> str:
    """With a sign, a true minus, and no -0."""
    text = f"{round(value, digits) + 0.0:+.{digits}f}"
    return text.replace("-", MINUS)


def _spread(percent: float, sigma: float) -> str:
    return f"{_signed(percent, 0):>5s} ± {sigma:<4.0f}"


def _points(flat: Sequence[float]) -> Array:
    return np.reshape(flat, (-1, 2))


def _all(lines: Iterable[Flat]) -> list[Array]:
    return [_points(line) for line in lines]
