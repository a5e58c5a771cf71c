"""The jobs of a section's deck. Number of modes and pressure are read from the modes deck itself,
because a user's own template may change them."""

from __future__ import annotations

from pathlib import Path

from ..language.text import WHOLE_DECK, DeckError, read_keywords
from ..own_decks import DecksOfRun
from .options import load

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
