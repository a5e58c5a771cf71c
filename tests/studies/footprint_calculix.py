"""The footprint by CalculiX and by the bundled solver: force and area over meshes, extrapolated.

    nice python -m tests.studies.footprint_calculix --record FILE --work FOLDER --runs NAME ...

Every finished run is a line of the record and is not run again. Deflection counts from the radius
of the same mesh inflated with the road away. Meshes of a family are refined alike along the
section and, at the patch, around the tyre, not through the thickness; force and area are taken
as a + b h^2, h the size of elements. "alike": the bundled solver with CalculiX's cord law (St
Venant and Kirchhoff) and sides straight in the section, its cords on lines.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import resource
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator
from tyrecal_solvers.calculix.results import read_fields
from tyrecal_solvers.calculix.runner import run_job
from tyrecal_solvers.errors import RunFailed

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..solvers.press_deck import Angles, Road, press_texts, read_press, read_radius, run_press
from .calculix import common
from .tread_gap import FINE, GAUSS, area_of_gap, areas_below, areas_of_gap, outside, sunk_in

Array = np.ndarray
ROOT = Path(__file__).parents[2]
CASE = ROOT / "cases" / "p235_75r17.yaml"
INITIAL = {"A_belt": 2.118683e-7, "A_carcass": 4.208352e-7, "C10": 1e6}
DEFLECTIONS_M = (0.006, 0.010, 0.014, 0.018, 0.022, 0.026)
AWAY_M = -0.005  # a road that stays clear of the inflated tyre
REGIONS = ("crown", "upper_sidewall", "lower_sidewall", "bead")
LOADS_N = (500.0, 1000.0, 2000.0, 3000.0, 4000.0, 5000.0, 6000.0)


@dataclass(frozen=True)
class Mesh:
    """size: relative, of elements; along: elements of REGIONS per half; rows: between lines."""

    element: str
    size: float
    along: tuple[int, int, int, int]
    angles: Angles
    rows: tuple[int, ...] = (1, 1, 1, 1)
    thickness_m: float = 2e-4


@dataclass(frozen=True)
class Run:
    """One CalculiX run: its name in the table is its key in the record."""

    mesh: Mesh
    road: Road = field(default_factory=Road)
    largest_increment: float = 1.0
    deflections_m: tuple[float, ...] = DEFLECTIONS_M

    @property
    def size(self) -> float:
        return self.mesh.size


@dataclass(frozen=True)
class Ours:
    """One run of the bundled solver; angles: elements from the patch's middle to the top."""

    size: float
    along: tuple[int, int, int, int]
    angles: tuple[float, ...]
    alike: bool = True
    friction: float = 0.0
    loads_N: tuple[float, ...] = LOADS_N


SMOOTH = Road(friction=0.0)
M0 = Mesh("C3D8", 6.0, (4, 4, 4, 1), Angles(6.0, 24.0, 12.0))
M1 = Mesh("C3D8", 4.0, (6, 6, 6, 1), Angles(4.0, 24.0, 8.0))
M2 = Mesh("C3D8", 3.0, (8, 8, 8, 2), Angles(3.0, 24.0, 12.0))
F8 = Mesh("C3D20", 8.0, (3, 3, 3, 1), Angles(8.0, 24.0, 15.0, 1.6))
F6 = Mesh("C3D20", 6.0, (4, 4, 4, 1), Angles(6.0, 24.0, 15.0, 1.6))
F4 = Mesh("C3D20", 4.0, (6, 6, 6, 1), Angles(4.0, 24.0, 15.0, 1.6))
A6 = (6.0, 6.0, 6.0, 6.0, 9.0, 14.0, 22.0, 36.0, 75.0)
A4 = (4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 6.0, 9.0, 14.0, 22.0, 36.0, 69.0)
A25 = (2.5, 2.5, 2.5, 2.5, 2.5, 2.5, 3.0, 5.0, 8.0, 14.0, 25.0, 44.0, 66.0)
FAMILIES = (("M0", "M1", "M2"), ("F8", "F6", "F4"), ("bundled 6", "bundled 4", "bundled 2.5"))
RUNS: dict[str, Run | Ours] = {
    "M0": Run(M0),
    "M1": Run(M1),
    "M2": Run(M2),
    "M1, patch twice as fine": Run(
        replace(M1, along=(12, 6, 6, 1), angles=Angles(2.0, 24.0, 12.0)),
        deflections_m=(0.010, 0.018, 0.026),
    ),
    "M0, no friction": Run(M0, SMOOTH),
    "M0, penalty doubled": Run(M0, Road(normal=2e10)),
    "M0, stick slope doubled": Run(M0, Road(stick=2e9)),
    "M0, plies 0.1 mm": Run(replace(M0, thickness_m=1e-4)),
    "M0, two rows in the tread": Run(replace(M0, rows=(1, 1, 1, 2))),
    "F8": Run(F8, SMOOTH, deflections_m=(0.010, 0.018, 0.026)),
    "F6": Run(F6, SMOOTH, 0.6, (0.006, 0.010, 0.018, 0.026)),
    "F4": Run(F4, SMOOTH, deflections_m=(0.006, 0.010, 0.018, 0.026)),
    "bundled 6": Ours(6.0, (4, 4, 4, 1), A6),
    "bundled 4": Ours(4.0, (6, 6, 6, 1), A4),
    "bundled 2.5": Ours(2.5, (10, 5, 5, 1), A25, loads_N=(500.0, 1000.0, 2000.0, 4000.0, 6000.0)),
    "bundled 6, as shipped": Ours(6.0, (4, 4, 4, 1), A6, alike=False),
    "bundled 4, as shipped": Ours(4.0, (6, 6, 6, 1), A4, alike=False),
    "bundled 6, as shipped, friction": Ours(6.0, (4, 4, 4, 1), A6, alike=False, friction=0.5),
}


