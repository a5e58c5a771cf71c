"""A load by the bundled solver and by CalculiX in one run: wall time, force and area.

    python -m tests.benchmarks.footprint_calculix FOLDER

No friction, from nothing to the deflection that the bundled solver finds at 2 kN on the section's
and the patch's mesh of CalculiX's F6 (`tests/studies/footprint_calculix.py`), with its cord law and
straight sides; CalculiX is asked for the same deflection. The default mesh as shipped is timed
beside them. The bundled solver's time is the whole evaluation, CalculiX's is ccx alone; the
bundled solver runs before and after CalculiX.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
import time
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from tests.solvers.press_deck import read_press, run_press
from tests.studies.calculix import common
from tests.studies.footprint_calculix import (
    A6,
    CASE,
    INITIAL,
    RUNS,
    Run,
    deck,
    inflated_radius,
    meshed,
)
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

LOAD_N = 2000.0
LIMIT_S = 3000.0
Row = tuple[float, float, float, float]  # wall time, s; deflection, m; force, N; area, m2


def without_friction(case: LoadedCase) -> LoadedCase:
    road = case.case.road.model_copy(update={"friction": 0.0})
    return replace(case, case=case.case.model_copy(update={"road": road}))


def bundled(case: LoadedCase, alike: bool) -> Row:
    with common() if alike else nullcontext():
        start = time.perf_counter()
        (row,) = Evaluator(TyreDesign(case), "bundled").press({}, (LOAD_N,)).footprints
        seconds = time.perf_counter() - start
    return seconds, row.deflection_m, row.road_N, float(row.area_m2.sum())


def calculix(deflection_m: float, folder: Path) -> Row:
    run = RUNS["F6"]
    assert isinstance(run, Run)
    run = replace(run, deflections_m=(deflection_m,))
    deck(run, run.deflections_m, inflated_radius(run, folder / "free", LIMIT_S), folder)
    start = time.perf_counter()
    run_press(folder, ["ccx"], LIMIT_S)
    seconds = time.perf_counter() - start
    (row,) = read_press(folder)
    return seconds, row.deflection_m, row.force_N, row.area_m2


def main(folder: Path) -> None:
    rows: dict[str, list[Row]] = {"bundled, 6°": [], "bundled, default mesh": [], "CalculiX F6": []}
    same = without_friction(meshed((4, 4, 4, 1), (1, 1, 1, 1)))
    road = same.case.road.model_copy(update={"element_angles_deg": list(A6)})
    same = replace(same, case=same.case.model_copy(update={"road": road}))
    shipped = without_friction(with_values(load_case(CASE), INITIAL))

    def ours() -> None:
        rows["bundled, 6°"].append(bundled(same, alike=True))
        rows["bundled, default mesh"].append(bundled(shipped, alike=False))

    ours()
    rows["CalculiX F6"].append(calculix(rows["bundled, 6°"][0][1], folder))
    ours()
    judge = rows["CalculiX F6"][0][0]
    print("| run | wall, s | deflection, mm | force, N | area, cm² | CalculiX takes, times |")
    print("|---|---|---|---|---|---|")
    for name, entries in rows.items():
        _, deflection, force, area = entries[0]
        times = [seconds for seconds, *_ in entries]
        print(
            f"| {name} | {' and '.join(f'{s:.1f}' for s in times)} | {1e3 * deflection:.3f}", end=""
        )
        print(f" | {force:.0f} | {1e4 * area:.1f} | {judge / max(times):.0f} |", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
