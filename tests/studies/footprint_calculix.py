"""The footprint by CalculiX: force and area at given deflections, over meshes, extrapolated.

    nice python tests/studies/footprint_calculix.py --record runs.jsonl --work FOLDER > table.md

Every finished run is a line of the record and is not run again. Deflection counts from the radius
of the same mesh inflated with the road away. Meshes of a family are refined alike along the
section and, at the patch, around the tyre, not through the thickness; force and area are taken
as a + b h^2, h the size of elements.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from tyrecal_solvers.calculix.press import read_press, read_radius, run_press
from tyrecal_solvers.process import RunFailed

from tyrecal.case import LoadedCase, load_case, with_values
from tyrecal.deck.environment import environment
from tyrecal.deck.press import Angles, Road, press_texts

ROOT = Path(__file__).parents[2]
CASE = ROOT / "cases" / "p235_75r17.yaml"
DESIGNS = {
    "initial": {"A_belt": 2.118683e-7, "A_carcass": 4.208352e-7, "C10": 1e6},
    "optimised": {"A_belt": 3.64826e-7, "A_carcass": 8.01133e-8, "C10": 1e6},  # by the paper
}
DEFLECTIONS_M = (0.006, 0.010, 0.014, 0.018, 0.022, 0.026)
AWAY_M = -0.005  # a road that stays clear of the inflated tyre
REGIONS = ("crown", "upper_sidewall", "lower_sidewall", "bead")


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

    design: str
    mesh: Mesh
    road: Road = field(default_factory=Road)
    largest_increment: float = 1.0
    deflections_m: tuple[float, ...] = DEFLECTIONS_M


M0 = Mesh("C3D8", 6.0, (4, 4, 4, 1), Angles(6.0, 24.0, 12.0))
M1 = Mesh("C3D8", 4.0, (6, 6, 6, 1), Angles(4.0, 24.0, 8.0))
M2 = Mesh("C3D8", 3.0, (8, 8, 8, 2), Angles(3.0, 24.0, 12.0))
M3 = Mesh("C3D8", 2.0, (12, 12, 12, 2), Angles(2.0, 24.0, 12.0))
FAMILIES = (("M0", "M1", "M2", "M3"), ("Q2", "Q3"))
RUNS = {
    "M0": Run("initial", M0),
    "M1": Run("initial", M1),
    "M0, penalty 1e11": Run("initial", M0, Road(normal=1e11)),
    "M1, penalty 1e11": Run("initial", M1, Road(normal=1e11)),
    "M2, penalty 1e11": Run("initial", M2, Road(normal=1e11)),
    "M1, patch twice as fine": Run(
        "initial",
        replace(M1, along=(12, 6, 6, 1), angles=Angles(2.0, 24.0, 12.0)),
        deflections_m=(0.010, 0.018, 0.026),
    ),
    "M0 at 18 mm": Run("initial", M0, deflections_m=(0.018,)),
    "M0, no friction": Run("initial", M0, Road(friction=0.0)),
    "M0, penalty doubled": Run("initial", M0, Road(normal=2e10)),
    "M0, stick slope doubled": Run("initial", M0, Road(stick=2e9)),
    "M0, half the increment": Run("initial", M0, largest_increment=0.5),
    "M0, plies 0.1 mm": Run("initial", replace(M0, thickness_m=1e-4)),
    "M0, two rows in the tread": Run("initial", replace(M0, rows=(1, 1, 1, 2))),
    "M0, crown twice as fine": Run("initial", replace(M0, along=(8, 4, 4, 1))),
    "M0, the whole tyre": Run("initial", replace(M0, angles=replace(M0.angles, whole=True))),
    "M0, optimised": Run("optimised", M0),
    "M2": Run("initial", M2),
    "M3": Run("initial", M3),
    "M1, optimised": Run("optimised", M1),
    "Q2 at 18 mm": Run(
        "initial",
        Mesh("C3D20R", 4.0, (4, 4, 4, 1), Angles(4.0, 24.0, 12.0)),
        deflections_m=(0.018,),
    ),
    "Q2": Run("initial", Mesh("C3D20R", 4.0, (4, 4, 4, 1), Angles(4.0, 24.0, 12.0))),
    "Q3": Run("initial", Mesh("C3D20R", 3.0, (6, 6, 6, 1), Angles(3.0, 24.0, 12.0))),
}


def case_of(run: Run) -> LoadedCase:
    """The case with the run's variables and mesh."""
    case = with_values(load_case(CASE), DESIGNS[run.design])
    c, mesh = case.case, run.mesh
    level = c.mesh.levels[c.mesh.level].model_copy(
        update={
            "elements": dict(zip(REGIONS, mesh.along, strict=True)),
            "rows": mesh.rows,
            "grading": None,
        }
    )
    options = {"element": mesh.element, "ply_thickness_m": mesh.thickness_m}
    changes = {
        "mesh": c.mesh.model_copy(update={"levels": {c.mesh.level: level}}),
        "solver": c.solver.model_copy(update={"options": options}),
    }
    return replace(case, case=c.model_copy(update=changes))


