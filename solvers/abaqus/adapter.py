"""ABAQUS behind the tool's evaluator: write, run, read. Imports nothing of the tool.

Number of modes and pressure of a section's jobs are read from the modes deck itself, because a
user's own template may change them.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .. import own_decks
from ..decks import WrittenDecks, save_texts
from ..errors import Refused, RunFailed
from ..language.text import WHOLE_DECK, DeckError, read_keywords
from ..own_decks import DecksOfRun
from ..process import program_version
from ..rings import about_axle
from .evidence import DatTable, checked_modes, read_dat
from .launch import load, read_options, run_job

OLDJOB, JOB = "inflate", "modes"


def section_jobs(folder: Path) -> DecksOfRun:
    """The job that inflates and the one that finds the modes. Raises DeckError, OSError."""
    units, pressure, path = load(folder), 0.0, folder / f"{JOB}.inp"
    counts = list[int | None]()
    for k in read_keywords(path.read_text(encoding="utf-8"), path.stem):
        if k.name == "FREQUENCY":
            row = k.only_row()
            counts.append(None if row.text(1) or row.text(2) else row.integer(0))
        elif k.name == "DSLOAD":
            pressure = max(row.number(2) for row in k.rows)
    if len(counts) != 1:
        words = f"{path.name} needs one *FREQUENCY step, it has {len(counts)}"
        raise DeckError(WHOLE_DECK, words)
    pressure_Pa = pressure * units.mass_kg / units.length_m
    jobs = [(OLDJOB, ""), (JOB, OLDJOB)]
    return DecksOfRun(jobs, counts[0], pressure_Pa, units.length_m, units.mass_kg, [])


class Abaqus:
    """Adapter of ABAQUS/Standard (see the tool's solver contract). Unconfirmed on an ABAQUS.

    ``command``: words that start it.
    """

    name = "abaqus"
    dialect = "abaqus"
    capabilities = frozenset({"modes", "vibration_modulus", "spindle", "own_deck", "own_decks"})
    refusals = (Refused,)
    failures = (RunFailed,)

    def __init__(self) -> None:
        self.command = ["abaqus"]

    @cached_property
    def version(self) -> str:
        """Release of the program, "unknown" where there is none."""
        command = [*self.command, "information=release"]
        return program_version(command, r"abaqus\D*(\d[\w.\-]*)", 60.0)

    def write(self, decks: WrittenDecks, folder: Path) -> list[Path]:
        """Write the decks and, next to them, the case's options. Raises ``refusals``."""
        units = decks.request.get("own_deck", {})  # length_m, mass_kg
        paths = read_options(decks.options, **units).save(folder)
        paths += (own := own_decks.save(decks.request, folder))
        paths += save_texts(decks.texts("own deck" if units else self.dialect), folder)
        if not own:
            section_jobs(folder)  # refused before it runs, not after
        return paths

    def run(self, folder: Path, time_limit_s: float) -> None:
        """Run all jobs, ``time_limit_s`` for them together. Raises ``failures``."""
        options, run = load(folder), own_decks.load(folder) or section_jobs(folder)
        for job, before in run.jobs:  # before: the job that it continues, or ""
            left = max(time_limit_s, 0.0)
            time_limit_s -= run_job(job, before or None, self.command, options, folder, left)

    def read(self, folder: Path) -> dict[str, Any]:
        """Results as plain data: each mode a real shape of unit modal mass on the crown's
        nodes. Raises RunFailed where the results are stale, not whole, or no result."""
        own = own_decks.load(folder)
        run = own or section_jobs(folder)
        table = read_dat(folder / f"{run.last}.dat")
        if own:  # the mass is printed with the model, not where a job goes on
            tables = [read_dat(folder / f"{each}.dat") for each, _ in own.jobs]
            masses = [each.mass for each in tables if each.mass is not None]
            table = DatTable(table.frequencies_Hz, masses[-1] if masses else None)
        raw_modes = checked_modes(folder / f"{run.last}.fil", run.modes, table)
        points = raw_modes.coordinates
        shapes = raw_modes.displacement / np.sqrt(raw_modes.masses)[:, None, None]
        if own:  # whose axle may be anywhere
            points, turn = about_axle(points)
            shapes = shapes @ turn.T
        return own_decks.results(run, table.mass, raw_modes.eigenvalues, points, shapes)
