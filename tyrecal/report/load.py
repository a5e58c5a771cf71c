"""Frequencies of the loaded tyre over its load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from ..simulate.modes.label import FAMILIES, Label
from ..simulate.modes.loaded import SYMMETRIES
from ..studies.loaded_result import LoadRow, LoadSweep
from .figure import COLOURS, MARKERS, in_house_style, new_figure
from .pressure import GAP, name_lines

# symmetric about the patch solid, antisymmetric dashed and hollow
MEMBER_STYLES: dict[str, dict[str, Any]] = {
    SYMMETRIES[0]: {"ls": "-"},
    SYMMETRIES[1]: {"ls": (0, (4, 2)), "mfc": "white"},
}
Curve = tuple[list[float], list[float]]


def figures(result: LoadSweep) -> dict[str, Figure]:
    """The figure of the study by its name."""
    return {"load": draw_load_sweep(result.rows)}


@in_house_style
def draw_load_sweep(rows: Sequence[LoadRow]) -> Figure:
    """Frequency over load, a column a family and a line a design; c has a colour and a marker,
    the two members of a doublet share them.

    rows: of load_sweep.json; a load of 0 is the unloaded tyre.
    """
    designs = {row.design: _curves(rows, row.design) for row in rows}
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


def _curves(rows: Sequence[LoadRow], design: str) -> dict[tuple[Label, str], Curve]:
    """Loads (kN) and frequencies (Hz) of each member."""
    curves: dict[tuple[Label, str], Curve] = {}
    for row in rows:
        for mode in row.modes if row.design == design else []:
            load, hertz = curves.setdefault((mode.label, mode.symmetry or ""), ([], []))
            load.append(row.load_N / 1e3)
            hertz.append(mode.frequency_Hz)
    return curves
