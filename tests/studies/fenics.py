"""The bundled solver against FEniCSx and SLEPc: modes of both sections at three pressures.

    apt-get install python3-dolfinx
    python -m tests.studies.fenics FOLDER > table.md

FOLDER keeps FEniCSx's answers; the same command goes on where it was stopped. FEniCSx's part is
`judge_fenics.py`, by Debian's own Python. It is given one of three problems:

common: the bundled solver's mesh, elements (serendipity, 2 x 2 points) and laws.
own elements and laws: numbers of the case alone; cubic triangles on a mesh of its own, integrated
in full; rubber's energy and the cords' virtual work as ABAQUS's manual states those of the decks.
other laws: the same with cords' nominal strain for their logarithmic one, ln^2 J for (J - 1)^2.

And differences between CalculiX and the bundled solver, one thing switched at a time in FEniCSx:

    python -m tests.studies.fenics switches FOLDER RECORD > table.md

RECORD: CalculiX's answers.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import hashlib
import json
import subprocess
import sys
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.simulate.deck.calculix import FILLER, PARTS, PLY_THICKNESS_M, calculix_context
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import HarmonicShape, RawMode
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.find import match
from tyrecal.simulate.modes.label import Label, Mode, label_modes
from tyrecal.simulate.modes.rings import mac
from tyrecal.studies.blind.make import Truth, tyre
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

from .blind_calculix import base, laws_confirmed, recorded
from .calculix import (
    CASES,
    DRAWN,
    INITIAL,
    OPTIMISED,
    ROOT,
    at,
    common,
    modes_of,
    off,
    on_common_nodes,
    split,
)
from .judge import PYTHON, tyre_told

Array = np.ndarray


DESIGNS = {"initial": INITIAL, "optimised": OPTIMISED}
PRESSURES_kPa = (160.0, 240.0, 320.0)
NUMERICS = {
    "inflation": [[1.0, 1e7], [1.0, 1e6], [1.0, 1e5], [1.0, 0.0]],  # share of p, Pa of help
    "harmonics": [0, 1, 2, 3, 4],
    "modes": 2,
}
LAWS = {"cord_law": "logarithmic", "volume_law": "J - 1"}
OWN_LAWS = {"cord_law": "true stress", "volume_law": "J - 1"}
OTHER_LAWS = {"cord_law": "nominal", "volume_law": "ln J"}
OWN_ELEMENTS = {"element": ["P", 3], "quadrature": 6, "full_quadrature": 8}
OWN_MESH = {"along": [12, 20], "rows": [1, 1, 1, 4]}


def common_problem(case: LoadedCase) -> dict[str, Any]:
    """The bundled solver's discrete problem."""
    tyre = resolved(case)
    c, mesh = tyre.case, tyre.mesh
    place = {number: k for k, number in enumerate(mesh.nodes)}
    rim = set(mesh.rim)
    sides = {pair for s in mesh.solids.values() for pair in pairwise((*s[:4], s[0]))}
    cords = []
    for layer in c.rebar_layers.values():
        cord: Any = c.materials[layer.material]
        assert layer.spacing_m
        per_area = layer.area_m2 / layer.spacing_m
        data = [
            cord.youngs_modulus_Pa * per_area,
            float(np.radians(layer.angle_deg)),
            cord.density_kg_per_m3 * per_area,
        ]
        for first, *_, last in mesh.cords[layer.line].values():
            cords.append([place[first], place[last], *data])
    tyre_data = tyre_told(case)
    return {
        **{key: tyre_data[key] for key in ("pressure", "C10", "C01", "D1", "density")},
        **{"element": ["S", 2], "quadrature": 3, "full_quadrature": 5, **LAWS, **NUMERICS},
        "nodes": list(mesh.nodes.values()),
        "quads": [[place[n] for n in solid] for solid in mesh.solids.values()],
        "rows": [row for _, row in mesh.cells.values()],
        "cords": cords,
        "inner": [[place[mesh.solids[s][3]], place[mesh.solids[s][0]]] for s in mesh.inner],
        "held": sorted([place[a], place[b]] for a, b in sides if {a, b} <= rim),
    }


def own_problem(case: LoadedCase, laws: dict[str, str]) -> dict[str, Any]:
    """Numbers of the case, to be meshed by the judge."""
    return {**tyre_told(case), **OWN_MESH, **OWN_ELEMENTS, **laws, **NUMERICS}


def ask(folder: Path, problem: dict[str, Any]) -> dict[str, Any]:
    """FEniCSx's answer, from the folder where it is known. Raises CalledProcessError."""
    text = json.dumps(problem, sort_keys=True)
    name = hashlib.sha256(text.encode()).hexdigest()[:16]
    problem_file, answer_file = (
        folder.resolve() / f"{name}{end}" for end in (".problem.json", ".json")
    )
    if not answer_file.exists():
        folder.mkdir(parents=True, exist_ok=True)
        problem_file.write_text(text, encoding="utf-8")
        command = [PYTHON, "-m", "tests.studies.judge_fenics", str(problem_file), str(answer_file)]
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    answer: dict[str, Any] = json.loads(answer_file.read_text(encoding="utf-8"))
    return answer


