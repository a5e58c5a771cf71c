"""Pictures of a fit: its course over the design points, and its deviations from targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

from ..studies.fit.result import FitResult
from ..studies.fit.result_parts import FittedMode
from ..studies.result import in_lines
from . import sensitivities
from .figure import COLOURS, GREY, MARKERS, headline, in_house_style, new_figure


def figures(fit: FitResult) -> dict[str, Figure]:
    """Deviations from the targets, and how shapes agree."""
    deviations = draw_states(fit) if fit.states else draw_deviations(fit.modes)
    return {"deviations": deviations, **sensitivities.mac_figures(fit)}


@in_house_style
def draw_convergence(history: Sequence[Mapping[str, Any]], unit: str = "Hz") -> Figure:
    """Draw the objective and, below it, every variable over its start value; both logarithmic.

    history: rows of fit_history.csv in order: ``point``, ``objective_Hz`` (None: the design could
    not be evaluated) and ``values``; lines mark where the number ``start`` changes. The objective
    is in ``unit``, whatever its key says. Variables that start at 0 or change sign have no such
    ratio; only the legend lists them.
    """
    point = np.array([row["point"] for row in history])
    objective = np.array([row["objective_Hz"] or np.nan for row in history], float)
    failed = np.isnan(objective)
    figure = new_figure(
        8.0, 5.6, caption="The objective and the variables, design point by design point"
    )
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    headline(figure, _summary(objective, unit))

    many = len(point) > 60
    best = np.fmin.accumulate(objective)
    top.step(point, best, where="post", color=COLOURS[0], lw=1.8, label="best so far")
    top.semilogy(
        point,
        objective,
        "o",
        color=COLOURS[1],
        ms=2.5 if many else 5,
        mec="white",
        mew=0 if many else 0.5,
        label="design point",
    )
    if failed.any():
        top.plot(
            point[failed],
            np.full(failed.sum(), 0.96),
            "kx",
            ms=3 if many else 6,
            transform=top.get_xaxis_transform(),
            label="could not be evaluated",
        )
    top.set_ylabel(f"objective, {unit}")

    for k, (name, start) in enumerate(history[0]["values"].items()):
        ratio = np.array([row["values"][name] for row in history], float) / (start or np.nan)
        drawn = bool((ratio > 0).all())
        bottom.semilogy(
            point,
            ratio if drawn else np.nan * ratio,
            marker=MARKERS[k % len(MARKERS)],
            ms=0 if many else 4,
            color=COLOURS[k % len(COLOURS)],
            lw=1.2,
            label=name if drawn else f"{name}: no ratio",
        )
    bottom.axhline(1, color=GREY, lw=0.8, ls=":")
    bottom.set_ylabel("value / start value")
    bottom.set_xlabel("design point")
    bottom.xaxis.set_major_locator(MaxNLocator(integer=True))

    starts = [row.get("start", 1) for row in history]
    for axes in (top, bottom):
        for i in range(1, len(starts)):
            if starts[i] != starts[i - 1]:
                axes.axvline(point[i] - 0.5, color=GREY, lw=0.5)
        axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
        axes.grid(True, which="major", color="0.9", lw=0.6)
        low, high = axes.get_ylim()
        if high / low < 5:  # a logarithmic axis would have at most one number
            axes.yaxis.set_major_locator(MaxNLocator(5))
            axes.yaxis.set_minor_locator(NullLocator())
        elif high / low < 100:  # powers of ten alone would leave the axis without numbers
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    return figure


def _summary(objective: np.ndarray, unit: str) -> str:
    """Title: the first and the best objective."""
    if np.isnan(objective).all():
        return f"none of {len(objective)} design points could be evaluated"
    first, best = objective[~np.isnan(objective)][0], np.nanmin(objective)
    return f"objective {first:.2f} {unit} to {best:.2f} {unit} in {len(objective)} design points"


@in_house_style
def draw_deviations(modes: Sequence[FittedMode]) -> Figure:
    """Draw deviations in %, frequency over target less 1, before and after the fit, one row per
    mode."""
    words = "Deviations of frequencies from their targets before and after the fit"
    figure = new_figure(5.2, 0.9 + 0.26 * len(modes), caption=words)
    axes = figure.add_subplot()
    after = [mode.deviation_percent for mode in modes]
    before = [100 * (mode.initial_Hz / mode.target_Hz - 1) for mode in modes]
    rows = range(len(modes))
    axes.axvline(0, color=GREY, lw=0.8)
    axes.hlines(rows, before, after, color=GREY, lw=1.2)
    axes.plot(before, rows, "s", color=COLOURS[1], mfc="white", ms=5, label="initial")
    axes.plot(after, rows, "o", color=COLOURS[0], ms=5, label="fitted")
    axes.set_yticks(rows, [mode.label.display for mode in modes])
    axes.invert_yaxis()
    axes.set_xlabel("deviation from target, %")
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


@in_house_style
def draw_states(fit: FitResult) -> Figure:
    """Draw deviations in % after a fit over several states, one column per state.

    Bars: one standard deviation of the measured value.
    """
    states = list(dict.fromkeys(each.state for each in fit.modes))
    name = lambda mode: f"{mode.label.display} {mode.symmetry or ''}".rstrip()
    names = list(dict.fromkeys(map(name, fit.modes)))
    words = (
        "Deviations from the targets after the fit, a column a state; bars: one standard deviation"
        " of the measured value"
    )
    figure = new_figure(1.6 + 1.7 * len(states), 1.3 + 0.26 * len(names), caption=words)
    grid = figure.subplots(1, len(states), sharex=True, sharey=True, squeeze=False)[0]
    for axes, state in zip(grid, states, strict=True):
        own = [mode for mode in fit.modes if mode.state == state]
        rows = [names.index(name(mode)) for mode in own]
        bars = [100 * (mode.sigma_Hz or 0.0) / mode.target_Hz for mode in own]  # None: not stated
        axes.axvline(0, color=GREY, lw=0.8)
        axes.errorbar(
            [mode.deviation_percent for mode in own],
            rows,
            xerr=bars,
            fmt="o",
            color=COLOURS[0],
            ecolor=GREY,
            ms=4,
            lw=1.0,
        )
        axes.set_title(in_lines(state), loc="left", fontsize=8)
        axes.grid(True, axis="x", color="0.92", lw=0.6)
    grid[0].set_yticks(range(len(names)), names)
    grid[0].invert_yaxis()
    grid[0].set_xlabel("deviation from target, %")
    return figure
