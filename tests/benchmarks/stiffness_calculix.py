"""Stiffnesses of the pressed tyre, its patch held, by the bundled solver and by CalculiX.

    python -m tests.benchmarks.stiffness_calculix FOLDER

One mesh of 8 degrees at the patch, C3D20 and CGAX8, the section, cord law, straight sides and road
alike (1e9 Pa/m across and along it). CalculiX gets the deflection that the bundled solver finds at
3 kN, with so much friction that nothing slides. Then its road moves along, across and turns, one
after the other, and back. The stiffnesses are those at a constant height of the axle.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import re
import sys
import time
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from tests.solvers.press_deck import Angles, Road
from tests.solvers.press_results import run_press
from tests.studies.calculix import common
from tests.studies.footprint_calculix import Mesh, Run, deck, inflated_radius, meshed
from tyrecal.simulate.deck import tyre_design
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.stiffness import LATERAL, LONGITUDINAL, TORSION
from tyrecal.tyre.values import with_values

Array = np.ndarray
LOAD_N, LIMIT_S = 3000.0, 7200.0
SHIFT_M, TURN_RAD = 2e-4, 1e-3
ALONG = (2, 2, 2, 1)
ANGLES = Angles(8.0, 16.0, 36.0, 2.0, whole=True)
MESH = Mesh("C3D20", 8.0, ALONG, ANGLES)
ROAD = Road(friction=5.0, normal=1e9, stick=1e9)
# time at which the road has moved, and its motion there: y (along), z (across), turn about x
MOTIONS = {2: (SHIFT_M, 0.0, 0.0), 4: (0.0, SHIFT_M, 0.0), 6: (0.0, 0.0, TURN_RAD)}
FORCES = re.compile(r"forces \(fx,fy,fz\) for set ROAD and time +(\S+)\s*\n\s*\n((?: .*\n){8})")


def bundled() -> tuple[float, float, Array]:
    """Deflection (m), force (N), and longitudinal, lateral and torsional stiffness."""
    case = meshed(ALONG, (1, 1, 1, 1))
    case = with_values(case, {"road.stiffness_Pa_per_m": ROAD.normal})
    half = replace(ANGLES, whole=False).sizes()
    road = case.case.road.model_copy(update={"element_angles_deg": half})
    case = replace(case, case=case.case.model_copy(update={"road": road}))
    # the bundled solver's waves beyond the patch are finer than these elements anyway
    with common(), patch.object(tyre_design, "WAVES_OF_STIFFNESS", 0):
        pressed = Evaluator(TyreDesign(case), "bundled").press({}, [LOAD_N], rim_stiffness=True)
    (row,) = pressed.footprints
    assert row.rim_reactions is not None
    places = [LONGITUDINAL, LATERAL, TORSION]
    return row.deflection_m, row.road_N, np.diag(row.rim_reactions)[places]


def moving(text: str) -> str:
    """The deck of one deflection, whose road then makes the motions."""
    last = max(MOTIONS) + 1
    block = re.search(r"\*NODE, NSET=ROAD\n((?:\d.*\n){8})", text)
    assert block
    tables, moved = [], []
    for line in block[1].splitlines():
        number, _, y, z = line.split(",")
        for dof in (2, 3):
            at = {0: 0.0, 1: 0.0}
            for when, (along, across, turn) in MOTIONS.items():
                turned = -turn * float(z) if dof == 2 else turn * float(y)
                at |= {when: turned + (along if dof == 2 else across), when + 1: 0.0}
            rows = "\n".join(f"{when}, {value!r}" for when, value in at.items())
            tables.append(f"*AMPLITUDE, NAME=A{number}_{dof}\n{rows}\n")
            moved.append(f"*BOUNDARY, AMPLITUDE=A{number}_{dof}\n{number}, {dof}, {dof}, 1.0\n")
    points = "\n".join(map(str, range(1, last + 1)))
    for before, after in {
        "*BOUNDARY\nROAD, 2, 3\n": "",
        "*STEP, NLGEOM": "".join(tables) + "*STEP, NLGEOM",
        "1.0, 1.0, 2, 1.0": f"1.0, 1.0, {last}, 1.0",
        "*TIME POINTS, NAME=DEFLECTIONS\n1\n": f"*TIME POINTS, NAME=DEFLECTIONS\n{points}\n",
        "*STATIC\n0.1, 1,": f"*STATIC\n0.1, {last},",
    }.items():
        assert before in text
        text = text.replace(before, after)
    text, count = re.subn(r"(?m)^1, (-?\d.*)\n\*TIME", rf"1, \g<1>\n{last}, \g<1>\n*TIME", text)
    assert count == 1
    text = text.replace("NSET=ROAD, TOTALS=ONLY,", "NSET=ROAD,")
    return text.replace("*NODE PRINT, NSET=RIM", "".join(moved) + "*NODE PRINT, NSET=RIM", 1)


def calculix(deflection_m: float, folder: Path) -> tuple[float, Array]:
    """Force (N), and longitudinal, lateral and torsional stiffness."""
    run = Run(MESH, ROAD, 1.0, (deflection_m,))
    deck(run, run.deflections_m, inflated_radius(run, folder / "free", LIMIT_S), folder)
    job = folder / "press.inp"
    job.write_text(moving(job.read_text()))
    run_press(folder, ["ccx"], LIMIT_S)
    block = re.search(r"\*NODE, NSET=ROAD\n((?:\d.*\n){8})", job.read_text())
    assert block
    places = np.array([line.split(",")[2:] for line in block[1].splitlines()], float)
    at = {}
    for when, rows in FORCES.findall((folder / "press.dat").read_text()):
        f = np.array([row.split()[1:] for row in rows.splitlines()], float)
        moment = (places[:, 0] * f[:, 2] - places[:, 1] * f[:, 1]).sum()
        at[round(float(when))] = np.array([f[:, 1].sum(), f[:, 2].sum(), moment, -f[:, 0].sum()])
    moves = zip(MOTIONS.items(), (SHIFT_M, SHIFT_M, TURN_RAD), strict=True)
    own = [
        (at[when] - (at[when - 1] + at[when + 1]) / 2)[k] / size
        for k, ((when, _), size) in enumerate(moves)
    ]
    return float(at[1][3]), np.array(own)


def main(folder: Path) -> None:
    deflection, force, ours = bundled()
    print(f"bundled: {1e3 * deflection:.3f} mm, {force:.0f} N, {ours}", flush=True)
    start = time.perf_counter()
    judge_N, judge = calculix(deflection, folder)
    print(f"CalculiX takes {time.perf_counter() - start:.0f} s")
    print("| stiffness at the same deflection | CalculiX | bundled | difference |")
    print("|---|---|---|---|")
    print(f"| force, N | {judge_N:.0f} | {force:.0f} | {100 * (force / judge_N - 1):+.1f} % |")
    names = ("longitudinal, N/mm", "lateral, N/mm", "torsional, Nm/°")
    for name, a, b, scale in zip(names, judge, ours, (1e-3, 1e-3, np.pi / 180), strict=True):
        print(f"| {name} | {a * scale:.1f} | {b * scale:.1f} | {100 * (b / a - 1):+.1f} % |")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
