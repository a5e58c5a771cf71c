"""A solver of a few lines, to test what the evaluator and the record do with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.evaluate.store import Store
from tyrecal.tyre.load import load_case

from ..conftest import CASES

CASE = load_case(CASES / "p235_75r17.yaml")


class Failed(RuntimeError):
    """A failure that knows its cause."""

    def __init__(self, cause: str):
        super().__init__(f"said: {cause}")
        self.cause = cause


class StandIn:
    """Writes the variables, answers with a mode of 50 Hz, or fails with ``cause``."""

    name, version, dialect = "stand-in", "1", "abaqus"
    capabilities = frozenset({"modes"})
    refusals: tuple[type[Exception], ...] = ()
    failures = (Failed,)

    def __init__(self, cause: str = ""):
        self.cause, self.runs = cause, 0

    def write(self, decks: Any, folder: Path) -> list[Path]:
        """Write one file of the run."""
        path = folder / "deck.inp"
        path.write_text(repr(sorted(decks.values.items())))
        return [path]

    def run(self, folder: Path, time_limit_s: float) -> None:
        """Count."""
        self.runs += 1
        if self.cause:
            raise Failed(self.cause)

    def read(self, folder: Path) -> dict[str, Any]:
        """A fresh answer, of awkward numbers."""
        nodes = np.arange(3)
        return {
            "pressure_Pa": 240000.0,
            "mass_kg": np.float32(0.1),
            "modes": [
                {
                    "frequency_Hz": np.nextafter(50.0, 51.0),
                    "multiplicity": 2,
                    "n": np.int64(2),
                    "amplitude": (np.ones((3, 3)) * (1 / 3 + 1j * np.pi)).astype(np.complex64),
                }
            ],
            "gradients": {"C10": [1e-300], "A_belt": [0.1 + 0.2]},
            "nodes": nodes,
            "points": np.asfortranarray(np.arange(6).reshape(3, 2) / 7),
            "displacement": np.full((3, 3), 1e-3),
        }


def evaluator(folder: Path, solver: StandIn | None = None) -> Evaluator:
    """A evaluator to a stand-in with a record, both under ``folder``."""
    solver = solver or StandIn()
    return Evaluator(
        TyreDesign(CASE), folder=folder / "runs", store=Store(folder / "record"), _solver=solver
    )


def ask(evaluator: Evaluator, value: float = 1e6) -> Evaluation:
    """Evaluate one design."""
    return evaluator.evaluate(Question({"C10": value}))
