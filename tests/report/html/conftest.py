"""Pages of one folder after another have the same pictures: each is drawn once a session."""

from __future__ import annotations

import pickle
from functools import partial
from typing import Any

import pytest
from markupsafe import Markup
from matplotlib.figure import Figure

from tyrecal.report import sample
from tyrecal.report.html import parts
from tyrecal.report.html.parts import PageFigure
from tyrecal.studies.sample.result import SampleResult

ANY_CHAPTER = "any-chapter-"  # what ids begin with, in place of the chapter's own
_drawn: dict[tuple[str, bytes], PageFigure] = {}
_corners: dict[bytes, Figure] = {}
_picture, _draw_corner = parts.drawn, sample.draw_corner


@pytest.fixture(autouse=True)
def drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def picture(key: str, draw: partial[Any]) -> PageFigure:
        chapter, _, name = key.partition("-")
        known = name, pickle.dumps(draw.args)
        if known not in _drawn:
            _drawn[known] = _picture(f"{ANY_CHAPTER}{name}", draw)
        kept = _drawn[known]
        return PageFigure(Markup(kept.svg.replace(ANY_CHAPTER, f"{chapter}-")), kept.caption)

    def corner(sampled: SampleResult) -> Figure:
        """Drawn before the page takes the picture of it."""
        key = pickle.dumps(sampled)
        if key not in _corners:
            _corners[key] = _draw_corner(sampled)
        return _corners[key]

    monkeypatch.setattr(parts, "drawn", picture)
    monkeypatch.setattr(sample, "draw_corner", corner)
