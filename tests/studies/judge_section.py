"""A tyre's section from its table of stations, for judges that share nothing else with the tool."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

LINES = ("inner", "ply", "belt1", "belt2", "outer")


def section(path: str, crown: int, sidewall: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (line, column, 2) of the whole section, two columns an element, and which columns have
    belts."""
    with Path(path).open(newline="") as file:
        rows = list(csv.DictReader(file))
    number = lambda row, key: float(row[key] or "nan") * 1e-3
    table = np.array([[[number(r, f"{k}_{c}_mm") for c in "rz"] for r in rows] for k in LINES])
    last_belt = int(np.flatnonzero(~np.isnan(table[2, :, 0])).max())
    first_held = next(i for i, row in enumerate(rows) if row["rigid"] == "1")
    for k in (2, 3):  # beyond the belts: at the same share of the gap between ply and outside
        gap = table[4, last_belt] - table[1, last_belt]
        share = (table[k, last_belt] - table[1, last_belt]) @ gap / (gap @ gap)
        beyond = slice(last_belt + 1, None)
        table[k, beyond] = table[1, beyond] + share * (table[4, beyond] - table[1, beyond])
    steps = np.concatenate(
        [
            np.linspace(0, last_belt, 2 * crown + 1),
            np.linspace(last_belt, first_held, 2 * sidewall + 1)[1:],
        ]
    )
    at = np.arange(len(rows))
    half = np.empty((len(LINES), len(steps), 2))
    for part in (steps <= last_belt, steps >= last_belt):
        low, high = int(steps[part][0]), int(steps[part][-1])
        own = slice(low, high + 1)
        half[:, part] = CubicSpline(at[own], table[:, own], axis=1)(steps[part])
    whole = np.concatenate([half[:, :0:-1] * [1, -1], half], 1)
    belted = np.concatenate([steps[:0:-1], steps]) <= last_belt + 1e-9
    return whole, belted
