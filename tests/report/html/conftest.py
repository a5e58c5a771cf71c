"""Pages of one folder after another have the same pictures: each is drawn once a session."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest
from markupsafe import Markup
from matplotlib.figure import Figure

from tyrecal.report import sample
from tyrecal.report.html import page
from tyrecal.studies.sample.result import SampleResult

ANY_CHAPTER = "any-chapter-"  # what ids begin with, in place of the chapter's own
_drawn: dict[tuple[str, ...], Markup] = {}
_corners: dict[str, Figure] = {}
_picture, _draw_corner = page._picture, sample.draw_corner


@pytest.fixture(autouse=True)
def drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def picture(
        result: Any, prefix: str, name: str, words: str, file: str, draw: partial[Any]
    ) -> Markup:
        key = name, words, repr(draw.args)
        if key not in _drawn:
            _drawn[key] = _picture(result, ANY_CHAPTER, name, words, file, draw)
        return Markup(_drawn[key].replace(ANY_CHAPTER, prefix))

    def corner(sampled: SampleResult) -> Figure:
        """Drawn before the page takes the picture of it."""
        key = repr(sampled)
        if key not in _corners:
            _corners[key] = _draw_corner(sampled)
        return _corners[key]

    monkeypatch.setattr(page, "_picture", picture)
    monkeypatch.setattr(sample, "draw_corner", corner)
