"""Drawings to scale: the section with its layers, the map of its parts, patches on the road."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from contourpy import contour_generator
from markupsafe import Markup

from .contents import DiagnosisSection, Patch, Region, Section
from .svg import drawing

ACROSS = 340.0  # pixels of a drawing's width
PATCH = 200.0
AIR = 12.0
BANDS = 8  # of contact pressure
TRACE = 1e-6  # of the highest pressure, where the lowest band begins
ENOUGH = 5.0  # ln evidence that is drawn in the full colour


class _Plane:
    """z to the right and r up, mm, in pixels."""

    def __init__(self, flat: Iterable[Sequence[float]]):
        points = np.concatenate([np.reshape(np.array(line, float), (-1, 2)) for line in flat])
        self.low, high = points.min(0), points.max(0)
        self.scale = (ACROSS - 2 * AIR) / (high - self.low)[0]
        self.height = (high - self.low)[1] * self.scale + 2 * AIR
        self.top = high[1]

    def place(self, flat: Sequence[float]) -> np.ndarray:
        """Pixels (n, 2) of z, r, one after the other."""
        z, r = np.reshape(flat, (-1, 2)).T
        return np.stack(
            [AIR + (z - self.low[0]) * self.scale, AIR + (self.top - r) * self.scale], 1
        )

    def path(self, lines: Iterable[Sequence[float]], style: str, close: bool = True) -> Markup:
        """Polygons, or open lines, as one path."""
        return Markup('<path class="{}" d="{}"/>').format(
            style, "".join(_trace(self.place(line), close) for line in lines)
        )


@dataclass(frozen=True)
class Key:
    """A line of a drawing's legend: the number in the drawing, its look, words."""

    number: int
    style: str
    words: str


def section(found: Section, pressure_kPa: float) -> tuple[Markup, list[Key], str]:
    """The section, the key to its numbers, its size in words."""
    plane = _Plane([found.outline, *([found.inflated] if found.inflated else [])])
    parts, numbers, key = [], [], []
    for k, (name, cells) in enumerate(found.areas.items(), 1):
        style = f"rubber r{(k - 1) % 4}"
        parts.append(plane.path(cells, style))
        numbers.append(_number(plane, _spot(cells, k), k))
        key.append(Key(k, style, name.replace("_", " ")))
    if found.rim:
        parts.append(plane.path(found.rim, "held"))
        key.append(Key(0, "held", "held by the rim (hatched)"))
    for k, (name, cords) in enumerate(found.cords.items()):
        style = f"cord c{k % 4}"
        parts.append(plane.path(cords.lines, style, close=False))
        words = f"{name.replace('_', ' ')}: cords {cords.angle_deg:g}° from the meridian"
        key.append(Key(0, style, words))
    if found.inflated:
        parts.append(plane.path([found.inflated], "inflated"))
        key.append(Key(0, "inflated", f"inflated to {pressure_kPa:g} kPa"))
    z, r = np.reshape(found.outline, (-1, 2)).T
    count = sum(map(len, found.areas.values()))
    words = (
        f"outer diameter {2 * r.max():.1f} mm, section width {np.ptp(z):.1f} mm, {count} elements"
    )
    picture = drawing(ACROSS, plane.height, f"The section: {words}", [*parts, *numbers])
    return picture, key, words


def section_map(found: DiagnosisSection, regions: Sequence[Region]) -> tuple[Markup, list[Key]]:
    """Parts of the section, the stronger their colour the better a change of them alone explains
    the gap, with their lines of the table as numbers."""
    place: dict[str, tuple[int, float]] = {}
    for k, region in enumerate(regions, 1):  # of several rubbers in a region the likelier one
        place.setdefault(region.region.split(",")[0], (k, region.evidence))
    plane = _Plane([cell for cells in found.areas.values() for cell in cells])
    parts, numbers, key = [], [], []
    for name, cells in found.areas.items():
        number, evidence = place.get(name, (0, 0.0))
        parts.append(plane.path(cells, f"part e{_grade(evidence)}"))
        if number:
            numbers.append(_number(plane, _spot(cells, number), number))
            key.append(Key(number, f"part e{_grade(evidence)}", name))
    for name, lines in found.cords.items():
        number, evidence = place.get(name, (0, 0.0))
        parts.append(plane.path(lines, f"strand e{_grade(evidence)}", close=False))
        if number:
            left = [[-z if i % 2 == 0 else z for i, z in enumerate(line)] for line in lines]
            mirror = _spot(left, number)
            spot = [-z if i % 2 == 0 else z for i, z in enumerate(mirror)]
            numbers.append(_number(plane, spot, number))
            key.append(Key(number, f"part e{_grade(evidence)}", name))
    words = "Parts of the section by the evidence for a change of them alone"
    return drawing(ACROSS, plane.height, words, [*parts, *numbers]), sorted(
        key, key=lambda each: each.number
    )


