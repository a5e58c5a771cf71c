"""The tyre's half section as a station table: lines through the thickness, station by station."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

Array = np.ndarray


class SectionError(ValueError):
    """A station table that is not a section; ``line`` is the 1-based line of the file or 0."""

    def __init__(self, message: str, line: int = 0):
        super().__init__(message)
        self.line = line


@dataclass(frozen=True, eq=False)
class Section:
    """Half a section, uninflated, from the crown's centre (z = 0) to the bead.

    names: the lines from the inner surface to the outer, e.g. inner, ply, belt1, belt2, outer;
    points (line, station, 2): r and z in m, NaN where a line is absent;
    regions: name and number of stations' intervals, in order; rigid (station,): held by the rim.
    """

    names: tuple[str, ...]
    points: Array
    regions: tuple[tuple[str, int], ...]
    rigid: Array


def read_section(path: Path) -> Section:
    """Read a station table: station, region, <line>_r_mm, <line>_z_mm ..., rigid (0 or 1).

    Columns of lines stand from the inner surface to the outer. Raises SectionError, OSError.
    """
    with path.open(newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file)
        header = reader.fieldnames or []
        names = tuple(h[: -len("_r_mm")] for h in header if h.endswith("_r_mm"))
        for needed in ["region", "rigid", *(f"{n}_z_mm" for n in names)]:
            if needed not in header:
                raise SectionError(f"column '{needed}' is missing", 1)
        if len(names) < 2:
            raise SectionError(
                f"at least an inner and an outer line are needed, got {', '.join(names) or 'none'}",
                1,
            )
        points, labels, rigid = [], [], []
        for row in reader:
            points.append(
                [[_mm(row, f"{n}_{axis}_mm", reader.line_num) for axis in "rz"] for n in names]
            )
            labels.append(row["region"])
            if row["rigid"] not in ("0", "1"):
                raise SectionError(f"rigid is '{row['rigid']}', must be 0 or 1", reader.line_num)
            rigid.append(row["rigid"] == "1")
    if len(points) < 3:
        raise SectionError(f"{len(points)} stations are too few, at least 3 are needed")
    table = np.array(points).swapaxes(0, 1) * 1e-3
    for end in (0, -1):
        missing = np.flatnonzero(np.isnan(table[end]).any(1))
        if len(missing):
            raise SectionError(
                f"line '{names[end]}' must be given at every station", int(missing[0]) + 2
            )
    if abs(table[0, 0, 1]) > 1e-9:
        raise SectionError("the first station must lie on the centre plane, z = 0", 2)
    starts = [0] + [i for i in range(1, len(labels)) if labels[i] != labels[i - 1]]
    # regions share a station: the first one's last, or the first that the rim holds
    ends = [*(s if rigid[s] != rigid[s - 1] else s - 1 for s in starts[1:]), len(labels) - 1]
    counts, last = [], 0
    for end in ends:
        counts.append(end - last)
        last = end
    regions = tuple((labels[s], c) for s, c in zip(starts, counts, strict=True))
    if len({name for name, _ in regions}) < len(regions):
        raise SectionError("the stations of a region must follow one another")
    return Section(names, table, regions, np.array(rigid))


def _mm(row: dict[str, str], column: str, line: int) -> float:
    text = (row[column] or "").strip()
    if not text:
        return float("nan")
    try:
        value = float(text)
    except ValueError:
        raise SectionError(f"{column} is '{text}', must be a number in mm", line) from None
    if not np.isfinite(value):
        raise SectionError(f"{column} is '{text}', must be a finite number in mm", line)
    return value


def fill_lines(section: Section) -> Array:
    """Lines (line, station, 2) made whole for a mesh.

    Where a line is absent it keeps the fraction of the thickness, between the nearest lines
    that exist, of the station where it ends, so that element rows run on without a step.
    """
    points = section.points.copy()
    present = ~np.isnan(points).any(-1)
    for k in range(1, len(section.names) - 1):
        have = np.flatnonzero(present[k])
        if not len(have):
            raise SectionError(f"line '{section.names[k]}' has no station at all")
        for j in np.flatnonzero(~present[k]):
            near = have[np.argmin(abs(have - j))]
            below = k - 1  # already made whole
            above = next(m for m in range(k + 1, len(section.names)) if present[m, j])
            start, end = points[below, near], points[above, near]
            span = end - start
            fraction = (points[k, near] - start) @ span / (span @ span)
            points[k, j] = points[below, j] + fraction * (points[above, j] - points[below, j])
    return points


def resample(section: Section, intervals: list[int]) -> tuple[Array, list[str], Array, Array]:
    """The section at ``intervals`` equal steps of station number per region.

    Returns points (line, column, 2), the region of each interval, rigid (column,) and present
    (line, column): whether the line really exists there. Stations are met exactly where the
    table's spacing allows; between stations a cubic spline per region runs through them.
    """
    points = fill_lines(section)
    real = ~np.isnan(section.points).any(-1)
    columns, names, start = [0.0], [], 0
    for (name, count), steps in zip(section.regions, intervals, strict=True):
        columns += list(start + count * np.arange(1, steps + 1) / steps)
        names += [name] * steps
        start += count
    where = np.array(columns)
    out = np.empty((len(points), len(where), 2))
    start = 0
    for _, count in section.regions:
        stations = np.arange(start, start + count + 1)
        inside = (where >= start) & (where <= start + count)
        spline = CubicSpline(stations, points[:, stations], axis=1)
        out[:, inside] = spline(where[inside])
        start += count
    nearest = np.rint(where).astype(int)
    exact = abs(where - nearest) < 1e-9
    out[:, exact] = points[:, nearest[exact]]
    floor, ceil = np.floor(where + 1e-9).astype(int), np.ceil(where - 1e-9).astype(int)
    present = real[:, floor] & real[:, ceil]
    return out, names, section.rigid[floor] & section.rigid[ceil], present
