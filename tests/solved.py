"""Answers of the bundled solver, kept for a session: tests of what stands above it solve once.

Tests of commands, fits and studies ask for the same few tyres again and again. ``solved_once``
gives the files that the same decks had led to; counts of runs are the evaluator's, and stay. Tests
of the solver itself, and of failures, do without: what fails is run again.
"""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import pytest
from tyrecal_solvers.bundled.adapter import Bundled

MOST = 256  # answers that are kept, of some 100 kB each
_kept: dict[str, dict[str, bytes]] = {}
_run = Bundled.run


def _files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def _run_or_recall(solver: Bundled, folder: Path, time_limit_s: float) -> None:
    given = _files(folder)
    key = sha256(repr((time_limit_s, given)).encode()).hexdigest()
    if key not in _kept:
        _run(solver, folder, time_limit_s)
        if len(_kept) >= MOST:
            del _kept[next(iter(_kept))]
        _kept[key] = {name: text for name, text in _files(folder).items() if name not in given}
    for name, content in _kept[key].items():
        (folder / name).write_bytes(content)


@pytest.fixture(autouse=True)
def solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Bundled, "run", _run_or_recall)
