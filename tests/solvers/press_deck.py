"""The tyre in solid elements all around, pressed on a rigid flat road: decks for CalculiX.

The axle is z; the road is the plane x = const at +x, so Theta = 0 is the patch's centre and the
vertical force acts along x. The rim is held, the road moves. Deflection counts from the road that
just touches the inflated tyre: the inflated tyre's outer radius less the road's distance.

A tyre pressed on a road by CalculiX: run the deck, read forces and the area of contact.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from tyrecal_solvers.calculix.results import read_fields
from tyrecal_solvers.calculix.runner import run_job
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.calculix import calculix_context
from tyrecal.simulate.deck.decks import header
from tyrecal.simulate.deck.sector import Sector
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.templates import environment, render

TEMPLATES = Path(__file__).parent / "templates"
OUTER_FACE = "S4"  # a brick's face over side 2 of the section's element
OUTER_NODES = (1, 2, 5, 6, 9, 13, 17, 18)  # that face's among a brick's nodes
Row = tuple[int, ...]  # an element's number and its nodes'


@dataclass(frozen=True)
class Angles:
    """Sizes of elements around the tyre, degrees.

    ``fine`` within ``reach`` to either side of the patch's centre; beyond, each is ``growth``
    times the one before, up to ``coarse``. ``whole``: all of the tyre; otherwise the half that a
    turn by 180 degrees about x makes whole: section, cords, pressure and road are alike under it.
    """

    fine: float = 4.0
    reach: float = 24.0
    coarse: float = 12.0
    growth: float = 1.5
    whole: bool = False

    def sizes(self) -> list[float]:
        """Sizes from Theta = 0 to -180 degrees; of the whole tyre from 180 by way of 0."""
        count = round(self.reach / self.fine)
        rest, beyond = 180 - self.reach, [self.fine * self.growth]
        while sum(beyond) < rest:
            beyond.append(min(self.coarse, beyond[-1] * self.growth))
        half = [self.reach / count] * count + [size * rest / sum(beyond) for size in beyond]
        return half[::-1] + half if self.whole else half


@dataclass(frozen=True)
class Road:
    """Coulomb friction; penalty stiffness across the road and along it, Pa/m."""

    friction: float = 0.5
    normal: float = 1e10
    stick: float = 1e9


def press_texts(
    case: LoadedCase,
    deflections_m: Sequence[float],
    angles: Angles,
    inflated_radius_m: float,
    road: Road | None = None,
    largest_increment: float = 1.0,
) -> dict[str, str]:
    """File name to text: ``press.inp``, and ``wheel.inp``, which it includes.

    deflections_m: ascending, reached one after the other; before the last, CalculiX lets the
    tread sink in up to 0.2 mm (at 1e10 Pa/m), which makes the force up to 1 % too small;
    inflated_radius_m: outer radius of the inflated tyre; largest_increment: of the way from one
    deflection to the next. Raises TemplateFailed.
    """
    names = around(calculix_context(resolved(case)), angles)
    radius = max(x for _, x, _, _ in names["nodes"])
    square = ((-radius, -radius), (radius, -radius), (radius, radius), (-radius, radius))
    names["corners"] = [(x, y, z) for x in (radius, 1.1 * radius) for y, z in square]
    names["travels"] = [(d, inflated_radius_m - d - radius) for d in deflections_m]
    names["road"], names["largest_increment"] = asdict(road or Road()), largest_increment
    env, jobs = environment("calculix", TEMPLATES), ("wheel", "press")
    return {f"{name}.inp": header(case) + render(env, f"{name}.inp.j2", names) for name in jobs}


def around(names: dict[str, Any], angles: Angles) -> dict[str, Any]:
    """Names of a sector's deck made those of the tyre, numbers still without gaps from 1."""
    sector: Sector = names["sector"]
    sizes = [math.radians(size) for size in angles.sizes()]
    turns = [math.pi * angles.whole - turn for turn in accumulate(sizes, initial=0.0)]
    planes = len(sizes) if angles.whole else len(turns)
    flat = len(sector.section)
    own = len(sector.nodes) - flat  # nodes of a wedge without the plane behind it
    count = len(sector.bricks) + len(names["plies"])

    def wedge(rows: Sequence[Row], k: int) -> list[Row]:
        """Rows of a sector's elements in wedge k, nodes in front, behind and between."""
        front, behind = k * own, (k + 1) % planes * own - flat
        shifts = [0, *[front] * flat, *[behind] * flat, *[front - flat] * (own - flat)]
        return [(number + k * count, *(n + shifts[n] for n in row)) for number, *row in rows]

    def everywhere(block: dict[str, Any]) -> dict[str, Any]:
        rows = block["elements"]
        return {**block, "elements": [row for k in range(len(sizes)) for row in wedge(rows, k)]}

    nodes = []
    for k in range(planes):
        for n, x, y, z in sector.nodes:
            if n <= flat or (n > 2 * flat and k < len(sizes)):
                r, turn = math.hypot(x, y), turns[k] - (sizes[k] / 2 if n > flat else 0.0)
                number = k * own + (n if n <= flat else n - flat)
                nodes.append((number, r * math.cos(turn), r * math.sin(turn), z))
    held = {n if n <= flat else n - flat for n in sector.rim}
    reach = math.radians(angles.reach)
    near = [k for k in range(len(sizes)) if abs(turns[k] + turns[k + 1]) / 2 < reach]
    tread = [row for k in near for row in wedge(_tread(sector), k)]
    outer = {row[1 + i] for row in tread for i in OUTER_NODES if 1 + i < len(row)}
    return {
        **names,
        "nodes": nodes,
        "node_sets": [
            ("RIM", [n for n, *_ in nodes if (n - 1) % own + 1 in held]),
            ("TREAD_NODES", sorted(outer)),
        ],
        "solids": [everywhere(block) for block in names["solids"]],
        "plies": [everywhere(block) for block in names["plies"]],
        "cavity": [n + k * count for k in range(len(sizes)) for n in names["cavity"]],
        "tread": [number for number, *_ in tread],
        "tread_face": OUTER_FACE,
        "elements": count * len(sizes),
        "turned": [] if angles.whole else _turned(sector, held, (0, len(sizes) * own)),
    }


