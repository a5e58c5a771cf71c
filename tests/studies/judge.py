"""The pressed tyre by GetFEM and by the bundled solver: force, area, stiffness, equally deep.

    python -m tests.studies.judge FOLDER [--deflections-mm 10 18] [--modes 12]
        [--road-Pa-per-m 1e10] [--along 3 4] [--angles-deg 6 6 6 8 ...]

GetFEM's part (`judge_getfem.py`, by Debian's own Python and python3-getfem) is given numbers of the
case alone: stations, constants, cords. It is run once a FOLDER; the bundled solver each time, at
loads that bring it to GetFEM's deflections. No friction in either, one row between lines and the
case's default mesh; the road is as stiff in both. ``--along``, ``--angles-deg``: GetFEM's elements
along the crown and the sidewall of half the section, and from the patch's middle to the top.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from pathlib import Path
from typing import Any

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.parts import Cord, Rubber
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

ROOT = Path(__file__).parents[2]
CASE = ROOT / "cases" / "p235_75r17.yaml"
PYTHON = "/usr/bin/python3"  # that Debian's python3-getfem is of
ANGLES = [6, 6, 6, 8, 12, 18, 22, 25, 25, 26, 26]  # degrees, from the patch's middle to the top
CLOSE = 1e-6  # m, between the two deflections


def tyre_told(case: LoadedCase) -> dict[str, Any]:
    """Numbers of the case: all that a judge knows of the tyre."""
    c = case.case
    assert c.section.stations
    rubber = c.materials["rubber"]
    assert isinstance(rubber, Rubber)
    cords = {}
    for layer in c.rebar_layers.values():
        cord = c.materials[layer.material]
        assert isinstance(cord, Cord)
        cords[layer.line] = {
            "modulus": cord.youngs_modulus_Pa,
            "area": layer.area_m2,
            "spacing": layer.spacing_m,
            "angle_deg": layer.angle_deg,
            "density": cord.density_kg_per_m3,
        }
    return {
        "stations": str(case.path.with_name(c.section.stations).resolve()),
        "pressure": 1e3 * c.pressure_kPa,
        "C10": rubber.C10_Pa,
        "C01": rubber.C01_Pa,
        "D1": rubber.D1_per_Pa,
        "density": rubber.density_kg_per_m3,
        "cords": cords,
    }


def problem(options: argparse.Namespace) -> dict[str, Any]:
    """Problem that GetFEM solves."""
    return {
        **tyre_told(load_case(CASE)),
        "along": options.along,
        "rows": [1, 1, 1, 1],
        "angles_deg": options.angles_deg,
        "road": options.road_Pa_per_m,
        "contact_cells": 2,
        "help_Pa": [1e7, 1e6, 1e5, 0.0],
        "deflections_m": [depth * 1e-3 for depth in options.deflections_mm],
        "steps": 1,
        "modes": options.modes,
    }


def at_deflection(evaluator: Evaluator, depth: float, load: float) -> dict[str, float]:
    """The bundled solver's answer at a deflection (m), from a load (N) near it."""
    for _ in range(4):
        (footprint,) = evaluator.press({}, [load]).footprints
        lack = depth - footprint.deflection_m
        if abs(lack) < CLOSE:
            break
        load += lack * footprint.stiffness_N_per_m
    assert footprint.contact_area_m2
    return {
        "force_N": load,
        "area_m2": footprint.contact_area_m2,
        "stiffness_N_per_m": footprint.stiffness_N_per_m,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--deflections-mm", type=float, nargs="+", default=[10.0, 18.0])
    parser.add_argument("--modes", type=int, default=0, help="of GetFEM's, minutes more each load")
    parser.add_argument("--road-Pa-per-m", type=float, default=1e10)
    parser.add_argument("--along", type=int, nargs=2, default=[3, 4])
    parser.add_argument("--angles-deg", type=float, nargs="+", default=ANGLES)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    problem_file, answer_file = options.folder / "problem.json", options.folder / "getfem.json"
    if not answer_file.exists():
        problem_file.write_text(json.dumps(problem(options), indent=1))
        command = [
            PYTHON,
            "-m",
            "tests.studies.judge_getfem",
            *map(str, map(Path.resolve, (problem_file, answer_file))),
        ]
        subprocess.run(command, cwd=ROOT, check=True)
    judge = json.loads(answer_file.read_text())
    road = {
        "road.friction": 0.0,
        "road.stiffness_Pa_per_m": json.loads(problem_file.read_text())["road"],
    }
    evaluator = Evaluator(TyreDesign(with_values(load_case(CASE), road)))
    for each in judge["loads"]:
        print(f"{1e3 * each['deflection_m']:g} mm")
        for key, value in at_deflection(evaluator, each["deflection_m"], each["force_N"]).items():
            off = 100 * (value / each[key] - 1)
            print(f"  {key}: {value:.6g}, GetFEM {each[key]:.6g}, {off:+.2f} %")


if __name__ == "__main__":
    main()
