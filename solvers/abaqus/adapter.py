"""ABAQUS behind the tool's evaluator: write, run, read. Imports nothing of the tool."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ..errors import Refused, RunFailed
from .dat import read_dat
from .evidence import checked_modes
from .launch import run_job
from .options import load, read_options
from .question import read_question
from .rings import check_revolved, components, cylindrical

JOB, OLDJOB = "modes", "inflate"


class Decks(Protocol):
    """What the tool hands over; ``options``: the solver's, from the case; ``request``: among what
    is asked, of a user's deck ``own_deck`` with its units."""

    options: Mapping[str, Any]
    request: Mapping[str, Any]

    def texts(self, dialect: str) -> dict[str, str]:
        """File name to text."""


class Abaqus:
    """Adapter of ABAQUS/Standard (see the tool's solver contract). Unconfirmed on an ABAQUS.

    ``command``: words that start it.
    """

    name = "abaqus"
    dialect = "abaqus"
    capabilities = frozenset({"modes", "vibration_modulus", "spindle", "own_deck"})
    refusals = (Refused,)
    failures = (RunFailed,)

    def __init__(self) -> None:
        self.command = ["abaqus"]

    @cached_property
    def version(self) -> str:
        """Release of the program, "unknown" where there is none."""
        try:
            said = subprocess.run(
                [*self.command, "information=release"],
                capture_output=True,
                text=True,
                timeout=60,
                stdin=subprocess.DEVNULL,
            ).stdout
        except (OSError, subprocess.TimeoutExpired):
            return "unknown"
        release = re.search(r"abaqus\D*(\d[\w.\-]*)", said, re.IGNORECASE)
        return release[1] if release else "unknown"

    def write(self, decks: Decks, folder: Path) -> list[Path]:
        """Write the decks and, beside them, the case's options. Raises ``refusals``."""
        program = self.command if self.version == "unknown" else []
        units = decks.request.get("own_deck", {})
        paths = [read_options(decks.options, **units).save(folder, program)]
        for name, text in decks.texts("own deck" if units else self.dialect).items():
            paths.append(folder / name)
            paths[-1].parent.mkdir(parents=True, exist_ok=True)
            paths[-1].write_text(text, encoding="utf-8", newline="")
        read_question(folder / f"{JOB}.inp")  # refused before it runs, not after
        return paths

    def run(self, folder: Path, time_limit_s: float) -> None:
        """Run both jobs, ``time_limit_s`` for the two together. Raises ``failures``."""
        options = load(folder)
        spent = run_job(OLDJOB, None, self.command, options, folder, time_limit_s)
        run_job(JOB, OLDJOB, self.command, options, folder, max(time_limit_s - spent, 0.0))

    def read(self, folder: Path) -> dict[str, Any]:
        """Results as plain data: each mode a real shape on the crown's nodes.

        Raises RunFailed where the results are stale, not whole, or no result.
        """
        asked = read_question(folder / f"{JOB}.inp")
        table = read_dat(folder / f"{JOB}.dat")
        found = checked_modes(folder / f"{JOB}.fil", asked.modes, table)
        units = load(folder)
        points = cylindrical(units.length_m * found.coordinates)
        check_revolved(points)
        shapes = components(found.displacement, points[:, 1])
        return {
            "pressure_Pa": asked.pressure * units.mass_kg / units.length_m,
            "mass_kg": table.mass and table.mass * units.mass_kg,
            "modes": [
                {
                    "frequency_Hz": float(np.sqrt(value) / (2 * np.pi)),
                    "multiplicity": 1,
                    "displacement": shape / np.sqrt(mass * units.mass_kg),
                }
                for value, mass, shape in zip(found.eigenvalues, found.masses, shapes, strict=True)
            ],
            "gradients": {},
            "nodes": np.empty(0, int),
            "points": points,
            "displacement": np.empty((0, 3)),
        }