def labelled(answer: dict[str, Any], labels: list[Label]) -> dict[str, Mode]:
    """FEniCSx's modes by the text of their label. Raises EvaluationFailed, ValueError."""
    points, raw = np.array(answer["points"]), []
    for mode in answer["modes"]:
        if mode["eigenvalue"] <= 0:
            raise ValueError(f"the state is unstable: {mode['eigenvalue']:g} of n = {mode['n']}")
        amplitude = np.array(mode["cos"]) + 1j * np.array(mode["sin"])
        shape = HarmonicShape(mode["n"], np.array(answer["corners"]), points, amplitude)
        frequency = float(np.sqrt(mode["eigenvalue"]) / (2 * np.pi))
        raw.append(RawMode(frequency, shape, 2 if mode["n"] else 1))
    return {str(label): mode for label, mode in match(label_modes(raw), labels).items()}


@dataclass(frozen=True)
class Common:
    """The bundled solver's modes and FEniCSx's on its discrete problem, both tyres' masses, and the
    largest distance of their inflated states."""

    ours: dict[str, Mode]
    theirs: dict[str, Mode]
    mass_kg: tuple[float, float]
    apart_m: float

    def mac(self, label: str) -> float:
        a, b = self.ours[label].raw.shape, self.theirs[label].raw.shape
        assert isinstance(a, HarmonicShape) and isinstance(b, HarmonicShape)
        return mac(*on_common_nodes(a, b))


def targets(case: LoadedCase) -> list[Label]:
    """The modes that are compared."""
    assert case.case.targets
    return [Label(t.c, t.m, t.kind) for t in case.case.targets.modes]


def on_common(case: LoadedCase, folder: Path) -> Common:
    """Compare both solvers on the bundled one's discrete problem."""
    answer = Evaluator(TyreDesign(case), "bundled").evaluate(Question({}))
    ours = match(label_modes(answer.modes), targets(case))
    same = ask(folder, common_problem(case))
    numbers = np.array(list(resolved(case).mesh.nodes))[same["corners"]]
    place = {int(number): k for k, number in enumerate(answer.nodes)}
    inflated = answer.displacement[[place[int(number)] for number in numbers]]
    return Common(
        {str(label): mode for label, mode in ours.items()},
        labelled(same, targets(case)),
        (answer.mass_kg, same["mass_kg"]),
        float(abs(inflated - np.array(same["displacement"])).max()),
    )


@dataclass(frozen=True)
class Row:
    """One mode: Hz of the bundled solver; its deviation from FEniCSx, in %, on the three problems;
    MAC on the common one."""

    mode: str
    frequency_Hz: float
    common: float
    mac: float
    elements: float
    laws: float


def compare(case: LoadedCase, folder: Path) -> tuple[list[Row], float]:
    """The case's target modes, and the largest distance of the inflated states, m."""
    solved = on_common(case, folder)
    own = [
        labelled(ask(folder, own_problem(case, laws)), targets(case))
        for laws in (OWN_LAWS, OTHER_LAWS)
    ]
    rows = []
    for key, mode in solved.ours.items():
        shares = [off(mode, judge[key]) for judge in (solved.theirs, *own)]
        rows.append(Row(key, mode.frequency_Hz, shares[0], solved.mac(key), *shares[1:]))
    return rows, solved.apart_m


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    print(
        "| case | design | kPa | common problem | smallest MAC | inflated states apart, nm |",
        end="",
    )
    print(" own elements and laws | other laws |\n|---|---|---|---|---|---|---|---|")
    every: list[Row] = []
    full: list[tuple[str, Row]] = []
    for name in CASES:
        for design, values in DESIGNS.items():
            for pressure in PRESSURES_kPa:
                rows, apart = compare(at(name, values, pressure), folder)
                where = f"| {name} | {design} | {pressure:g} |"
                worst = lambda key, rows=rows: max((getattr(r, key) for r in rows), key=abs)
                least = min(r.mac for r in rows)
                print(f"{where} {worst('common'):+.1e} % | {least:.9f} | {1e9 * apart:.2g}", end="")
                print(f" | {worst('elements'):+.3f} % | {worst('laws'):+.3f} % |", flush=True)
                every += rows
                full += [(where, row) for row in rows if design == "initial"]
    print("\n| case | design | kPa | mode | bundled, Hz | common problem |", end="")
    print(" own elements and laws | other laws |\n|---|---|---|---|---|---|---|---|")
    for where, r in full:
        print(f"{where} {r.mode} | {r.frequency_Hz:.4f} | {r.common:+.1e} %", end="")
        print(f" | {r.elements:+.3f} % | {r.laws:+.3f} % |")
    most = lambda key: max(abs(getattr(r, key)) for r in every)
    print(
        f"\n{len(every)} modes; largest deviation on the common problem {most('common'):.1e} %,"
        f" with its own elements and laws {most('elements'):.3f} %, with other laws"
        f" {most('laws'):.3f} %"
    )


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


def switches(folder: Path, record: Store) -> None:
    """One thing switched at a time."""
    worst_row(folder, record)
    refused_state(folder, record)


if __name__ == "__main__":
    if sys.argv[1:2] == ["switches"]:
        switches(Path(sys.argv[2]), Store(Path(sys.argv[3])))
    else:
        main()
