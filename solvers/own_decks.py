"""A user's own decks in three dimensions: the data about them that go with their texts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .decks import save_texts
from .rings import ring_modes

Array = np.ndarray
OWN_DECKS_FILE = "own_decks.json"


@dataclass(frozen=True)
class DecksOfRun:
    """The decks of a run, in the order in which the solver runs them."""

    jobs: list[tuple[str, str]]  # each job, and the one that it continues (restart) or ""
    modes: int | None  # number requested of the last job, None if a range of frequencies decides
    pressure_Pa: float  # inflation pressure
    length_m: float  # metres per unit of length of the decks, 0.001 if they are in mm
    mass_kg: float  # kilograms per unit of mass of the decks, 1000 if they are in t
    mass_sets: list[str]  # names of the element sets that have a mass

    @property
    def last(self) -> str:
        """The job that finds the modes."""
        return self.jobs[-1][0]


def results(
    run: DecksOfRun, mass: float | None, eigenvalues: Array, points: Array, shapes: Array
) -> dict[str, Any]:
    """Results as plain data: each mode a real shape on the crown's nodes, about y as the axle.

    mass (None: not known), points (k, 3) and shapes (m, k, 3), x, y, z, per root of a mass, in the
    decks' units.
    """
    places, modes = ring_modes(eigenvalues, run.length_m * points, shapes / np.sqrt(run.mass_kg))
    return {
        "pressure_Pa": run.pressure_Pa,
        "mass_kg": mass and mass * run.mass_kg,
        "modes": modes,
        "gradients": {},
        "nodes": np.empty(0, int),
        "points": places,
        "displacement": np.empty((0, 3)),
    }


def save(request: Mapping[str, Any], folder: Path) -> list[Path]:
    """Write a request's data about own decks into a run folder; nothing where it has none."""
    if "own_decks" not in request:
        return []
    text = json.dumps(asdict(DecksOfRun(**request["own_decks"])), indent=1) + "\n"
    return save_texts({OWN_DECKS_FILE: text}, folder)


def load(folder: Path) -> DecksOfRun | None:
    """Load the own decks that were saved in a run folder; None if it has none. Raises OSError."""
    path = folder / OWN_DECKS_FILE
    return DecksOfRun(**json.loads(path.read_text(encoding="utf-8"))) if path.exists() else None
