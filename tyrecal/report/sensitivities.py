"""Heat maps: sensitivities, numbers by quantities; MAC and AutoMAC, a row a measured mode.

The chance level is the lead of the best MAC
over the next that chance reaches with so many sensors (`measured.correlation`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..simulate.modes.label import in_words
from ..studies.fit.result import FitResult
from ..studies.labels import LabelsResult
from ..studies.sensitivities.result import MAX_NUMBERS_SHOWN, SensitivitiesResult, heading_of, named
from .figure import in_house_style, new_figure
from .table import MINUS

Array = np.ndarray


DIVERGING = colormaps["RdBu_r"]
# of texts in cells; no greys, which a dark page would turn round while the cells keep their colours
CELL_INK, CELL_LIGHT = "#22262b", "#fffffe"
DARK = 0.6  # of the largest value, above which a cell's text is white


def figures(result: SensitivitiesResult) -> dict[str, Figure]:
    """Figures of the study, by name."""
    return {"sensitivities": draw_heat_map(result)} if result.rows else {}


@in_house_style
def draw_heat_map(result: SensitivitiesResult) -> Figure:
    """The most influential numbers, from red (raises a quantity) to blue (lowers it)."""
    numbers = list(result.by_number().items())[:MAX_NUMBERS_SHOWN]
    quantities = list(result.quantity_values)
    values = np.array([[own[each].value for each in quantities] for _, own in numbers])
    caption = "Change of each quantity, in %, with 1 % more of a number: d ln q / d ln x"
    width, height = 3.2 + 0.6 * len(quantities), 1.6 + 0.24 * len(numbers)
    figure = new_figure(width, height, caption=caption)
    axes = figure.add_subplot()
    draw_cells(axes, values, 2)
    axes.set_xticks(
        range(len(quantities)), [heading_of(each).replace(" ", "\n") for each in quantities]
    )
    axes.set_yticks(range(len(numbers)), [named(own[quantities[0]]) for _, own in numbers])
    axes.set_xlabel("d ln q / d ln x")
    return figure


def draw_cells(axes: Axes, values: np.ndarray, digits: int, full: float | None = None) -> None:
    """A matrix as cells with their numbers, names of columns above; full: value of full colour,
    default the largest one."""
    largest = full or max(np.nanmax(abs(values)), 1e-12)
    edges = [np.arange(count + 1) - 0.5 for count in values.shape]  # cells, as vectors on a page
    axes.pcolormesh(edges[1], edges[0], values, cmap=DIVERGING, vmin=-largest, vmax=largest)
    axes.invert_yaxis()
    for (i, j), value in np.ndenumerate(values):
        colour = CELL_LIGHT if abs(value) > DARK * largest else CELL_INK
        text = f"{round(value, digits) + 0.0:.{digits}f}".replace("-", MINUS)
        text = text if np.isfinite(value) else "\N{EN DASH}"
        axes.text(j, i, text, ha="center", va="center", fontsize=7, color=colour)
    axes.tick_params(length=0, top=True, labeltop=True, bottom=False, labelbottom=False)
    axes.spines[:].set_visible(False)


MAC_WORDS = "Agreement of shapes, 1 for equal ones (MAC)"
MIN_WRITTEN, DARK_CELL = 0.1, 0.6  # MAC from which a cell has its number, and has it in white


def mac_figures(result: LabelsResult | FitResult) -> dict[str, Figure]:
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
