"""Pictures as their tests see them."""

from __future__ import annotations

from types import ModuleType

import pytest
from matplotlib.figure import Figure


def watched(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that ``module`` will save, as it saves them."""
    figures: list[Figure] = []
    save = module.save
    monkeypatch.setattr(module, "save", lambda f, path: (figures.append(f), save(f, path)))
    return figures
