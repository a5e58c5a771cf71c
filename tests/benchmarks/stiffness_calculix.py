"""Stiffnesses of the pressed tyre, its patch held, by the bundled solver and by CalculiX.

    python -m tests.benchmarks.stiffness_calculix FOLDER half|whole SIZE ...

Meshes of SIZE (8, 6, 4) degrees at the patch, refined alike along the section, C3D20 and CGAX8;
cord law, straight sides, friction and road alike (1e9 Pa/m across and along it). CalculiX gets
the deflection that the bundled solver finds at 3 kN, on each mesh. The bundled solver's next
loads show how the stiffness depends on the patch. CalculiX's road turns (half: half of the tyre,
which a half turn about the vertical makes whole), or moves along, back, across and back (all of
it). The stiffnesses are those at a constant height of the axle.

Of an overlap at an increment's start CalculiX lets (T - t_end) / (T - t_start) be, T the end of the
step: the road is softer and the patch a tenth larger in increments that end far from T. So the
road moves in increments ever shorter and nearer to it.

The moment is that of the forces at where the road's nodes then are. The road is an elastic block:
where they were, the block's own stresses have a moment, of 9 kN m/rad at 1 mrad along a chord.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import re
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from tests.solvers.press_deck import Angles, Road, run_press
from tests.studies.calculix import common
from tests.studies.footprint_calculix import Mesh, Run, deck, inflated_radius, meshed
from tyrecal.simulate.deck import tyre_design
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.stiffness import LATERAL, LONGITUDINAL, TORSION
from tyrecal.tyre.values import with_values

Array = np.ndarray
LOADS_N, LIMIT_S = (3000.0, 3400.0, 3800.0), 7200.0
SHIFT_M, TURN_RAD = 2e-4, 2e-3
ROAD = Road(friction=5.0, normal=1e9, stick=1e9)
Motion = tuple[float, float, float]  # of the road: y (along), z (across), turn about x
END, LARGEST_INCREMENT = 40.0, 20.0  # of the step; the tyre is pressed at 1
RESTS = (2.0, 0.1)  # how long before the end the tyre rests
# how long before the end the road has moved, and how
MOTIONS = {
    "half": [(0.005, (0.0, 0.0, TURN_RAD))],
    "whole": [(0.01, (SHIFT_M, 0.0, 0.0)), (0.001, (0.0, 0.0, 0.0)), (0.0001, (0.0, SHIFT_M, 0.0))],
}
NAMES = {
    "half": {"torsional, Nm/°": np.pi / 180},
    "whole": {"longitudinal, N/mm": 1e-3, "lateral, N/mm": 1e-3},
}
AREAS = re.compile(
    r"master set ROAD_FACE and time +(\S+)(?:(?! statistics).*\n)*?   area,.*\n\s*\n +(\S+)"
)
FORCES = re.compile(r"forces \(fx,fy,fz\) for set ROAD and time +(\S+)\s*\n\s*\n((?: .*\n){8})")


@dataclass(frozen=True)
class Row:
    """A pressed tyre: m, N, m2, and stiffnesses by part of the tyre that CalculiX has."""

    deflection_m: float
    force_N: float
    area_m2: float
    stiffness: dict[str, Array]


def mesh_of(size: float, whole: bool = False) -> Mesh:
    """A mesh of ``size`` degrees at the patch."""
    count = round(24 / size)
    angles = Angles(size, 24.0, 36.0, 2.0, whole)
    return Mesh("C3D20", size, (count, count, count, 1), angles)


def bundled(size: float) -> list[Row]:
    """The bundled solver's tyre at `LOADS_N`."""
    mesh = mesh_of(size)
    case = meshed(mesh.along, mesh.rows)
    own = {"road.stiffness_Pa_per_m": ROAD.normal, "road.friction": ROAD.friction}
    case = with_values(case, own)
    road = case.case.road.model_copy(update={"element_angles_deg": mesh.angles.sizes()})
    case = replace(case, case=case.case.model_copy(update={"road": road}))
    # the bundled solver's waves beyond the patch are finer than these elements anyway
    with common(), patch.object(tyre_design, "WAVES_OF_STIFFNESS", 0):
        pressed = Evaluator(TyreDesign(case), "bundled").press({}, LOADS_N, rim_stiffness=True)
    rows = []
    for row in pressed.footprints:
        assert row.rim_reactions is not None
        own = np.diag(row.rim_reactions)
        stiffness = {"half": own[[TORSION]], "whole": own[[LONGITUDINAL, LATERAL]]}
        rows.append(Row(row.deflection_m, row.road_N, row.contact_area_m2, stiffness))
    return rows


def places_at(road: Array, motion: tuple[float, float, float]) -> Array:
    """Places y, z (8, 2), m, of the road's nodes after a motion."""
    along, across, turn = motion
    c, s = np.cos(turn), np.sin(turn)
    return road @ np.array([[c, s], [-s, c]]) + [along, across]