def deck(run: Run, deflections_m: Sequence[float], radius_m: float, folder: Path) -> None:
    """Write the run's deck."""
    folder.mkdir(parents=True, exist_ok=True)
    env = environment("calculix", None)
    texts = press_texts(
        case_of(run), env, deflections_m, run.mesh.angles, radius_m, run.road, run.largest_increment
    )
    for name, text in texts.items():
        (folder / name).write_text(text)


def solve(run: Run, folder: Path, limit_s: float) -> dict[str, Any]:
    """A line of the record; in a process of its own, whose children's memory is the run's."""
    start = time.monotonic()
    try:
        deck(run, [AWAY_M], 0.3928, folder / "free")
        run_press(folder / "free", ["ccx"], limit_s)
        radius = read_radius(folder / "free")
        deck(run, run.deflections_m, radius, folder)
        run_press(folder, ["ccx"], limit_s)
        pressed = [asdict(row) for row in read_press(folder)]
    except RunFailed as failure:
        return {"failed": f"{failure.cause}: {failure}"}
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        "inflated_radius_m": radius,
        "pressed": pressed,
        "wall_s": time.monotonic() - start,
        "cpu_s": used.ru_utime + used.ru_stime,
        "memory_MB": used.ru_maxrss / 1024,
    }


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
    """All runs, then the family's extrapolation."""
    print("| run | element | mm | force, N | area, cm2 | cpu, s | wall, s | memory, MB |")
    print("|---|---|---|---|---|---|---|---|")
    for name in [name for name in RUNS if name in done]:
        line, element = done[name], RUNS[name].mesh.element
        for row in line["pressed"]:
            print(f"| {name} | {element} | {1e3 * row['deflection_m']:g}", end=" | ")
            print(f"{row['force_N']:.1f} | {1e4 * row['area_m2']:.2f}", end=" | ")
            print(f"{line['cpu_s']:.0f} | {line['wall_s']:.0f} | {line['memory_MB']:.0f} |")
    for family in FAMILIES:
        _extrapolate({name: done[name] for name in family if name in done})


def _extrapolate(family: dict[str, dict[str, Any]]) -> None:
    if len(family) < 2:
        return
    sizes = [RUNS[name].mesh.size for name in family]
    print(f"\nExtrapolated to h = 0 over {', '.join(family)}:\n")
    print("| mm | force, N | error | area, cm2 | error |\n|---|---|---|---|---|")
    for rows in zip(*(line["pressed"] for line in family.values()), strict=False):
        force, force_error = extrapolated(sizes, [row["force_N"] for row in rows])
        area, area_error = extrapolated(sizes, [1e4 * row["area_m2"] for row in rows])
        print(f"| {1e3 * rows[0]['deflection_m']:g} | {force:.1f} | {force_error:.1f}", end=" | ")
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
        folder = options.work / name.replace(" ", "_").replace(",", "")
        with ProcessPoolExecutor(1) as one:
            answer = one.submit(solve, RUNS[name], folder, options.limit_s).result()
        if "failed" in answer:
            print(f"{name}: {answer['failed']}", file=sys.stderr)
            continue
        done[name] = {"run": name, **answer}
        with options.record.open("a") as record:
            record.write(json.dumps(done[name]) + "\n")
    table(done)


if __name__ == "__main__":
    main()
