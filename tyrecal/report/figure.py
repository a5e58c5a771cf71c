"""What all pictures share: canvas, type, colours."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from ..files import whole

DPI = 150
GREY = "0.45"
# Okabe and Ito: told apart by colour-blind readers; their yellow is left out, pale on paper
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")

MARKERS = "os^Dv<>P"

in_house_style = rc_context(
    {
        "font.size": 9,
        "axes.titlesize": 11,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "figure.dpi": DPI,
        "hatch.linewidth": 0.6,
    }
)


def new_figure(width: float, height: float, layout: str | None = "constrained") -> Figure:
    """An empty figure, its size in inches."""
    figure = Figure((width, height), dpi=DPI, layout=layout)  # type: ignore[arg-type]
    FigureCanvasAgg(figure)
    return figure


def headline(figure: Figure, words: str) -> None:
    """A title above all panels, from the left edge, in as many lines as the width asks for."""
    margin = 0.15 / figure.get_figwidth()
    title = figure.suptitle(words, x=margin, ha="left", fontsize=11)
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    room = (1 - 2 * margin) * figure.bbox.width
    for line in range(len(words), 10, -1):
        title.set_text(fill(words, line))
        if title.get_window_extent(renderer).width <= room:
            return


def save(figure: Figure, path: Path) -> None:
    """Write a PNG of 256 colours: a third of the size, and no difference to see."""
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    small = image.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    with whole(path) as partial:
        small.save(partial, "PNG")
