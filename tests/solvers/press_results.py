"""A tyre pressed on a road by CalculiX: run the deck, read forces and the area of contact."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tyrecal_solvers.calculix.results import read_fields
from tyrecal_solvers.calculix.runner import run_job
from tyrecal_solvers.errors import RunFailed

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
