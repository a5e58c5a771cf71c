"""Variations of the shipped case on a mesh as coarse as can be.

Reports as `run_case` makes them, for what only reads them.
Record every run of the solver with its process; a Dask worker loads this module first.
"""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path
from typing import Any

import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.simulate.evaluate.store import key_of
from tyrecal.tyre.effects import catalogue

from ..conftest import CASES

COARSE = """
    small:
      elements: {crown: 3, upper_sidewall: 2, lower_sidewall: 2, bead: 1}
      rows: [1, 1, 1, 1]
    default:
"""
EDITS = (
    ("\n    default:\n", COARSE),
    ("level: default", "level: small"),
    ("static_increments: 10", "static_increments: 4"),
)


def vary(folder: Path, count: int, coarse: bool = True) -> list[Path]:
    """``count`` cases of different pressures in ``folder``, and the station table beside them."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(CASES / "p235_75r17.csv", folder)
    text = (CASES / "p235_75r17.yaml").read_text()
    for old, new in EDITS if coarse else ():
        assert text.count(old) == 1
        text = text.replace(old, new)
    paths = [folder / f"tyre_{i:02d}.yaml" for i in range(count)]
    for i, path in enumerate(paths):
        path.write_text(text.replace("pressure_kPa: 240.0", f"pressure_kPa: {240 + i / 5}"))
    return paths


def few_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave three effects in the catalogue, for the duration of a test."""
    for id in [*catalogue()]:
        if id not in ("rim_width", "bead_filler", "spindle_radial"):
            monkeypatch.delitem(catalogue(), id)


def measured_elsewhere(path: Path) -> Path:
    """Put the case's targets in a file beside it; the file."""
    file = path.with_suffix(".csv")
    shutil.copy(CASES / "p235_75r17_wheeler.csv", file)
    text = path.read_text()
    start = text.index("  source:", text.index("\ntargets:"))
    end = text.index("\n\n", start)
    path.write_text(f"{text[:start]}  file: {file.name}{text[end:]}")
    return file


def nearly_certain(path: Path) -> Path:
    """Make the section of a case exact, and all but two of its numbers; a sample or diagnosis of it
    takes a third of the time. Return the path."""
    text = path.read_text().replace("known_from: size_code", "known_from: exact")
    start, end = text.index("  rubber_density: {"), text.index("  rim_width: {")
    path.write_text(text[:start] + text[end:])
    return path


def poison(path: Path) -> None:
    """Let the tyre spin so fast, 280 rad/s, that it is not stable; its usual values end at 300."""
    path.write_text(path.read_text() + "\nspin_rad_per_s: 280.0\n")


def entry(
    status: str = "good", cause: str | None = None, words: str | None = None, **quantities: float
) -> dict[str, Any]:
    """A study's entry."""
    return {"status": status, "cause": cause, "words": words, "quantities": quantities}


def report(name: str, **studies: dict[str, Any]) -> dict[str, Any]:
    """A case's report; a second a study."""
    facts = {
        "started": "2026-01-02T03:04:05+00:00",
        "host": "node-1",
        "solver": "bundled 1.0.0",
        "seconds": dict.fromkeys(studies, 1.0),
        "solver_runs": 9,
        "answered_from_record": 0,
    }
    return {"name": name, "provenance": {}, "studies": studies, "facts": facts}


DELAY_S = 0.05  # so that a run can be interrupted


def dask_setup(worker: Any) -> None:
    """Called by the worker."""
    plain, log = Bundled.run, Path(os.environ["RUNS"])

    def run(self: Bundled, folder: Path, time_limit_s: float) -> None:
        with log.open("a") as file:
            file.write(f"{os.getpid()} {key_of(folder, self)}\n")
        time.sleep(DELAY_S)
        plain(self, folder, time_limit_s)

    Bundled.run = run  # type: ignore[method-assign]
