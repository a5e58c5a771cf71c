"""The main case with a tyre's crown: as wide, as flat, and with its grooves spread.

    python -m tests.studies.tyre_crown FOLDER
    tyrecal fit FOLDER/crown.yaml --no-pictures --output FOLDER/fit
    tyrecal footprint FOLDER/crown.yaml --fitted FOLDER/fit/fit.json --output FOLDER/patch

All lines of the section are raised, so that the outer one lies on a circle of ``CROWN_RADIUS_M``
up to the edge of a tread of ``TREAD_WIDTH_M``, and fall back to the case's own in the upper
sidewall; gauges stay nearly. The tread between the outer belt and the road has the stiffness and
the mass of its land alone.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from ..conftest import CASES

CROWN_RADIUS_M = 0.5
TREAD_WIDTH_M = 0.170  # between the shoulders; a 235's is 0.7 to 0.8 of its section width
VOID = 0.31  # of the tread's area, a mean of summer tyres'
TREAD = """  tread:
    kind: rubber
    C10_Pa: {C10:.6g}
    C01_Pa: 0.0
    D1_per_Pa: {D1:.6g}
    moduli: long_term
    prony: [{{g: 0.3, k: 0.0, tau_s: 0.1}}]
    density_kg_per_m3: {density:.6g}
  belt_cord:
"""


def raised(rows: list[dict[str, str]]) -> list[dict[str, str]]:
    """The section's stations, flatter at the crown."""
    z, r = (np.array([float(row[f"outer_{name}_mm"]) for row in rows]) for name in "zr")
    half, radius = 1e3 * TREAD_WIDTH_M / 2, 1e3 * CROWN_RADIUS_M
    circle = r[0] - radius + np.sqrt(radius**2 - np.minimum(z, half) ** 2)
    rise = circle - r
    edge = int(np.searchsorted(z > half, True))
    last = max(i for i, row in enumerate(rows) if row["region"] == "upper_sidewall")
    fade = (1 + np.cos(np.pi * (np.arange(len(rows)) - edge) / (last - edge))) / 2
    rise[edge:] = rise[edge - 1] * fade[edge:]
    rise[last:] = 0.0
    places = [[key for key in row if key.endswith("_r_mm") and row[key]] for row in rows]
    return [
        row | {key: f"{float(row[key]) + up:.5f}" for key in keys}
        for row, keys, up in zip(rows, places, rise, strict=True)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    with (CASES / "p235_75r17.csv").open(newline="") as file:
        rows = raised(list(csv.DictReader(file)))
    with (folder / "crown.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    land = 1 - VOID
    tread = TREAD.format(C10=1e6 * land, D1=5.085e-8 / land, density=1100 * land)
    text = (CASES / "p235_75r17.yaml").read_text()
    for before, after in (
        ("stations: p235_75r17.csv", "stations: crown.csv"),
        ("  belt_cord:\n", tread),
        (
            "  - {material: rubber}\n",
            "  - {material: rubber}\n"
            "  - {material: tread, regions: [crown], between: [belt2, outer]}\n",
        ),
    ):
        assert text.count(before) == 1
        text = text.replace(before, after)
    (folder / "crown.yaml").write_text(text)


if __name__ == "__main__":
    main()
