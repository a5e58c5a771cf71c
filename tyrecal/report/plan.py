"""The chance of finding each effect, step by step of a planned test."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..studies.plan.result import PlanResult
from .figure import in_house_style, new_figure


def figures(result: PlanResult) -> dict[str, Figure]:
    """Figures of a plan, by name."""
    return {"plan_chances": draw_chances(result)}


@in_house_style
def draw_chances(result: PlanResult) -> Figure:
    """Chance that each effect is found, a row an effect, a column a step, darker where larger."""
    chances = np.array([each.chance for each in result.effects])
    steps, count = len(result.steps), len(chances)
    figure = new_figure(3.2 + 0.75 * steps, 1.6 + 0.24 * count)
    axes = figure.subplots()
    edges = np.arange(steps + 1) - 0.5, np.arange(count + 1) - 0.5
    axes.pcolormesh(*edges, chances, cmap="Blues", vmin=0.0, vmax=1.0)
    axes.invert_yaxis()
    for (row, column), chance in np.ndenumerate(chances):
        colour = "white" if chance > 0.6 else "black"
        axes.text(column, row, f"{chance:.2f}", ha="center", va="center", color=colour, size=7)
    axes.set_yticks(range(count), [each.id for each in result.effects])
    hours = [f"{k}\n{each.total_hours:g} h" for k, each in enumerate(result.steps, 1)]
    axes.set_xticks(range(steps), hours)
    axes.set_xlabel("step of the plan, and hours up to there")
    axes.tick_params(length=0)
    axes.set_title("chance that an effect is found", loc="left")
    return figure
