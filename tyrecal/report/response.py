"""Response functions: magnitude and phase over frequency, measured ones dotted."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..studies.response import FrfResult
from .figure import COLOURS, in_house_style, new_figure


@in_house_style
def draw_responses(result: FrfResult) -> dict[str, Figure]:
    """The figure frf: a column for each unit, magnitude above phase."""
    units = list(dict.fromkeys(each.unit for each in result.functions))
    figure = new_figure(
        1.0 + 4.4 * len(units), 5.4, caption="Response functions: magnitude and phase"
    )
    grid = figure.subplots(2, len(units), sharex=True, squeeze=False, height_ratios=[2, 1])
    for (upper, lower), unit in zip(grid.T, units, strict=True):
        for i, each in enumerate(f for f in result.functions if f.unit == unit):
            values, colour = each.values, COLOURS[i % len(COLOURS)]
            size = np.where(np.abs(values) > 0, np.abs(values), np.nan)
            label = f"{each.respond} over {each.excite}"
            label += "" if each.frac is None else f" (measured: dotted, FRAC {each.frac:.2f})"
            upper.semilogy(result.frequency_Hz, size, color=colour, lw=1.2, label=label)
            lower.plot(result.frequency_Hz, np.degrees(np.angle(values)), color=colour, lw=1.0)
            if len(each.measured):
                style = {"color": colour, "lw": 1.0, "ls": ":"}
                upper.semilogy(result.frequency_Hz, np.abs(each.measured), **style)
                lower.plot(result.frequency_Hz, np.degrees(np.angle(each.measured)), **style)
        upper.set_ylabel(f"{each.quantity}, {unit}")
        upper.legend(frameon=False, fontsize=7)
        lower.set(xlabel="frequency, Hz", ylabel="phase, degrees", ylim=(-185, 185))
        lower.set_yticks([-180, -90, 0, 90, 180])
    return {"frf": figure}
