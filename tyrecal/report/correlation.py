"""MAC and AutoMAC as heat maps, a row a measured mode. The chance level is the lead of the best MAC
over the next that chance reaches with so many sensors (`measured.correlation`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..simulate.modes.label import in_words
from ..studies.fit.result import FitResult
from ..studies.labels import LabelsResult
from .figure import in_house_style, new_figure
from .sensitivities import CELL_INK, CELL_LIGHT

Array = np.ndarray
MAC_WORDS = "Agreement of shapes, 1 for equal ones (MAC)"
MIN_WRITTEN, DARK_CELL = 0.1, 0.6  # MAC from which a cell has its number, and has it in white


def figures(result: LabelsResult | FitResult) -> dict[str, Figure]:
    """Heat map of each test whose shapes a result compares with the design's."""
    maps = {}
    for number, each in enumerate(result.shapes, 1):
        title = f"MAC, {each.file}, {each.pressure_kPa:g} kPa, chance level {each.chance_level:.2f}"
        rows = [f"{pair.measured} {pair.member}".strip() for pair in each.pairs]
        maps[f"{result.stem}_mac_{number}"] = _draw(title, rows, each.computed, each.mac)
    return maps


def draw_auto_mac(entry: dict[str, Any]) -> Figure:
    """The measured modes of a test against each other, from `measured.correlation.auto_mac`."""
    title = f"AutoMAC, {entry['file']}, chance level {entry['chance_level']:.2f}"
    return _draw(title, entry["modes"], entry["modes"], entry["auto_mac"])


@in_house_style
def _draw(
    title: str, rows: Sequence[str], columns: Sequence[str], matrix: Sequence[Sequence[float]]
) -> Figure:
    values = np.array(matrix)
    width, height = 2.4 + 0.34 * len(columns), 1.8 + 0.28 * len(rows)
    figure = new_figure(width, height, caption=f"{MAC_WORDS}. {title}")
    axes = figure.add_subplot()
    edges = [np.arange(count + 1) - 0.5 for count in values.shape]  # cells, as vectors on a page
    axes.pcolormesh(edges[1], edges[0], values, cmap="Blues", vmin=0, vmax=1)
    axes.invert_yaxis()
    for (i, j), value in np.ndenumerate(values):
        if value >= MIN_WRITTEN:
            colour = CELL_LIGHT if value > DARK_CELL else CELL_INK
            axes.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=6, color=colour)
    axes.set_xticks(range(len(columns)), list(map(in_words, columns)), rotation=90, fontsize=7)
    axes.set_yticks(range(len(rows)), list(map(in_words, rows)), fontsize=7)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_title(title, loc="left", fontsize=9)
    return figure
