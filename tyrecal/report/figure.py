"""What all pictures share: canvas, type, colours."""

from __future__ import annotations

from pathlib import Path

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

DPI = 150
GREY = "0.45"
# Okabe and Ito: told apart by colour-blind readers; yellow is left out, pale on paper
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
TYPE = {"font.size": 9, "axes.titlesize": 11, "axes.spines.top": False, "axes.spines.right": False}


def new_figure(width: float, height: float, layout: str | None = "constrained") -> Figure:
    """An empty figure, inches."""
    figure = Figure((width, height), DPI, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a PNG, its colours reduced to 256: a third of the size and no difference to see."""
    from PIL import Image

    figure.canvas.draw()
    Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB").quantize(256).save(path)
