"""No picture that a test of this folder draws cuts a text or prints one over another."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations
from types import ModuleType

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

SLACK = 1.0  # pixels by which boxes of texts may pass an edge, or each other


def watched(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that ``module`` will save, as it saves them."""
    figures: list[Figure] = []
    save = module.save
    monkeypatch.setattr(module, "save", lambda f, path: (figures.append(f), save(f, path)))
    return figures


@contextmanager
def every_text_readable(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """While it lasts, a picture fails that cuts a text or prints one over another.

    The texts are those that the renderer really draws, with its own boxes round them. Gives all
    that was written.
    """
    drawn: dict[Text, None] = {}
    texts: list[str] = []
    draw_text, draw_figure = Text.draw, FigureCanvasAgg.draw

    def text(self: Text, *rest: object, **more: object) -> None:
        if self.get_visible() and self.get_text().strip():
            drawn[self] = None
        draw_text(self, *rest, **more)

    def figure(canvas: FigureCanvasAgg) -> None:
        drawn.clear()
        draw_figure(canvas)
        texts.extend(each.get_text() for each in drawn)
        assert not any("\\math" in words for words in texts)
        check(canvas.figure, list(drawn))

    monkeypatch.setattr(Text, "draw", text)
    monkeypatch.setattr(FigureCanvasAgg, "draw", figure)
    yield texts


def check(figure: Figure, texts: list[Text]) -> None:
    """Every text inside the figure, and none on another."""
    boxes = [(each.get_text(), Text.get_window_extent(each)) for each in texts]
    edge = figure.bbox
    for string, box in boxes:
        inside = min(box.x0, box.y0, edge.x1 - box.x1, edge.y1 - box.y1)
        assert inside >= -SLACK, f"cut by {-inside:.0f} pixels: {string!r}"
    for (one, a), (other, b) in combinations(boxes, 2):
        across = min(a.x1, b.x1) - max(a.x0, b.x0)
        up = min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(across, up) <= SLACK, f"{one!r} and {other!r} overlap, {across:.0f} by {up:.0f}"


@pytest.fixture(autouse=True)
def written(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """All that pictures say in this test."""
    with every_text_readable(monkeypatch) as texts:
        yield texts
