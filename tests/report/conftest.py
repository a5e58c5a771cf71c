"""No picture that a test of this folder draws cuts a text or prints one over another."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from .watched import every_text_readable


@pytest.fixture(autouse=True)
def written(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """All that pictures say in this test."""
    with every_text_readable(monkeypatch) as texts:
        yield texts
