"""Smoothness of footprints over the load: stiffness, area, length and width at close loads.

    python -m tests.studies.smooth_footprint [--mesh LEVEL] [--from N] [--to N] [--step N]
        [--set NAME=VALUE ...] [--angles A1,A2,...] [--rim]

The main case, initial variables, all loads in one run. Printed per load, then how far stiffness and
area are from a cubic of the load over any 2 kN, how far tangents, their means over a step, are from
secants, and by how much length and width fall at most. ``--angles``: elements round the tyre.
``--rim``: the stiffnesses of the rim on a held patch, too.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import time
from dataclasses import replace

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.studies.footprint import footprint_row
from tyrecal.studies.stiffness import LATERAL, LONGITUDINAL, TORSION
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..conftest import CASES

Array = np.ndarray
WINDOW_N = 2000.0
RIM = {"longitudinal": LONGITUDINAL, "lateral": LATERAL, "torsional": TORSION}


def off_cubic(load: Array, y: Array) -> float:
    """Largest deviation from a cubic, over any window of the loads, relative."""
    worst = 0.0
    for first in load[load + WINDOW_N <= load[-1] + 1e-6]:
        inside = (load >= first) & (load <= first + WINDOW_N + 1e-6)
        x = (load[inside] - first) / WINDOW_N
        cubic = np.polyval(np.polyfit(x, y[inside], 3), x)
        worst = max(worst, float(abs(y[inside] / cubic - 1).max()))
    return worst


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mesh", default="default")
    parser.add_argument("--from", dest="first", type=float, default=2000.0)
    parser.add_argument("--to", type=float, default=8000.0)
    parser.add_argument("--step", type=float, default=50.0)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--angles")
    parser.add_argument("--rim", action="store_true")
    options = parser.parse_args()
    case = load_case(CASES / "p235_75r17.yaml")
    mesh = case.case.mesh.model_copy(update={"level": options.mesh})
    solver = case.case.solver.model_copy(update={"time_limit_s": 1e5})
    road = case.case.road
    if options.angles:
        angles = [float(a) for a in options.angles.split(",")]
        road = road.model_copy(update={"element_angles_deg": angles})
    changed = {"mesh": mesh, "solver": solver, "road": road}
    case = replace(case, case=case.case.model_copy(update=changed))
    case = with_values(case, {k: float(v) for k, v in (s.split("=") for s in options.set)})
    loads = np.arange(options.first, options.to + 1e-6, options.step)
    began = time.process_time()
    pressed = Evaluator(TyreDesign(case), "bundled").press(
        {}, [float(load) for load in loads], rim_stiffness=options.rim
    )
    section = TyreDesign(case).tyre.mesh
    rows = [footprint_row(pressed, each, section) for each in pressed.footprints]
    print("| load, N | deflection, mm | stiffness, N/mm | area, cm2 | length | width, mm |")
    print("|---|---|---|---|---|---|")
    for row in rows:
        print(
            f"| {row['load_N']:.0f} | {1e3 * row['deflection_m']:.4f}"
            f" | {1e-3 * row['vertical_stiffness_N_per_m']:.2f} | {1e4 * row['area_m2']:.2f}"
            f" | {1e3 * row['length_m']:.2f} | {1e3 * row['width_m']:.2f} |"
        )
    load, depth, stiffness, area, length, width = (
        np.array([row[name] for row in rows])
        for name in (
            "load_N",
            "deflection_m",
            "vertical_stiffness_N_per_m",
            "area_m2",
            "length_m",
            "width_m",
        )
    )
    secant = np.diff(load) / np.diff(depth)
    tangent = (stiffness[1:] + stiffness[:-1]) / 2
    print(f"stiffness off a cubic: {100 * off_cubic(load, stiffness):.2f} %")
    print(f"area off a cubic: {100 * off_cubic(load, area):.2f} %")
    for name, i in RIM.items() if options.rim else ():
        k = np.array([np.asarray(each.rim_reactions)[i, i] for each in pressed.footprints])
        print(f"{name} stiffness off a cubic: {100 * off_cubic(load, k):.2f} %")
    print(f"tangent off the secant: {100 * abs(tangent / secant - 1).max():.2f} %")
    print(f"length falls by {1e3 * max(0, -np.diff(length).min()):.3f} mm", end=", ")
    print(f"width by {1e3 * max(0, -np.diff(width).min()):.3f} mm")
    print(f"{time.process_time() - began:.0f} s of processor time")


if __name__ == "__main__":
    main()
