"""Static stiffnesses over the load, one curve for each design and pressure."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from ..studies.stiffness import StiffnessResult, StiffnessRow
from .figure import COLOURS, GREY, in_house_style, new_figure
from .footprint import DESIGN_STYLES

STIFFNESSES = [key for key in StiffnessRow.columns() if "_per_" in key]


def figures(result: StiffnessResult) -> dict[str, Figure]:
    """The figure of a result by its name; none without rows."""
    return {"stiffness": draw_stiffness(result.rows)} if result.rows else {}


@in_house_style
def draw_stiffness(rows: Sequence[StiffnessRow]) -> Figure:
    """Vertical, lateral, longitudinal and torsional stiffness over the load. A pressure has a
    colour, a design a line style."""
    figure = new_figure(8.6, 6.2, caption="Static stiffnesses over the load")
    grid = figure.subplots(2, 2).ravel()
    pressures = sorted({row.pressure_kPa for row in rows})
    states = dict.fromkeys((row.design, row.pressure_kPa) for row in rows)
    for design, kPa in states:
        own = [row for row in rows if (row.design, row.pressure_kPa) == (design, kPa)]
        style = {"color": COLOURS[pressures.index(kPa) % len(COLOURS)], "ms": 4.5, "lw": 1.4}
        style |= DESIGN_STYLES.get(design, {}) | {"label": f"{design}, {kPa:g} kPa"}
        for axes, key in zip(grid, STIFFNESSES, strict=True):
            scale = StiffnessRow.columns()[key].per_unit  # from SI to the unit of the axis
            load = [row.load_N / 1e3 for row in own]
            axes.plot(load, [scale * getattr(row, key) for row in own], **style)
    for axes, key in zip(grid, STIFFNESSES, strict=True):
        top = 1.05 * axes.dataLim.ymax
        words = StiffnessRow.columns()[key].name.replace(" N", " stiffness, N")
        axes.set(xlabel="load, kN", ylabel=words, xlim=(0, None), ylim=(0, top))
        axes.grid(True, color="0.92", lw=0.6)
        axes.tick_params(color=GREY)
    grid[0].legend(frameon=False, loc="lower right")
    return figure
