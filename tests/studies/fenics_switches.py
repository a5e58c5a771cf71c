"""Differences between CalculiX and the bundled solver, one thing switched at a time in FEniCSx.

    python -m tests.studies.fenics_switches FOLDER RECORD > table.md

FOLDER: FEniCSx's answers (`fenics.py`); RECORD: CalculiX's.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.simulate.deck.calculix import FILLER, PARTS, PLY_THICKNESS_M, calculix_context
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import Mode
from tyrecal.studies.blind.make import Truth, tyre
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

from .blind_calculix import base, laws_confirmed, recorded
from .calculix import CASES, DRAWN, at, common, modes_of, off, split
from .fenics import LAWS, NUMERICS, ask, common_problem, labelled, targets
from .judge import tyre_told

BELOW = -3e6  # 1/s2, below any eigenvalue that was seen


def deck_problem(case: LoadedCase) -> dict[str, Any]:
    """The section of CalculiX's deck: plies as rows of elements, no sectors."""
    tyre = resolved(case)
    context, c = calculix_context(tyre), tyre.case
    sector = context["sector"]
    front, rim = set(sector.section), set(sector.rim)
    place = {number: k for k, number in enumerate(sector.section)}
    where = {number: (x, z) for number, x, _, z in sector.nodes if number in front}
    cells = list(sector.bricks)
    quads = {cell: [*b[:4], *b[8:12]] for cell, b in sector.bricks.items()}
    plies = []
    for layer in c.rebar_layers.values():
        cord: Any = c.materials[layer.material]
        cos, sin = np.cos(np.radians(layer.angle_deg)), np.sin(np.radians(layer.angle_deg))
        for strip in sector.strips[layer.line]:
            share = layer.area_m2 / (layer.spacing_m * strip.thickness)
            along = [cos * strip.along[0], sin, cos * strip.along[1]]
            stiffness = cord.youngs_modulus_Pa * share
            cell = cells.index(strip.element)
            plies.append([cell, stiffness, *map(float, along), cord.density_kg_per_m3 * share])
    tyre_data = tyre_told(case)
    sides = {pair for q in quads.values() for pair in pairwise((*q[:4], q[0]))}
    return {
        **{key: tyre_data[key] for key in ("pressure", "C10", "C01", "D1", "density")},
        **{"element": ["S", 2], "quadrature": 3, "full_quadrature": 5, **LAWS, **NUMERICS},
        "cord_law": "Green",
        "nodes": [where[number] for number in sector.section],
        "quads": [[place[n] for n in quads[cell]] for cell in cells],
        "rows": [sector.rows[cell] for cell in cells],
        "cords": [],
        "plies": plies,
        "inner": [[place[quads[cell][3]], place[quads[cell][0]]] for cell in sector.inner],
        "held": sorted([place[a], place[b]] for a, b in sides if {a, b} <= rim),
    }


def modes_by_fenics(case: LoadedCase, problem: dict[str, Any], folder: Path) -> dict[str, Mode]:
    """FEniCSx's target modes of a problem."""
    return labelled(ask(folder, problem), targets(case))


def in_deck(case: LoadedCase, sectors: int = 180, ply_m: float = PLY_THICKNESS_M) -> LoadedCase:
    """The case with so many sectors, and plies so thick, in CalculiX's deck."""
    c = case.case
    analysis = c.analysis.model_copy(update={"sectors": sectors // PARTS})
    options = {"element": "C3D20R", "ply_thickness_m": ply_m}
    solver = c.solver.model_copy(update={"options": options})
    return replace(case, case=c.model_copy(update={"analysis": analysis, "solver": solver}))


def between(after: dict[str, Mode], before: dict[str, Mode]) -> str:
    """Least and largest difference of all modes, %."""
    by = [off(after[key], before[key]) for key in before]
    return f"{min(by):+.4f} to {max(by):+.4f}"


def worst_row(folder: Path, record: Store) -> None:
    """Steps from the bundled solver to CalculiX, each by itself."""
    case = at(CASES[0], *DRAWN[3])
    with common():
        halves = split(case, PLY_THICKNESS_M)
        ours = modes_of(halves, "bundled")
        same = {**common_problem(halves), "cord_law": "Green"}
    deck = deck_problem(case)
    filled = {**deck, "filler": FILLER}
    steps = [
        ("FEniCSx for the bundled solver", modes_by_fenics(case, same, folder)),
        ("a row of elements a ply, for two lines", modes_by_fenics(case, deck, folder)),
        ("its filler, 1e-6 of its stiffness all ways", modes_by_fenics(case, filled, folder)),
    ]
    for n in (180, 120, 360):
        steps.append((f"CalculiX, {n} sectors", modes_of(in_deck(case, n), "calculix", record)))
    print("| switched | [2,1], % | nine modes, % |\n|---|---|---|")
    before = ours
    for name, changed in steps:
        print(f"| {name} | {off(changed['[2,1]'], before['[2,1]']):+.4f}", end="")
        print(f" | {between(changed, before)} |", flush=True)
        before = changed
    print(f"| all | {off(before['[2,1]'], ours['[2,1]']):+.4f} | {between(before, ours)} |\n")


def refused() -> LoadedCase:
    """The tyre with wider belts whose state CalculiX calls unstable."""
    (e,) = (entry for entry in recorded("confirm") if "failed" in entry)
    truth = Truth("", "", e["law"], e["size"], e["variables"], e["constants"], 0, False)
    own_sources, _ = sources(base())
    return tyre(truth, base(), own_sources, e["pressure_kPa"], laws_confirmed()[e["law"]])


def refused_state(folder: Path, record: Store) -> None:
    """State of that tyre by FEniCSx, and by CalculiX with one thing switched."""
    case = refused()
    filled = {**deck_problem(case), "filler": FILLER}
    waves = {**filled, "harmonics": [*range(5), *range(20, 201, 20)], "target": BELOW}
    modes = ask(folder, waves)["modes"]
    least = min(modes, key=lambda mode: mode["eigenvalue"])
    print(f"FEniCSx, n = 0 to 4, 20, 40 ... 200: the eigenvalue nearest to {BELOW:g} 1/s2", end="")
    print(f" is {least['eigenvalue']:.6g}, of n = {least['n']}\n")
    more = with_values(case, {"pressure_kPa": case.case.pressure_kPa + 1})
    print("| CalculiX | its modes from FEniCSx's of the same section, % |\n|---|---|")
    for name, switched in (
        ("as it was, 180 sectors", in_deck(case)),
        ("120 sectors", in_deck(case, 120)),
        ("360 sectors", in_deck(case, 360)),
        ("plies of 0.1 mm", in_deck(case, ply_m=1e-4)),
        ("1 kPa more", in_deck(more)),
    ):
        try:
            theirs = modes_of(switched, "calculix", record)
        except EvaluationFailed as failure:
            print(f"| {name} | {failure} |", flush=True)
            continue
        problem = {**deck_problem(switched), "filler": FILLER}
        print(f"| {name} | {between(theirs, modes_by_fenics(case, problem, folder))} |", flush=True)


def main() -> None:
    folder, record = Path(sys.argv[1]), Store(Path(sys.argv[2]))
    worst_row(folder, record)
    refused_state(folder, record)


if __name__ == "__main__":
    main()
