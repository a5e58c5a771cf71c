"""A diagnosis on CalculiX from end to end, against the bundled solver's on the same data.

    python -m tests.studies.diagnose_calculix FOLDER                         # goes on
    python -m tests.studies.diagnose_calculix FOLDER bead_filler [OTHER ...] # with few candidates
    python -m tests.studies.diagnose_calculix table > table.md

The bundled solver makes data of a tyre with an effect, or with none ("sound"), with scatter; both
solvers diagnose them. FOLDER keeps the evaluations. One line of JSON a diagnosis in RECORD: its
verdict, probabilities, the runs and time that it announced, and what it took. The mesh is the
case's coarse one, so that CalculiX is 2 % off the tyre that it judges; harmonics up to 2, two
variables, three constants and three effects keep the runs few. With effects named, the first is
planted (it may be "sound"), and they alone are candidates.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
import sys
from dataclasses import replace
from pathlib import Path
from time import monotonic

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.store import Store
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.studies.diagnose.study import study
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.load import load_case

from ..effects.support import exact

ROOT = Path(__file__).parents[2]
RECORD = Path(__file__).parents[1] / "benchmarks" / "diagnose_calculix.jsonl"
PLANTED = {"bead_filler": 2.0, "tread_wear": 0.3, "pressure_offset": -9.0}
PRESSURES_kPa, NOISE = (160.0, 240.0, 320.0), 0.002
HARMONICS = 2
VARIABLES, CONSTANTS = ("A_belt", "C10"), ("rubber_density", "belt_1_angle", "carcass_angle")


def tyre() -> LoadedCase:
    """The paper's tyre on its coarse mesh, with few variables and constants."""
    case = exact(load_case(ROOT / "cases" / "p235_75r17.yaml"))
    c = case.case
    assert c.uncertainties
    changes = {
        "mesh": c.mesh.model_copy(update={"level": "coarse"}),
        "analysis": c.analysis.model_copy(
            update={"highest_harmonic": HARMONICS, "sectors": 30, "static_increments": 4}
        ),
        "variables": {name: c.variables[name] for name in VARIABLES},
        "uncertainties": {name: c.uncertainties[name] for name in CONSTANTS},
    }
    return replace(case, case=c.model_copy(update=changes))


def measured(case: LoadedCase, path: Path, effects: dict[str, float], seed: int) -> Path:
    """A file of frequencies by the bundled solver, with scatter."""
    random = np.random.default_rng(seed)
    lines = ["quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"]
    for p in PRESSURES_kPa:
        values = {**start_values(case), "pressure_kPa": p}
        values |= {f"effects.{id}": e for id, e in effects.items()}
        answer = Evaluator(TyreDesign(case), "bundled").evaluate(Question(values))
        for mode in paired_labels(answer.modes):
            label, f = mode.label, mode.frequency_Hz * (1 + NOISE * random.normal())
            if label.family:
                place = f"{label.c},{label.m},{label.kind or ''}"
                lines.append(f"frequency_Hz,{place},,{p:g},0,{f:.4f},{NOISE * f:.4f}")
    path.write_text("\n".join(lines) + "\n")
    return path


def run(folder: Path, name: str, solver: str, candidates: list[str]) -> dict[str, object]:
    """One diagnosis, for the record."""
    case = tyre()
    planted = {name: PLANTED[name]} if name in PLANTED else {}
    file = measured(case, folder / f"{name}.csv", planted, seed=1 + [*PLANTED, "sound"].index(name))
    evaluator = Evaluator(TyreDesign(case), solver, store=Store(folder / "store"))
    words, began = list[str](), monotonic()
    stages = lambda stage: print(stage, evaluator.counts, round(monotonic() - began), flush=True)
    say = lambda text: words.append(text) or print(text, flush=True)
    result = study(case, evaluator, file, effects=candidates, stage=stages, say=say).diagnosis
    return {
        "planted": name,
        "candidates": candidates,
        "solver": solver,
        "verdict": result.verdict.kind,
        "effect": result.verdict.key,
        "probabilities": {key: round(p, 4) for key, p in result.probabilities.items()},
        "said": words,
        "seconds": round(monotonic() - began),
        "runs": evaluator.counts.runs,
        "recorded": evaluator.counts.recorded,
    }


def known() -> list[dict]:
    """The diagnoses on record."""
    return [json.loads(x) for x in RECORD.read_text().splitlines()] if RECORD.exists() else []


def table() -> None:
    """Print the record in Markdown."""
    print("| planted | solver | verdict | p of the planted | runs | s | said before |")
    print("|---|---|---|---|---|---|---|")
    for e in known():
        p = e["probabilities"].get(e["planted"], e["probabilities"].get("none", 0.0))
        about = "; ".join(e["said"])
        row = [e["planted"], e["solver"], f"{e['verdict']} {e['effect'] or ''}", f"{p:.3f}"]
        print("| " + " | ".join([*row, str(e["runs"]), str(e["seconds"]), about]) + " |")


def main() -> None:
    if sys.argv[1] == "table":
        table()
        return
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    named = sys.argv[2:]
    for name in named[:1] or [*PLANTED, "sound"]:
        for solver in ("bundled", "calculix"):
            candidates = [each for each in named or PLANTED if each in PLANTED]
            done = [(e["planted"], e["candidates"], e["solver"]) for e in known()]
            if (name, candidates, solver) not in done:
                entry = run(folder, name, solver, candidates)
                with RECORD.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(entry) + "\n")
                print(entry, flush=True)


if __name__ == "__main__":
    main()
