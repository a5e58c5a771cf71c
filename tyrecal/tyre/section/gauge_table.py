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
    """Half a section, by the gauges from one of its lines."""

    names: tuple[str, ...]  # of the lines, from the inner surface to the outer
    line: str  # the one that has points
    points: Array  # (station, 2), m
    # (line, station): distances from it, inwards negative, NaN where a line is absent, m
    gauges: Array
    labels: list[str]  # each station's region
    rigid: Array  # (station,) whether the rim holds it

    def csv(self) -> str:
        """The station table, in mm to the hundredth of a micrometre."""
        file = io.StringIO(newline="")
        write = csv.writer(file, lineterminator="\n").writerow
        header, columns = ["region"], []
        for name, gauge in zip(self.names, self.gauges, strict=True):
            own = name == self.line
            header += [f"{name}_r_mm", f"{name}_z_mm"] if own else [name + GAUGE]
            columns += list(self.points.T) if own else [abs(gauge)]
        write(["station", *header, "rigid"])
        for i, label in enumerate(self.labels):
            words = ["" if np.isnan(x[i]) else f"{1e3 * x[i]:.5f}" for x in columns]
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
