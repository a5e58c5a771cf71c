"""The tyre's half section as a station table: lines through the thickness, station by station.

Every line is given by its points, or one of them is and the others by gauges: their distances
from it along its normal. Lines given before it lie inside it, those after it outside.

The gauges of a case (`GaugeFactor`) are factors on the thickness between two lines, by region.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import read_bytes
from ..number_table import named_table
from .curve import CubicSpline

Array = np.ndarray
GAUGE = "_gauge_mm"  # ends the heading of a line's column
STEPLESS = 1e-9  # m, of a line between its two parts: less is no step
GaugeFactor = tuple[tuple[str, ...], tuple[str, str], float]  # regions, (line, line), factor


class SectionError(InputError):
    """A station table that is not a section; ``line`` is the 1-based line of the file or 0."""


@dataclass(frozen=True, eq=False)
class Section:
    """Half a section, uninflated, from the crown's centre (z = 0) to the bead."""

    # the lines from the inner surface to the outer, e.g. inner, ply, belt1, belt2, outer
    names: tuple[str, ...]
    # (line, station, 2): r and z in m, NaN where a line is absent
    points: Array = field(repr=False)
    regions: tuple[tuple[str, int], ...]  # name and number of stations' intervals, in order
    rigid: Array = field(repr=False)  # (station,): held by the rim
    # the outer and the inner curve (point, 2), m, where it was drawn between such
    outline: tuple[Array, ...] = field(default=(), repr=False)

    @cached_property
    def _content(self) -> tuple[object, ...]:
        curves = tuple(curve.tobytes() for curve in (self.points, self.rigid, *self.outline))
        return self.names, self.regions, curves

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Section) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)


def read_section(path: Path) -> Section:
    """Read a station table: station, region, <line>_r_mm, <line>_z_mm ..., rigid (0 or 1).

    Columns of lines stand from the inner surface to the outer; <line>_gauge_mm, its distance from
    the one line that has points, takes the place of a line's two. Raises SectionError, OSError.
    """
    return _section(read_bytes(path))


@lru_cache(maxsize=8)
def _section(raw: bytes) -> Section:
    table = named_table(raw)
    header = table.headings
    gauged = gauged_lines(header)
    names = tuple(h.rsplit("_", 2)[0] for h in header if h.endswith(("_r_mm", GAUGE)))
    drawn = [n for n in names if n not in gauged]
    for needed in ["region", "rigid", *(f"{n}_z_mm" for n in drawn)]:
        if needed not in header:
            raise SectionError(f"column '{needed}' is missing", 1)
    if gauged and len(drawn) != 1:
        raise SectionError(
            "gauges are distances from one line: give its _r_mm and _z_mm,"
            f" got {', '.join(drawn) or 'none'}",
            1,
        )
    if len(names) < 2:
        raise SectionError(
            f"at least an inner and an outer line are needed, got {', '.join(names) or 'none'}", 1
        )
    columns = [(f"{n}{GAUGE}",) * 2 if n in gauged else (f"{n}_r_mm", f"{n}_z_mm") for n in names]
    points = [[[row.millimetres(c) for c in pair] for pair in columns] for row in table.rows]
    labels = [row.cells["region"] for row in table.rows]
    for row in table.rows:
        if row.cells["rigid"] not in ("0", "1"):
            raise SectionError(f"rigid is '{row.cells['rigid']}', must be 0 or 1", row.line)
    rigid = [row.cells["rigid"] == "1" for row in table.rows]
    if len(points) < 3:
        raise SectionError(f"{len(points)} stations are too few, at least 3 are needed")
    lines = np.array(points).swapaxes(0, 1) * 1e-3
    if gauged:
        line = names.index(drawn[0])
        gauges = np.where(np.arange(len(names)) < line, -1.0, 1.0)[:, None] * lines[..., 0]
        gauges[line] = 0.0
        lines = from_gauges(lines[line], gauges)
    for end in (0, -1):
        missing = np.flatnonzero(np.isnan(lines[end]).any(1))
        if len(missing):
            raise SectionError(
                f"line '{names[end]}' must be given at every station", table.rows[missing[0]].line
            )
    if abs(lines[0, 0, 1]) > 1e-9:
        first = table.rows[0].line
        raise SectionError("the first station must be on the centre plane, z = 0", first)
    regions = regions_of(labels, rigid)
    return Section(names, lines, regions, np.array(rigid))


def regions_of(labels: list[str], rigid: list[bool]) -> tuple[tuple[str, int], ...]:
    """Names and intervals of the regions that the stations belong to. Raises SectionError."""
    starts = [0] + [i for i in range(1, len(labels)) if labels[i] != labels[i - 1]]
    # regions share a station: the first one's last, or the first that the rim holds
    ends = [*(s if rigid[s] != rigid[s - 1] else s - 1 for s in starts[1:]), len(labels) - 1]
    counts, last = [], 0
    for behind, end in zip(reversed(range(len(ends))), ends, strict=True):
        # a region of one station has the interval before it, the first of all that behind it
        end = min(max(end, last + 1), len(labels) - 1 - behind)
        counts.append(end - last)
        last = end
    regions = tuple((labels[s], c) for s, c in zip(starts, counts, strict=True))
    if len({name for name, _ in regions}) < len(regions):
        raise SectionError("the stations of a region must follow one another")
    return regions


