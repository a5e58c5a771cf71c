"""Answers of the bundled solver, kept for a session: tests of what stands above it solve once.

Tests of commands, fits and studies ask for the same few tyres again and again. ``solved_once``
gives the files that the same decks had led to, in any worker; counts of runs are the evaluator's,
and stay. Tests of the solver itself, and of failures, do without: what fails is run again.

`calibrate` has a case's problem and the fit of it in one call.
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.fit.calibrate import Fit
from tyrecal.studies.fit.calibrate import calibrate as calibrate_problem
from tyrecal.studies.fit.prior import PriorProblem
from tyrecal.studies.fit.problem import FitNotify, Problem
from tyrecal.tyre.case import LoadedCase

run_anew = Bundled.run


def _files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def run_or_recall(kept: Path) -> Callable[[Bundled, Path, float], None]:
    """`Bundled.run` with its answers in the folder ``kept``."""

    def run(solver: Bundled, folder: Path, time_limit_s: float) -> None:
        given = _files(folder)
        path = kept / sha256(repr((time_limit_s, given)).encode()).hexdigest()
        if not path.exists():
            run_anew(solver, folder, time_limit_s)
            answer = {name: text for name, text in _files(folder).items() if name not in given}
            written = path.with_suffix(f".{os.getpid()}")
            written.write_bytes(pickle.dumps(answer))
            written.replace(path)  # another worker never sees half of it
        for name, content in pickle.loads(path.read_bytes()).items():
            (folder / name).write_bytes(content)

    return run


@pytest.fixture(autouse=True)
def solved_once(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Solve each tyre once for all tests of the file that imports this."""
    recall(monkeypatch, tmp_path_factory)


def recall(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Let the bundled solver recall what it has solved in this session."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent  # all workers share it
    kept = folder / "solved"
    kept.mkdir(exist_ok=True)
    monkeypatch.setattr(Bundled, "run", run_or_recall(kept))


def calibrate(
    case: LoadedCase,
    evaluator: Evaluator,
    method: str = "slsqp",
    *,
    fixed: Mapping[str, float] | None = None,
    notify: FitNotify | None = None,
    jobs: int = 1,
    prior: bool = False,
    **options: Any,
) -> Fit:
    """The fit of a case's problem, or with ``prior`` of its problem with what is known before."""
    kind = PriorProblem if prior else Problem
    return calibrate_problem(kind(case, evaluator, fixed, notify, jobs), method, **options)