def _turned(sector: Sector, held: set[int], planes: tuple[int, int]) -> list[tuple[int, int]]:
    """Free nodes at z <= 0 and those at -z, on the planes whose first nodes follow ``planes``."""
    places = {(round(x, 9), round(z, 9)): n for n, x, _, z in sector.nodes[: len(sector.section)]}
    return [
        (first + n, first + places[r, -z])
        for first in planes
        for (r, z), n in places.items()
        if z <= 0 and n not in held
    ]


def _tread(sector: Sector) -> list[Row]:
    """Rows of the outermost elements above half the section's height."""
    radii = {n: math.hypot(x, y) for n, x, y, _ in sector.nodes}
    middle = (min(radii.values()) + max(radii.values())) / 2
    outermost = max(sector.rows.values())
    return [
        (number, *nodes)
        for number, (cell, nodes) in enumerate(sector.bricks.items(), start=1)
        if sector.rows[cell] == outermost and min(radii[n] for n in nodes[1:3]) > middle
    ]


JOB, WHEEL = "press", "wheel.inp"
BALANCE = 0.02  # of the force: CalculiX counts pressure on held nodes as the rim's reaction
NUMBERS = r"[ \t]*\n\s*\n((?:[ \t]+\S+){3})[ \t]*\n"
REACTION = r"total force \(fx,fy,fz\) for set NAME and time +(\S+)" + NUMBERS
CONTACT = (
    r"statistics for slave set TREAD, master set ROAD_FACE and time +(\S+)"
    r"(?:(?! statistics).*\n)*?   area, .*" + NUMBERS
)
# pressure is the fourth of the components, each 12 columns wide
PATCH = re.compile(
    r"^ -4  CONTACT.*\n(?: -5.*\n){3} -5  CPRESS.*\n(?: -5.*\n)*((?: -1.*\n)+)", re.M
)