def road_nodes(text: str) -> tuple[list[str], Array]:
    """Numbers of the road's nodes, and their places y, z (8, 2), m."""
    block = re.search(r"\*NODE, NSET=ROAD\n((?:\d.*\n){8})", text)
    assert block
    lines = [line.split(",") for line in block[1].splitlines()]
    return [number for number, *_ in lines], np.array([line[2:] for line in lines], float)


def moving(text: str, motions: list[tuple[float, Motion]]) -> str:
    """The deck of one deflection, whose road then makes the motions."""
    numbers, road = road_nodes(text)
    times = [1.0, *(END - rest for rest in RESTS), *(END - left for left, _ in motions), END]
    shifts = [0 * road] * (1 + len(RESTS))
    shifts += [places_at(road, motion) - road for _, motion in motions] + [0 * road]
    tables, bounds = "", ""
    for k, number in enumerate(numbers):
        for dof in (2, 3):
            rows = [f"{t!r}, {float(s[k, dof - 2])!r}" for t, s in zip(times, shifts, strict=True)]
            tables += "\n".join([f"*AMPLITUDE, NAME=A{number}_{dof}", "0, 0", *rows]) + "\n"
            bounds += f"*BOUNDARY, AMPLITUDE=A{number}_{dof}\n{number}, {dof}, {dof}, 1.0\n"
    points = "\n".join(map(repr, times))
    for before, after in {
        "*BOUNDARY\nROAD, 2, 3\n": "",
        "*STEP, NLGEOM": tables + "*STEP, NLGEOM",
        "1.0, 1.0, 2, 1.0": f"1.0, 1.0, {END}, 1.0",
        "*TIME POINTS, NAME=DEFLECTIONS\n1\n": f"*TIME POINTS, NAME=DEFLECTIONS\n{points}\n",
        "*STATIC\n0.1, 1,": f"*STATIC\n0.1, {END},",
        "NSET=ROAD, TOTALS=ONLY,": "NSET=ROAD,",
        "*NODE PRINT, NSET=RIM": bounds + "*NODE PRINT, NSET=RIM",
    }.items():
        assert text.count(before) == 1
        text = text.replace(before, after)
    text, count = re.subn(r"(?m)^1, (-?\d.*)\n\*TIME", rf"1, \g<1>\n{END}, \g<1>\n*TIME", text)
    assert count == 1
    return text


def calculix(deflection_m: float, part: str, size: float, folder: Path) -> Row:
    """CalculiX's tyre: force and area at the end, stiffnesses as its road moves."""
    run, motions = Run(mesh_of(size, part == "whole"), ROAD, LARGEST_INCREMENT), MOTIONS[part]
    deck(run, (deflection_m,), inflated_radius(run, folder / "free", LIMIT_S), folder)
    job = folder / "press.inp"
    job.write_text(moving(job.read_text(), motions))
    run_press(folder, ["ccx"], LIMIT_S)
    _, road = road_nodes(job.read_text())
    copies, at = (1 if part == "whole" else 2), []
    still = (0.0, 0.0, 0.0)
    places = [still, *(still for _ in RESTS), *(motion for _, motion in motions), still]
    text = (folder / "press.dat").read_text()
    for (_, rows), motion in zip(FORCES.findall(text), places, strict=True):
        f = copies * np.array([row.split()[1:] for row in rows.splitlines()], float)
        y, z = places_at(road, motion).T
        moment = (y * f[:, 2] - z * f[:, 1]).sum()
        at.append(np.array([f[:, 1].sum(), f[:, 2].sum(), moment, -f[:, 0].sum()]))
    areas = [copies * float(area) for _, area in AREAS.findall(text)]
    own = []
    for i, motion in enumerate(places):
        for k in np.flatnonzero(motion):
            own.append((at[i] - (at[i - 1] + at[i + 1]) / 2)[k] / motion[k])
    return Row(deflection_m, float(at[-1][3]), areas[-1], {part: np.array(own)})


def main(folder: Path, part: str, *sizes: str) -> None:
    """Print a table for each size."""
    for size in map(float, sizes):
        start, ours = time.perf_counter(), bundled(size)
        judge = calculix(ours[0].deflection_m, part, size, folder / f"{part}{size:g}")
        print(f"{size:g} degrees, {part} tyre: {time.perf_counter() - start:.0f} s")
        print("| program | mm | N | cm2 |", " | ".join(NAMES[part]), "|")
        print("|---" * (4 + len(NAMES[part])) + "|")
        for name, row in [("CalculiX", judge), *(("bundled", row) for row in ours)]:
            cells = [1e3 * row.deflection_m, row.force_N, 1e4 * row.area_m2]
            cells += [*(row.stiffness[part] * [*NAMES[part].values()])]
            print(f"| {name} |", " | ".join(f"{x:.1f}" for x in cells), "|", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
