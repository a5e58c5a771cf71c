"""Frequencies over the state of the tyre: with their slopes over the inflation pressure, and over
the load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..simulate.modes.label import FAMILIES, Label
from ..simulate.modes.loaded import SYMMETRIES
from ..studies.loaded_result import LoadRow, LoadSweep
from ..studies.pressure_result import PressureRow, PressureSweep
from .figure import COLOURS, GREY, MARKERS, in_house_style, new_figure

LINE_STYLES = {"initial": (0, (4, 2)), "fitted": "-"}
GAP = 0.042  # of an axis' height between two labels' centres

Curves = dict[Label, tuple[np.ndarray, np.ndarray, np.ndarray]]


def figures(result: PressureSweep) -> dict[str, Figure]:
    """The picture of the rows, without targets."""
    return {"pressure_sweep": draw_pressure_sweep(result.rows, [])}


@in_house_style
def draw_pressure_sweep(
    rows: Sequence[PressureRow], targets: Sequence[tuple[Label, float, float]] = ()
) -> Figure:
    """Frequency over pressure, one column a family, and below the slopes d ln f / d ln p.

    rows: of pressure_sweep.json; a design "initial" is dashed, "fitted" solid; c has a colour and
    a marker. targets: label, kPa and Hz that were measured, crosses where the pressure was swept.
    """
    swept = [row.pressure_kPa for row in rows]
    targets = [each for each in targets if min(swept) <= each[1] <= max(swept)]
    designs = {row.design: _curves(rows, row.design) for row in rows}
    labels = sorted({label for curves in designs.values() for label in curves}, key=str)
    columns = {name: [x for x in labels if x.family == name] for name in (*FAMILIES, None)}
    shown = [name for name in columns if columns[name]]
    words = (
        "Frequencies over the inflation pressure and, below, their sensitivities; solid: fitted,"
        " dashed: initial, crosses: targets"
    )
    figure = new_figure(1.2 + 4.2 * len(shown), 7.6, caption=words)
    grid = figure.subplots(
        2, len(shown), sharex=True, sharey="row", height_ratios=[5, 3], squeeze=False
    )
    for (top, bottom), name in zip(grid.T, shown, strict=True):
        top.set_title(name or "overtones, belt bends across", loc="left")
        for design, curves in designs.items():
            for label in columns[name]:
                if label in curves:
                    _draw(top, bottom, curves[label], design, label.c)
        for label, kPa, hertz in targets:
            if label in columns[name]:
                top.plot(kPa, hertz, "kx", ms=7, mew=1.5, zorder=4)
        bottom.axhline(0.5, color=GREY, lw=0.8, ls=":")
        bottom.set_xlabel("inflation pressure, kPa")
    top, bottom = grid[:, 0]
    top.set_ylabel("frequency, Hz")
    bottom.set_ylabel("d ln f / d ln p")
    bottom.text(
        0.01,
        0.5,
        "membrane: f ~ √p",
        color=GREY,
        va="bottom",
        fontsize=8,
        transform=bottom.get_yaxis_transform(),
    )
    top.set_ylim(bottom=0)
    bottom.set_ylim(top=max(0.54, bottom.get_ylim()[1]))
    for axes in grid.flat:
        axes.grid(True, color="0.92", lw=0.6)
    last = designs.get("fitted") or next(iter(designs.values()))
    for axes_pair, name in zip(grid.T, shown, strict=True):
        for axes, which in zip(axes_pair, (1, 2), strict=True):
            mine = {label: last[label] for label in columns[name] if label in last}
            ends = [(float(c[which][-1]), float(c[0][-1]), label) for label, c in mine.items()]
            name_lines(axes, ends, GAP * (1 if which == 1 else 5 / 3))
    for design in designs:
        top.plot([], [], color="k", ls=LINE_STYLES.get(design, ":"), label=design)
    if targets:
        top.plot([], [], "kx", ms=7, mew=1.5, label="target")
    top.legend(frameon=False, loc="upper left")
    return figure


def _draw(top: Axes, bottom: Axes, curve: Any, design: str, c: int) -> None:
    """Add a mode's frequency and its rise over the pressure to both panels."""
    style: dict[str, Any] = {
        "color": COLOURS[c % len(COLOURS)],
        "ls": LINE_STYLES.get(design, ":"),
        "marker": MARKERS[c % len(MARKERS)],
        "ms": 4,
        "lw": 1.4,
        "mfc": "white" if design == "initial" else None,
    }
    p, f, slope = curve
    top.plot(p, f, **style)
    bottom.plot(p, slope, **{**style, "ms": 0 if len(p) > 1 else 4})


def _curves(rows: Sequence[PressureRow], design: str) -> Curves:
    """Label to pressures (kPa), frequencies (Hz) and slopes of a design, each (row,)."""
    curves: dict[Label, list[tuple[float, float, float]]] = {}
    for row in rows:
        for mode in row.modes if row.design == design else []:
            slope = mode.d_ln_f_d_ln_p
            point = row.pressure_kPa, mode.frequency_Hz, np.nan if slope is None else slope
            curves.setdefault(mode.label, []).append(point)
    return {label: tuple(np.array(points).T) for label, points in curves.items()}


