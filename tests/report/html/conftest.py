"""Pages of one folder after another have the same pictures: each is drawn once a session."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest
from markupsafe import Markup

from tyrecal.report.html import page

_drawn: dict[tuple[str, ...], Markup] = {}
_picture = page._picture


@pytest.fixture(autouse=True)
def drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def picture(
        found: Any, prefix: str, name: str, words: str, file: str, draw: partial[Any]
    ) -> Markup:
        key = prefix, name, words, repr(draw.args)
        if key not in _drawn:
            _drawn[key] = _picture(found, prefix, name, words, file, draw)
        return _drawn[key]

    monkeypatch.setattr(page, "_picture", picture)
