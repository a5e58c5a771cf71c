"""A section as its carcass and gauges: what ``tyrecal init`` writes and an engineer edits."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np

from .section import GAUGE, Section, from_gauges, regions_of

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class GaugeTable:
    """Half a section. names: of the lines, from the inner surface to the outer; line: the one
    that has points (station, 2), m; gauges (line, station): distances from it, inwards negative,
    NaN where a line is absent, m; labels: each station's region; rigid: held by the rim."""

    names: tuple[str, ...]
    line: str
    points: Array
    gauges: Array
    labels: list[str]
    rigid: Array

    def csv(self) -> str:
        """The station table, in mm to the tenth of a micrometre."""
        file = io.StringIO(newline="")
        write = csv.writer(file, lineterminator="\n").writerow
        columns = [
            [f"{n}_r_mm", f"{n}_z_mm"] if n == self.line else [n + GAUGE] for n in self.names
        ]
        write(["station", "region", *sum(columns, []), "rigid"])
        for i, label in enumerate(self.labels):
            numbers = [
                [*self.points[i]] if name == self.line else [abs(self.gauges[k, i])]
                for k, name in enumerate(self.names)
            ]
            words = ["" if np.isnan(x) else f"{1e3 * x:.4f}" for x in sum(numbers, [])]
            write([i, label, *words, int(self.rigid[i])])
        return file.getvalue()

    def section(self) -> Section:
        """The same as ``read_section`` makes of ``csv``, but for its rounding."""
        return Section(
            self.names,
            from_gauges(self.points, self.gauges),
            regions_of(self.labels, list(self.rigid)),
            self.rigid,
        )
