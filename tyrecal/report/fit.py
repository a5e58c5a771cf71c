"""The meaning of a fit's numbers, drawn: residuals in standard deviations, variables within their
bounds, their correlations, and what each measured value does to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ..studies.fit.result import ROAD_QUANTITIES, FitResult
from ..studies.fit.result_parts import FittedMode, FittedVariable
from ..units import printed_value, signed
from .figure import COLOURS, GREY, in_house_style, new_figure
from .sensitivities import draw_cells
from .table import MINUS

Array = np.ndarray
ROW_INCH = 0.3  # height of a line of a figure


@in_house_style
def draw_normalised(fit: FitResult) -> Figure | None:
    """Residuals of all targets over the standard deviations of their measurements, None where
    these are not known; bands: one and two of them."""
    rows = [(name, residual) for name, residual in normalised(fit) if residual is not None]
    if not rows:
        return None
    caption = (
        "Residuals in standard deviations sigma of the measurement; bands: one and two sigma"
        f"{_noise_words(fit)}"
    )
    figure = new_figure(6.4, 0.9 + ROW_INCH * len(rows), caption=caption)
    axes, places = figure.add_subplot(), np.arange(len(rows))
    for half in (2, 1):
        axes.axvspan(-half, half, color=GREY, alpha=0.12, lw=0)
    values = np.array([residual for _, residual in rows])
    axes.barh(places, values, color=COLOURS[0], height=0.6)
    for place, value in enumerate(values.tolist()):
        side = "left" if value >= 0 else "right"
        text = f" {signed(value, 1)} ".replace("-", MINUS)
        axes.text(value, place, text, va="center", ha=side, fontsize=8)
    axes.axvline(0, color=GREY, lw=0.8)
    widest = 1.25 * max(2.0, float(abs(values).max()))
    axes.set(xlim=(-widest, widest), xlabel="(fitted less measured) / sigma")
    axes.set_yticks(places, [name for name, _ in rows])
    axes.invert_yaxis()
    return figure


def normalised(fit: FitResult) -> list[tuple[str, float | None]]:
    """Name of each target, and its residual over its standard deviation, None without one."""
    rows: list[tuple[str, float | None]] = []
    for mode in fit.modes:
        name = " ".join(filter(None, (mode.label.display, mode.symmetry, mode.state)))
        sigma = sigma_Hz(fit, mode)
        rows.append((name, (mode.fitted_Hz - mode.target_Hz) / sigma if sigma else None))
    for each in fit.others:
        name = f"{ROAD_QUANTITIES[each.quantity].name.split(',')[0]} {each.state}".rstrip()
        rows.append((name, (each.fitted - each.target) / each.sigma if each.sigma else None))
    return rows


def farthest(fit: FitResult) -> tuple[str, float] | None:
    """Name and deviation in per cent of the target that the fit leaves farthest off; None: there
    are no targets."""
    off = [(mode.label.display, mode.deviation_percent) for mode in fit.modes]
    for each in fit.others:
        name = f"{ROAD_QUANTITIES[each.quantity].name.split(',')[0]} {each.state}"
        off.append((name.rstrip(), each.deviation_percent))
    return max(off, key=lambda each: abs(each[1]), default=None)


def sigma_Hz(fit: FitResult, mode: FittedMode) -> float | None:
    """Standard deviation of a target: stated or, without one, as the fit leaves it."""
    if mode.sigma_Hz:
        return mode.sigma_Hz
    if not fit.states:
        for each in fit.responses:
            if each.label == mode.label and each.load_N == mode.load_N:
                return each.scatter * mode.target_Hz  # scatter: relative
    return fit.noise_Hz


def _noise_words(fit: FitResult) -> str:
    if fit.noise_Hz is None:
        return ""
    return f". The targets state no sigma: {fit.noise_Hz:.2f} Hz, as the fit leaves it, is used"


@in_house_style
def draw_bounds(fit: FitResult) -> Figure:
    """Each variable between its bounds, with both standard errors."""
    caption = (
        "Variables within their bounds, on a logarithmic scale if both are positive. Thick line:"
        " one standard error by the scatter of the measurement; thin line: by all uncertainties"
    )
    count = len(fit.variables)
    figure = new_figure(7.6, 0.8 + 0.62 * count, caption=caption)
    axes = figure.add_subplot()
    for row, variable in enumerate(fit.variables.values()):
        _draw_within(axes, row, variable)
    axes.plot([], [], "s", color=COLOURS[1], mfc="white", ms=6, label="initial")
    axes.plot([], [], "o", color=COLOURS[0], ms=6, label="fitted")
    axes.set_yticks(range(count), list(fit.variables))
    axes.set(xlim=(-0.02, 1.02), ylim=(count - 0.4, -0.6), xticks=[])
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return figure


def _draw_within(axes: Axes, row: int, v: FittedVariable) -> None:
    """One variable: a bar from bound to bound, with values in the unit of engineers."""

    def place(value: float) -> float:
        low, high = v.lower, v.upper
        if low > 0:
            value, low, high = np.log([max(value, 1e-300), low, high])
        return float(np.clip((value - low) / (high - low), 0, 1)) if high > low else 0.5

    axes.barh(row, 1, height=0.16, color="0.85")
    for error, width in ((v.standard_error_total, 1.2), (v.standard_error, 4.0)):
        if error:
            at = v.value
            ratio = np.exp(error / at) if v.lower > 0 else 0.0
            ends = (at / ratio, at * ratio) if ratio else (at - error, at + error)
            axes.plot([place(end) for end in ends], [row, row], color=COLOURS[0], lw=width)
    axes.plot(place(v.initial), row, "s", color=COLOURS[1], mfc="white", ms=6)
    axes.plot(place(v.value), row, "o", color=COLOURS[0], ms=6)
    look: dict[str, Any] = {"va": "center", "fontsize": 8}
    for end, value, side in ((0, v.lower, "left"), (1, v.upper, "right")):
        axes.text(end, row + 0.32, printed_value(value, v.unit), ha=side, **look)
    words = printed_value(v.value, v.unit) + ", at bound" * v.at_bound
    x = min(max(place(v.value), 0.1), 0.9)
    axes.text(x, row - 0.3, words, ha="center", **look)


@in_house_style
def draw_correlations(fit: FitResult) -> Figure | None:
    """Correlations of the variables and, beside them, the singular values of the residuals'
    sensitivities to x (as in `studies`); None with fewer than two variables."""
    names, values = list(fit.correlations), fit.singular_values
    if len(names) < 2:
        return None
    matrix = np.array([[fit.correlations[a].get(b) for b in names] for a in names], float)
    caption = (
        "Correlations of the variables, and singular values of the sensitivities of the residuals"
    )
    if values and values[-1] > 0:
        caption += f": the largest is {values[0] / values[-1]:.3g} times the smallest"
    height = 1.2 + 0.34 * max(len(names), 3)
    figure = new_figure(4.4 + 0.55 * len(names), height, caption=caption)
    left, right = figure.subplots(1, 2, width_ratios=[len(names), 3])
    draw_cells(left, matrix, 2, 1.0)
    left.set_xticks(range(len(names)), names, rotation=30, ha="left")
    left.set_yticks(range(len(names)), names)
    places = np.arange(len(values))
    right.barh(places, values, color=COLOURS[0], height=0.6)
    right.set_xscale("log")
    low, high = min(values, default=1.0), max(values, default=1.0)
    right.set_xlim(max(low, 1e-12) / 3, 10 * max(high, 1e-12))
    for place, value in enumerate(values):
        right.text(max(value, 1e-12), place, f" {value:.3g}", va="center", fontsize=8)
    right.set_yticks(places, [f"{place + 1}" for place in places])
    right.invert_yaxis()
    right.set_xlabel("singular value")
    right.xaxis.set_minor_formatter(NullFormatter())
    return figure


@in_house_style
def draw_responses(fit: FitResult) -> Figure | None:
    """Change of each variable with each measured value; None where it is not known."""
    if not fit.responses:
        return None
    names = list(fit.responses[0].response)
    matrix = np.array([[each.response.get(n, 0.0) for n in names] for each in fit.responses])
    caption = (
        "Sensitivity of the result: change of each variable, in %, if a measured value were 1 %"
        " larger; of a linear variable in % of the width of its bounds"
    )
    figure = new_figure(3.6 + 0.9 * len(names), 1.0 + 0.26 * len(matrix), caption=caption)
    axes = figure.add_subplot()
    draw_cells(axes, matrix, 1)
    axes.set_xticks(range(len(names)), names)
    axes.set_yticks(range(len(matrix)), _response_names(fit))
    return figure


def _response_names(fit: FitResult) -> Sequence[str]:
    names = []
    for each in fit.responses:
        name = each.label.display if each.label else "mass"
        state = f", {each.pressure_kPa:g} kPa" if fit.states and each.label else ""
        load = f", {each.load_N:g} N" if each.load_N else ""
        names.append(f"{name}{state}{load}")
    return names
