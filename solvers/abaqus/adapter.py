"""ABAQUS behind the tool's evaluator: write, run, read. Imports nothing of the tool."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from .. import own_decks
from ..decks import WrittenDecks, save_texts
from ..errors import Refused, RunFailed
from ..process import program_version
from ..rings import about_axle
from .dat import DatTable, read_dat
from .evidence import checked_modes
from .launch import run_job
from .options import load, read_options
from .question import section_jobs


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