@dataclass(frozen=True)
class Pressed:
    """The whole tyre at one deflection (m).

    force_N: of the road on the tyre, along its normal; rim_N: the rim's, which differs by what
    of the cavity's pressure stands on held nodes; area_m2: of the points, 4 or more a face, that
    touch, as large as they were when the last increment began; shear_N: size of the sum of
    friction on one half of the patch, fore or aft of its centre; NaN where the whole tyre ran.
    """

    deflection_m: float
    force_N: float
    rim_N: float
    area_m2: float
    shear_N: float


def run_press(folder: Path, command: Sequence[str], time_limit_s: float) -> None:
    """Run ``press.inp`` of ``folder``. Raises RunFailed as `run_job` does."""
    run_job(folder, JOB, [WHEEL], command, time_limit_s)


def read_press(folder: Path) -> list[Pressed]:
    """Read the results, a row per deflection of the deck.

    Raises RunFailed (``no_results``) where one is missing, is not a number or does not balance.
    """
    path = folder / f"{JOB}.dat"
    if not path.exists():
        raise RunFailed("no_results", f"CalculiX left no {path.name}")
    deck, text = (
        (folder / f"{JOB}.inp").read_text(encoding="utf-8"),
        path.read_text(encoding="utf-8", errors="replace"),
    )
    deflections = [float(value) for value in re.findall(r"^\*\* deflection (\S+) m", deck, re.M)]
    halves = 2 if "*EQUATION" in (folder / WHEEL).read_text(encoding="utf-8") else 1
    patterns = (REACTION.replace("NAME", "ROAD"), REACTION.replace("NAME", "RIM"), CONTACT)
    tables = [_rows(pattern, text, path.name) for pattern in patterns]
    times = [float(k) for k in range(1, len(deflections) + 1)]
    if not deflections or any([time for time, _ in rows] != times for rows in tables):
        count = min(len(rows) for rows in tables)
        raise RunFailed("no_results", f"{path.name} has {count} of {len(deflections)} deflections")
    pressed = []
    for deflection, *rows in zip(deflections, *tables, strict=True):
        (_, road), (_, rim), (_, (area, _, shear)) = rows
        one = Pressed(
            deflection,
            -halves * road[0],
            halves * rim[0],
            halves * area,
            shear if halves == 2 else float("nan"),
        )
        if not (one.area_m2 > 0 and abs(one.rim_N - one.force_N) <= BALANCE * one.force_N):
            raise RunFailed(
                "no_results",
                f"{path.name}: the road bears {one.force_N:g} N on {one.area_m2:g} m2, the rim"
                f" {one.rim_N:g} N",
            )
        pressed.append(one)
    return pressed


def read_radius(folder: Path) -> float:
    """Outer radius in m at Theta = 0 of the last state, inflated where the road stayed clear.

    Raises RunFailed (``no_results``).
    """
    fields = read_fields(folder / f"{JOB}.frd")
    return float((fields.points + fields.blocks[-1][2])[:, 0].max())


def read_pressures(folder: Path) -> list[np.ndarray]:
    """Per deflection, rows y, z (m) and contact pressure (Pa) of the nodes that touch.

    Of half the patch where half the tyre ran. Raises RunFailed (``no_results``).
    """
    path = folder / f"{JOB}.frd"
    fields, patch_texts = read_fields(path), PATCH.findall(path.read_text(encoding="utf-8"))
    if len(patch_texts) != len(fields.blocks):
        raise RunFailed("no_results", f"{path.name} has {len(patch_texts)} patches")
    patches = []
    for lines, (_, _, moved) in zip(patch_texts, fields.blocks, strict=True):
        known = {int(line[3:13]): float(line[49:61]) for line in lines.splitlines()}
        pressure = np.array([known.get(int(n), 0.0) for n in fields.nodes])
        patches.append(np.column_stack([(fields.points + moved)[:, 1:], pressure])[pressure > 0])
    return patches


def _rows(pattern: str, text: str, name: str) -> list[tuple[float, list[float]]]:
    """Time and the three numbers after each match."""
    rows = []
    for time, numbers in re.findall(pattern, text):
        try:
            row = float(time), [float(number) for number in numbers.split()]
        except ValueError:
            row = 0.0, [np.nan]
        if not np.isfinite(row[1]).all():
            raise RunFailed("no_results", f"{name}: '{numbers.strip()}' are not numbers")
        rows.append(row)
    return rows