def name_lines(axes: Axes, ends: Sequence[tuple[float, float, Label]], gap: float) -> None:
    """Labels right of the lines' ends, (y, x, label) of each, moved apart where they would touch:
    ``gap`` of the axis' height between two. None where a line has no end."""
    if not np.isfinite([y for y, _, _ in ends]).all():
        return
    ends = sorted(ends, key=lambda end: (end[0], end[2]))
    low, high = axes.get_ylim()
    place = apart([(y - low) / (high - low) for y, _, _ in ends], gap)
    for (y, x, label), height in zip(ends, place, strict=True):
        axes.annotate(
            label.display,
            (x, y),
            xytext=(1.03, height),
            textcoords="axes fraction",
            va="center",
            color=COLOURS[label.c % len(COLOURS)],
            arrowprops={"arrowstyle": "-", "color": "0.75", "lw": 0.6, "shrinkB": 4, "shrinkA": 0},
            annotation_clip=False,
        )


def apart(heights: Sequence[float], gap: float) -> list[float]:
    """Rising heights moved as little as is simple, so that neighbours are ``gap`` apart."""
    place = list(heights)
    for _ in range(100):
        for i in range(1, len(place)):
            close = gap - (place[i] - place[i - 1])
            if close > 0:
                place[i], place[i - 1] = place[i] + close / 2, place[i - 1] - close / 2
    return place


# symmetric about the patch solid, antisymmetric dashed and hollow
MEMBER_STYLES: dict[str, dict[str, Any]] = {
    SYMMETRIES[0]: {"ls": "-"},
    SYMMETRIES[1]: {"ls": (0, (4, 2)), "mfc": "white"},
}
Curve = tuple[list[float], list[float]]


def load_figures(result: LoadSweep) -> dict[str, Figure]:
    """The figure of the study by its name."""
    return {"load": draw_load_sweep(result.rows)}


@in_house_style
def draw_load_sweep(rows: Sequence[LoadRow]) -> Figure:
    """Frequency over load, a column a family and a line a design; c has a colour and a marker,
    the two members of a doublet share them.

    rows: of load_sweep.json; a load of 0 is the unloaded tyre.
    """
    designs = {row.design: _load_curves(rows, row.design) for row in rows}
    labels = {label for curves in designs.values() for label, _ in curves}
    shown = [name for name in (*FAMILIES, None) if any(x.family == name for x in labels)]
    size = 1.0 + 4.4 * len(shown), 0.6 + 5.4 * len(designs)
    figure = new_figure(*size, caption="Frequencies of the loaded tyre over the load")
    grid = figure.subplots(len(designs), len(shown), sharex=True, sharey=True, squeeze=False)
    for line, (design, curves) in zip(grid, designs.items(), strict=True):
        for axes, name in zip(line, shown, strict=True):
            own = {k: curve for k, curve in curves.items() if k[0].family == name}
            for (label, symmetry), (load, hertz) in own.items():
                axes.plot(
                    load,
                    hertz,
                    color=COLOURS[label.c % len(COLOURS)],
                    lw=1.4,
                    ms=4.5,
                    marker=MARKERS[label.c % len(MARKERS)],
                    **MEMBER_STYLES.get(symmetry, {}),
                )
            axes.set_title(f"{design}, {name or 'overtones'}", loc="left")
            axes.grid(True, color="0.92", lw=0.6)
        line[0].set_ylabel("frequency, Hz")
    for axes in grid[-1]:
        axes.set_xlabel("load, kN")
    grid[0, 0].set_xlim(left=0)
    grid[0, 0].set_ylim(bottom=0)
    for line, curves in zip(grid, designs.values(), strict=True):
        for axes, name in zip(line, shown, strict=True):
            # Hz, kN and label at each line's end
            ends = [(c[1][-1], c[0][-1], k[0]) for k, c in curves.items() if k[0].family == name]
            name_lines(axes, ends, GAP)
    for symmetry, style in MEMBER_STYLES.items():
        grid[0, 0].plot([], [], color="k", marker="o", ms=4.5, lw=1.4, label=symmetry, **style)
    grid[0, 0].legend(frameon=False, loc="lower right")
    return figure


def _load_curves(rows: Sequence[LoadRow], design: str) -> dict[tuple[Label, str], Curve]:
    """Loads (kN) and frequencies (Hz) of each member."""
    curves: dict[tuple[Label, str], Curve] = {}
    for row in rows:
        for mode in row.modes if row.design == design else []:
            load, hertz = curves.setdefault((mode.label, mode.symmetry or ""), ([], []))
            load.append(row.load_N / 1e3)
            hertz.append(mode.frequency_Hz)
    return curves
