"""Draws of the variables, each alone and in pairs."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..studies.sample.result import PAIR_STEPS, SampledVariable, SampleResult
from ..units import display_unit
from .figure import COLOURS, GREY, in_house_style, new_figure

Array = np.ndarray
WITHIN = (0.9, 0.5)  # shares of the draws inside the lines
DRAWN_COLOUR, LINEAR_COLOUR = COLOURS[0], COLOURS[1]
AT_BOUND = 1e-6  # of a bound, up to which the box ends at it


def figures(result: SampleResult) -> dict[str, Figure]:
    """Figures of a sample, by name."""
    return {"sample_corner": draw_corner(result)}


@in_house_style
def draw_corner(result: SampleResult) -> Figure:
    """Corner picture: on the diagonal the shares of the draws with median, 90 % and, dashed, the
    linear standard errors; below it each pair, darker where more draws lie."""
    names, n = list(result.variables), len(result.variables)
    words = (
        "Draws of the variables, each alone and in pairs; ticks: ends of the 90 % interval; areas"
        " hold 90 % and 50 % of the draws"
    )
    figure = new_figure(1.2 + 2.4 * n, 1.0 + 2.2 * n, caption=words)  # inches
    grid = figure.subplots(n, n, squeeze=False)
    pairs = {(pair.a, pair.b): pair.counts for pair in result.pairs}
    for i, row in enumerate(names):
        for j, column in enumerate(names):
            axes, v = grid[i, j], result.variables[column]
            if j > i:
                axes.axis("off")
                continue
            if i == j:
                _alone(axes, v, row)
            else:
                _together(axes, np.array(pairs[row, column], float), v, result.variables[row])
            if v.log:
                axes.set_xscale("log")
            axes.set_xlim(*v.box)
            axes.minorticks_off()
            axes.set_xticks(_ticks(v), _tick_labels(v))
            for label, side in zip(axes.get_xticklabels(), ("right", "left"), strict=True):
                label.set_horizontalalignment(side)  # away from each other: the 90 % may be narrow
            axes.tick_params(labelbottom=i == n - 1, labelleft=j == 0 < i, left=j < i)
            if i == n - 1:
                axes.set_xlabel(_named(column, v))
            if j == 0 < i:
                axes.set_ylabel(_named(row, result.variables[row]))
    lines, words = grid[0, 0].get_legend_handles_labels()
    grid[0, min(1, n - 1)].legend(lines, words, frameon=False, loc="upper left")
    return figure


def _named(name: str, v: SampledVariable) -> str:
    """The name with the unit that engineers use."""
    unit, _ = display_unit(v.unit)
    return f"{name}, {unit}" if unit else name


def _tick_labels(v: SampledVariable) -> list[str]:
    """The ticks in the unit that engineers use; an end that is a bound of the variable says so."""
    _, factor = display_unit(v.unit)
    labels = [f"{factor * value:.3g}" for value in _ticks(v)]
    for place, bound in enumerate((v.lower, v.upper)):
        if abs(v.box[place] / bound - 1) < AT_BOUND if bound else v.box[place] == bound:
            labels[place] += "\n(cut at bound)"
    return labels


def _edges(v: SampledVariable, count: int) -> Array:
    """Ends (count + 1,) of equal steps of the box, in the variable's own unit."""
    low, high = v.box
    steps = np.geomspace if v.log else np.linspace
    return np.asarray(steps(low, high, count + 1))


def _ticks(v: SampledVariable) -> list[float]:
    """The ends of the 90 %: between them there is no room for more."""
    return [v.low, v.high]


def _alone(axes: Axes, v: SampledVariable, name: str) -> None:
    """Draw the shares of one variable's draws in equal steps of its box, and those of a normal
    density with the linear error."""
    edges, share = _edges(v, len(v.density)), np.array(v.density)
    axes.stairs(share, edges, color=DRAWN_COLOUR, fill=True, alpha=0.3)
    axes.stairs(share, edges, color=DRAWN_COLOUR, lw=1.2, label="draws")
    x = np.log(edges) if v.log else edges
    at = (np.log(v.best), v.standard_error / v.best) if v.log else (v.best, v.standard_error)
    middle = (x[1:] + x[:-1]) / 2
    normal = np.exp(-0.5 * ((middle - at[0]) / at[1]) ** 2) / (at[1] * np.sqrt(2 * np.pi))
    points = np.exp(middle) if v.log else middle
    axes.plot(points, normal * (x[1] - x[0]), color=LINEAR_COLOUR, lw=1.2, ls="--", label="linear")
    for value, style, what in ((v.median, "-", "median"), (v.low, ":", "90 %"), (v.high, ":", "")):
        axes.axvline(value, color=GREY, lw=0.9, ls=style, label=what)
    axes.set_ylim(bottom=0)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.set_title(name, loc="left")


def _together(axes: Axes, counts: Array, across: SampledVariable, up: SampledVariable) -> None:
    """counts: rows along ``up``."""
    smooth = np.pad(counts, 1)
    for axis in (0, 1):  # by 1/4, 1/2, 1/4: neighbouring steps differ by chance
        smooth = smooth / 2 + (np.roll(smooth, 1, axis) + np.roll(smooth, -1, axis)) / 4
    smooth = smooth[1:-1, 1:-1]
    x, y = (_middles(v, PAIR_STEPS) for v in (across, up))
    rising = np.sort(smooth.ravel())[::-1]
    held = np.cumsum(rising) / max(rising.sum(), 1e-300)
    levels = [rising[np.searchsorted(held, share)] for share in WITHIN]
    if 0 < levels[0] < levels[1] < rising[0]:
        axes.contourf(x, y, smooth, [*levels, rising[0]], colors=[DRAWN_COLOUR], alpha=0.3)
        axes.contourf(x, y, smooth, [levels[1], rising[0]], colors=[DRAWN_COLOUR], alpha=0.4)
    axes.plot(across.best, up.best, "x", color="k", ms=5)
    if up.log:
        axes.set_yscale("log")
    axes.set_ylim(*up.box)
    axes.minorticks_off()
    axes.set_yticks(_ticks(up), _tick_labels(up))


def _middles(v: SampledVariable, count: int) -> Array:
    """Middles (count,) of the steps of the box, in the variable's own unit."""
    edges = _edges(v, count)
    return np.asarray(np.sqrt(edges[1:] * edges[:-1]) if v.log else (edges[1:] + edges[:-1]) / 2)
