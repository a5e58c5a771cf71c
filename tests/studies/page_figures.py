"""Figures of the record as the documents print them: in other units, as changes, in rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from .page_steps import LOADS_N, Record


def change(record: Record, step: str, label: str) -> float:
    """Per cent, from the initial design."""
    return 100 * record[step][label] / record["initial"][label] - 100


def of(step: str, *keys: str | tuple[str, float]) -> Callable[[Record], list[float]]:
    """Recorded figures, each times its factor."""
    pairs = [(key, 1.0) if isinstance(key, str) else key for key in keys]
    return lambda record: [record[step][key] * factor for key, factor in pairs]


def pressed(step: str, what: str) -> Callable[[Record], list[float]]:
    """Figures at every load."""
    return of(step, *(f"{what} at {load}" for load in LOADS_N))


def rises(record: Record, what: str) -> list[float]:
    """Changes from the initial design to the paper's optimum, %, at every load."""
    after, before = (pressed(step, what)(record) for step in ("pressed optimum", "pressed"))
    return [100 * a / b - 100 for a, b in zip(after, before, strict=True)]


def too_low(record: Record) -> list[float]:
    """Least and largest shortfall, %, of the six predicted frequencies of the real tyre."""
    figures = record["labels"]
    off = [100 - 100 * figures[f"{hertz} Hz"] / hertz for hertz in (114, 137, 165, 196, 228, 260)]
    return [min(off), max(off)]


def distance(record: Record, step: str, hertz: Sequence[float]) -> float:
    """Equation (1) to the paper's frequencies, Hz."""
    twice = [1 + (not label.startswith("[0,0]")) for label in LABELS]
    off = (record[step][label] - f for label, f in zip(LABELS, hertz, strict=True))
    return math.sqrt(sum(w * d**2 for w, d in zip(twice, off, strict=True)))


AXIAL = "[0,0] axial"
LABELS = (AXIAL, "[0,0] torsional")
LABELS += ("[1,1]", "[1,0]", "[2,1]", "[2,0]", "[3,0]", "[3,1]", "[4,0]")
MEASURED_HZ = (31.7, 35.0, 37.8, 58.5, 66.1, 79.5, 97.6, 102.7, 115.9)
CHANGED = (AXIAL, "[1,1]", "[2,1]", "[3,1]", "[1,0]")  # changes of both columns' table

VARIABLES = (("A_belt", 1e7), "A_belt %", ("A_carcass", 1e8), "A_carcass %")