def gauged_lines(header: Sequence[str]) -> list[str]:
    """Lines that a station table's columns give by gauges."""
    return [column[: -len(GAUGE)] for column in header if column.endswith(GAUGE)]


def from_gauges(line: Array, gauges: Array) -> Array:
    """Lines (line, station, 2) at distances ``gauges`` (line, station) outwards along the normal
    of ``line`` (station, 2), which starts at the crown's centre, where it runs along the axle.

    Raises SectionError where two stations are one point or the line has gaps.
    """
    step = np.hypot(*np.diff(line, axis=0).T)
    if not (step > 0).all():  # NaN too
        raise SectionError("the line with points must be given at every station, no point twice")
    along = np.concatenate([[0.0], np.cumsum(step)])
    tangent = CubicSpline(along, line, start=np.array([0.0, 1.0])).slope
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], -1) / np.hypot(*tangent.T)[:, None]
    points: Array = line + gauges[..., None] * normal
    return points


@lru_cache(maxsize=32)
def fill_lines(section: Section) -> Array:
    """Lines (line, station, 2), r and z in m, without NaN, for a mesh; read-only: they are kept.

    Where a line is absent it keeps the fraction of the thickness, between the nearest lines
    that exist, of the station where it ends, so that element rows run on without a step. Between
    two parts of a line it goes over from the one's fraction to the other's. Raises SectionError for
    a line without a station.
    """
    points = section.points.copy()
    present = ~np.isnan(points).any(-1)

    def as_at(near: int, k: int, j: int) -> Array:
        """Line k (2,) at station j, at the fraction of the thickness that it has at ``near``."""
        both = present[:, j] & present[:, near]
        above = next(m for m in range(k + 1, len(section.names)) if both[m])
        start, end = points[k - 1, near], points[above, near]  # already made whole
        span = end - start
        fraction = (points[k, near] - start) @ span / (span @ span)
        result: Array = points[k - 1, j] + fraction * (points[above, j] - points[k - 1, j])
        return result

    for k in range(1, len(section.names) - 1):
        have = np.flatnonzero(present[k])
        if not len(have):
            raise SectionError(f"line '{section.names[k]}' has no station at all")
        for j in np.flatnonzero(~present[k]).tolist():
            near = have[np.argmin(abs(have - j))]
            points[k, j] = as_at(near, k, j)
            beyond = have[have > j] if near < j else have[have < j][::-1]
            if len(beyond):
                other = as_at(beyond[0], k, j)
                if abs(other - points[k, j]).max() > STEPLESS:
                    points[k, j] += (j - near) / (beyond[0] - near) * (other - points[k, j])
    points.flags.writeable = False
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
        spline = CubicSpline(stations, points[:, stations].swapaxes(0, 1))
        out[:, inside] = spline(where[inside]).swapaxes(0, 1)
        start += count
    nearest = np.rint(where).astype(int)
    exact = abs(where - nearest) < 1e-9
    out[:, exact] = points[:, nearest[exact]]
    floor, ceil = np.floor(where + 1e-9).astype(int), np.ceil(where - 1e-9).astype(int)
    present = real[:, floor] & real[:, ceil]
    return out, names, section.rigid[floor] & section.rigid[ceil], present


@lru_cache(maxsize=32)
def with_gauges(section: Section, gauges: tuple[GaugeFactor, ...]) -> Section:
    """``section`` with thicknesses multiplied by the factors; no regions named = all of them.

    The innermost line between the surfaces (the carcass) stays where it is: gaps outside it move
    what lies outside them outwards, the gap inside it moves the inner surface. A station between
    two regions takes the geometric mean of their factors. Lines keep the stations they have.
    """
    if not gauges:
        return section
    points = fill_lines(section)
    steps = np.diff(points, axis=0)  # (gap, station, 2)
    for regions, (first, second), factor in gauges:
        low, high = sorted((section.names.index(first), section.names.index(second)))
        steps[low:high] *= _share(section, regions, factor)[None, :, None]
    fixed = points[1]
    moved = np.concatenate([[fixed - steps[0], fixed], fixed + np.cumsum(steps[1:], axis=0)])
    moved[np.isnan(section.points)] = np.nan
    return replace(section, points=moved)


def _share(section: Section, regions: tuple[str, ...], factor: float) -> np.ndarray:
    """The factor at each station (station,): its geometric mean where two regions meet."""
    logs = np.zeros((2, section.points.shape[1]))  # of the region before and after a station
    start = 0
    for name, count in section.regions:
        if not regions or name in regions:
            logs[0, start + 1 : start + count + 1] = np.log(factor)
            logs[1, start : start + count] = np.log(factor)
        start += count
    logs[0, 0], logs[1, -1] = logs[1, 0], logs[0, -1]
    share: np.ndarray = np.exp(logs.mean(0))
    return share