def levels(patches: Sequence[Patch]) -> list[float]:
    """Edges of the bands of contact pressure, kPa, the same in every patch."""
    highest = max(max(map(max, patch.pressure_kPa)) for patch in patches)
    step = next(
        s * 10.0**k for k in range(-3, 9) for s in (1, 2, 5) if s * 10.0**k * BANDS >= highest
    )
    return [step * i for i in range(int(highest / step) + 2)]


def patches(found: Sequence[Patch], edges: Sequence[float]) -> list[Markup]:
    """Contact pressure in the patches, all in one scale, rolling direction upwards."""
    half = np.max([_halves(patch) for patch in found], axis=0) + 4.0
    scale = (PATCH - 2) / (2 * half[0])
    return [_patch(patch, edges, half, scale) for patch in found]


def _patch(patch: Patch, edges: Sequence[float], half: np.ndarray, scale: float) -> Markup:
    x, y, p = (np.array(v) for v in (patch.across_mm, patch.along_mm, patch.pressure_kPa))
    x, y = (half[0] + x) * scale + 1, (half[1] - y) * scale + 1
    contours: Any = contour_generator(x, y, p)
    width, height = 2 * scale * half + 2
    frame = Markup('<rect class="frame" x="1" y="1" width="{:.5g}" height="{:.5g}"/>')
    parts = [frame.format(width - 2, height - 2)]
    for k, edge in enumerate(edges[:-1]):
        d = "".join(_trace(line, True) for line in contours.lines(edge or TRACE * p.max()))
        # a level's lines enclose what lies above it, so the next band is painted on top
        parts.append(Markup('<path class="band b{}" d="{}"/>').format(_band(k, edges), d))
    ten = 50.0 if half[0] > 60 else 20.0
    ruler = Markup('<path class="ruler" d="M8 {:.5g}h{:.5g}"/><text x="8" y="{:.5g}">{} mm</text>')
    parts.append(ruler.format(height - 8, ten * scale, height - 13, f"{ten:g}"))
    words = f"Contact pressure, {patch.design}, {patch.load_N:g} N, highest {p.max():.0f} kPa"
    return drawing(width, height, words, parts)


def bands(edges: Sequence[float]) -> list[tuple[int, str]]:
    """Class number and words of each band."""
    return [
        (_band(k, edges), f"{low:g} to {high:g}") for k, (low, high) in enumerate(pairwise(edges))
    ]


def _band(k: int, edges: Sequence[float]) -> int:
    return round(k * (BANDS - 1) / max(1, len(edges) - 2))


def _halves(patch: Patch) -> np.ndarray:
    """Largest distances from the middle across and along, as far as the lowest band is drawn."""
    x, y, p = (np.array(v) for v in (patch.across_mm, patch.along_mm, patch.pressure_kPa))
    contours: Any = contour_generator(x, y, p)
    line = np.concatenate(contours.lines(TRACE * p.max()))
    return np.asarray(abs(line).max(0))


def _grade(evidence: float) -> int:
    """0 (none) to 4 (enough)."""
    return round(4 * min(max(evidence, 0.0) / ENOUGH, 1.0))


def _spot(cells: Sequence[Sequence[float]], number: int) -> Sequence[float]:
    """One of the cells with z > 0, along them farther or less far, so that numbers stay apart."""
    right = [cell for cell in cells if np.mean(cell[::2]) > 0] or list(cells)
    return right[int(len(right) * (0.5, 0.25, 0.75)[number % 3])]


def _number(plane: _Plane, cell: Sequence[float], number: int) -> Markup:
    x, y = plane.place(cell).mean(0)
    return Markup(
        '<circle class="badge" cx="{:.1f}" cy="{:.1f}" r="7.5"/>'
        '<text class="badge" x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>'
    ).format(x, y, x, y + 4, number)


def _trace(points: np.ndarray, close: bool) -> str:
    text = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return f"M{text}Z" if close else f"M{text}"
