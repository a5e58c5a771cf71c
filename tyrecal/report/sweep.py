"""Frequencies over each number of a sweep."""

from __future__ import annotations

from matplotlib.figure import Figure

from ..simulate.modes.label import FAMILIES
from ..studies.sweep_result import SweepResult
from .figure import COLOURS, MARKERS, in_house_style, new_figure

MAX_PANELS = 6  # columns of the figure


@in_house_style
def figures(result: SweepResult) -> dict[str, Figure]:
    """The figure sweep: a row for each family of modes, a column for each number; a line where one
    number is swept, else a marker for each point."""
    swept = [each.name for each in result.numbers_swept][:MAX_PANELS]
    labels = [mode.label for mode in result.modes]
    # None: overtones
    families = [name for name in (*FAMILIES, None) if any(x.family == name for x in labels)]
    size = 1.4 + 3.2 * len(swept), 0.8 + 2.6 * len(families)
    figure = new_figure(*size, caption="Frequencies over each number that was swept")
    grid = figure.subplots(len(families), len(swept), sharex="col", sharey="row", squeeze=False)
    by_mode = {
        label: [m.frequency_Hz for row in result.rows for m in row.modes if m.label == label]
        for label in labels
    }
    for row, family in zip(grid, families, strict=True):
        for axes, name in zip(row, swept, strict=True):
            x = [point.values[name] for point in result.rows]
            for label in (each for each in labels if each.family == family):
                axes.plot(
                    x,
                    by_mode[label],
                    color=COLOURS[label.c % len(COLOURS)],
                    marker=MARKERS[label.c % len(MARKERS)],
                    ms=3,
                    lw=1.2 if len(result.numbers_swept) == 1 else 0,
                    label=label.display,
                )
            axes.grid(True, color="0.92", lw=0.6)
        row[0].set(ylabel="frequency, Hz")
        row[0].set_title(family or "overtones, belt bends across", loc="left")
        row[-1].legend(frameon=False, fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    for axes, name in zip(grid[-1], swept, strict=True):
        axes.set_xlabel(name)
    return {"sweep": figure}