def case_of(run: Run) -> LoadedCase:
    """The case with the run's mesh."""
    options = {"element": run.mesh.element, "ply_thickness_m": run.mesh.thickness_m}
    case = meshed(run.mesh.along, run.mesh.rows)
    solver = case.case.solver.model_copy(update={"options": options})
    return replace(case, case=case.case.model_copy(update={"solver": solver}))


def meshed(along: Sequence[int], rows: Sequence[int]) -> LoadedCase:
    """The main case, initial variables, on a road as hard as CalculiX's."""
    hard = {"road.stiffness_Pa_per_m": Road().normal}
    case = with_values(load_case(CASE), INITIAL | hard)
    mesh = case.case.mesh
    level = mesh.levels[mesh.level].model_copy(
        update={
            "elements": dict(zip(REGIONS, along, strict=True)),
            "rows": tuple(rows),
            "grading": None,
        }
    )
    mesh = mesh.model_copy(update={"levels": {mesh.level: level}})
    return replace(case, case=case.case.model_copy(update={"mesh": mesh}))


def deck(run: Run, deflections_m: Sequence[float], radius_m: float, folder: Path) -> None:
    """Write the run's deck."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = press_texts(
        case_of(run), deflections_m, run.mesh.angles, radius_m, run.road, run.largest_increment
    )
    for name, text in texts.items():
        (folder / name).write_text(text)


def inflated_radius(run: Run, folder: Path, limit_s: float) -> float:
    """Outer radius (m) of the run's mesh, inflated. C3D8's chords make it depend on the mesh round
    the tyre, so that all of it is inflated; C3D20's is one sector's within 0.1 micrometres."""
    if run.mesh.element == "C3D8":
        deck(run, [AWAY_M], 0.3928, folder)
        run_press(folder, ["ccx"], limit_s)
        return read_radius(folder)
    folder.mkdir(parents=True, exist_ok=True)
    texts = Decks(TyreDesign(case_of(run))).texts("calculix")
    for name in ("sector.inp", "inflate.inp"):
        (folder / name).write_text(texts[name])
    run_job(folder, "inflate", ["sector.inp"], ["ccx"], limit_s)
    fields = read_fields(folder / "inflate.frd")
    return float((fields.points + fields.blocks[-1][2])[:, 0].max())


def solve(run: Run, folder: Path, limit_s: float) -> dict[str, Any]:
    """A line of the record; in a process of its own, whose children's memory is the run's."""
    start = time.monotonic()
    try:
        radius = inflated_radius(run, folder / "free", limit_s)
        deck(run, run.deflections_m, radius, folder)
        run_press(folder, ["ccx"], limit_s)
        kept, gaps = sunk_in(folder, run.road.normal), areas_of_gap(folder)
        areas = areas_below(folder, *GAUSS), areas_below(folder, *FINE)
        rows = zip(read_press(folder), kept, gaps, *areas, strict=True)
    except RunFailed as failure:
        return {"failed": f"{failure.cause}: {failure}"}
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        "inflated_radius_m": radius,
        "pressed": [
            {
                **asdict(row),
                "deflection_m": row.deflection_m - kept,
                "kept_m": kept,
                "area_of_gap_m2": area,
                "area_of_gauss_points_m2": points,
                "area_of_surface_m2": surface,
            }
            for row, kept, area, points, surface in rows
        ],
        "wall_s": time.monotonic() - start,
        "cpu_s": used.ru_utime + used.ru_stime,
        "memory_MB": used.ru_maxrss / 1024,
    }


def solve_ours(run: Ours) -> dict[str, Any]:
    """The bundled solver's line of the record."""
    start, used = time.monotonic(), time.process_time()
    case = meshed(run.along, (1, 1, 1, 1))
    road = case.case.road.model_copy(
        update={"friction": run.friction, "element_angles_deg": list(run.angles)}
    )
    solver = case.case.solver.model_copy(update={"time_limit_s": 3000.0})
    case = replace(case, case=case.case.model_copy(update={"road": road, "solver": solver}))
    try:
        with common() if run.alike else nullcontext():
            pressed = Evaluator(TyreDesign(case), "bundled").press({}, run.loads_N)
    except EvaluationFailed as failure:
        return {"failed": str(failure)}
    return {
        "inflated_radius_m": pressed.free_radius_m,
        "pressed": [
            {
                "deflection_m": row.deflection_m,
                "force_N": row.road_N,
                "area_m2": row.contact_area_m2,
                "area_of_nodes_m2": float(row.area_m2.sum()),
                "area_of_gap_m2": float(
                    np.mean([area_of_gap(*outside(pressed, row, side)) for side in (1, -1)])
                ),
            }
            for row in pressed.footprints
        ],
        "wall_s": time.monotonic() - start,
        "cpu_s": time.process_time() - used,
        "memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def at(rows: Sequence[dict[str, float]], deflection_m: float) -> tuple[float, float]:
    """Force (N) and area (cm2) at a deflection, on cubics through nothing and the rows."""
    d, force = (np.array([0.0, *(row[key] for row in rows)]) for key in ("deflection_m", "force_N"))
    area = np.array([0.0, *map(touching, rows)])
    return tuple(float(PchipInterpolator(d, y)(deflection_m)) for y in (force, 1e4 * area))  # type: ignore[return-value]


def touching(row: dict[str, float]) -> float:
    """Area (m2) of the points (CalculiX) or nodes (bundled) that touch."""
    return row.get("area_of_nodes_m2", row["area_m2"])


def extrapolated(sizes: Sequence[float], values: Sequence[float]) -> tuple[float, float]:
    """a of a + b h^2, and its error: how far what two meshes alone give lies from it.

    Of two meshes in all: how far the finer is from it.
    """
    matrix = np.stack([np.ones(len(sizes)), np.square(sizes)], -1)
    a = np.linalg.lstsq(matrix, np.array(values), rcond=None)[0][0]
    if len(sizes) == 2:
        return float(a), float(abs(a - values[-1]))
    pairs = [
        np.linalg.solve(matrix[i : i + 2], values[i : i + 2])[0] for i in range(len(sizes) - 1)
    ]
    return float(a), float(np.abs(np.array(pairs) - a).max())


def table(done: dict[str, dict[str, Any]]) -> None:
    """Print all runs, then the families' extrapolations."""
    print("| run | mm | force, N | area, cm2 | cpu, s | wall, s | memory, MB |")
    print("|---|---|---|---|---|---|---|")
    for name in [name for name in RUNS if name in done]:
        line = done[name]
        for row in line["pressed"]:
            print(f"| {name} | {1e3 * row['deflection_m']:.3f}", end=" | ")
            print(f"{row['force_N']:.1f} | {1e4 * touching(row):.2f}", end=" | ")
            print(f"{line['cpu_s']:.0f} | {line['wall_s']:.0f} | {line['memory_MB']:.0f} |")
    for family in FAMILIES:
        _extrapolate({name: done[name] for name in family if name in done})


def _extrapolate(family: dict[str, dict[str, Any]]) -> None:
    if len(family) < 2:
        return
    sizes = [RUNS[name].size for name in family]
    least = max(line["pressed"][0]["deflection_m"] for line in family.values())
    most = min(line["pressed"][-1]["deflection_m"] for line in family.values())
    print(f"\nExtrapolated to h = 0 over {', '.join(family)}:\n")
    print("| mm | force, N | error | area, cm2 | error |\n|---|---|---|---|---|")
    for d in [d for d in DEFLECTIONS_M if least <= d < most + 1e-5]:
        meshes = [at(line["pressed"], d) for line in family.values()]
        force, force_error = extrapolated(sizes, [force for force, _ in meshes])
        area, area_error = extrapolated(sizes, [area for _, area in meshes])
        print(f"| {1e3 * d:g} | {force:.1f} | {force_error:.1f}", end=" | ")
        print(f"{area:.2f} | {area_error:.2f} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", type=Path, required=True, help="a JSON line per finished run")
    parser.add_argument("--work", type=Path, required=True, help="folder for decks and results")
    parser.add_argument("--runs", nargs="*", default=[], choices=RUNS, help="what is to run")
    parser.add_argument("--limit-s", type=float, default=3600.0, help="time limit of a run")
    options = parser.parse_args()
    lines = options.record.read_text().splitlines() if options.record.exists() else []
    done = {line["run"]: line for line in map(json.loads, lines)}
    for name in [name for name in options.runs if name not in done]:
        run, folder = RUNS[name], options.work / name.replace(" ", "_").replace(",", "")
        with ProcessPoolExecutor(1) as one:
            if isinstance(run, Ours):
                answer = one.submit(solve_ours, run).result()
            else:
                answer = one.submit(solve, run, folder, options.limit_s).result()
        if "failed" in answer:
            print(f"{name}: {answer['failed']}", file=sys.stderr)
            continue
        done[name] = {"run": name, **answer}
        with options.record.open("a") as record:
            record.write(json.dumps(done[name]) + "\n")
    table(done)


if __name__ == "__main__":
    main()
