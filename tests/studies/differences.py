"""Blind trials diagnosed with exact sensitivities and with those by differences, trial by trial.

    python -m tests.studies.differences FOLDER 40                # goes on where it stopped
    python -m tests.studies.differences FOLDER 40 bead_filler    # with these effects alone
    python -m tests.studies.differences table

The recorded trials of a study, evenly chosen, answered by the bundled solver on the coarse mesh:
once as it is, once with its sensitivities switched off. FOLDER keeps trials and evaluations. One
line of JSON a trial in RECORD: both verdicts, and the largest difference of a probability.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies.blind.answer import case_of, one_answer, rows_of, tyre_model
from tyrecal.studies.blind.protocol import read_protocol
from tyrecal.studies.inference.expansion import expand
from tyrecal.tyre.case import LoadedCase

from ..blind.archive import unpack
from .answered_again import weighed

STUDY = "blind_study_2"
RECORD = Path(__file__).parents[1] / "benchmarks" / "differences.jsonl"


@contextmanager
def without_gradients() -> Iterator[None]:
    """The bundled solver gives no sensitivities."""
    capabilities = Bundled.capabilities
    Bundled.capabilities = capabilities - {"gradients"}
    try:
        yield
    finally:
        Bundled.capabilities = capabilities


def on_coarse_mesh(case: LoadedCase) -> LoadedCase:
    """The case of the trials, its section exact as theirs is."""
    section = case.case.section.model_copy(update={"known_from": "exact"})
    mesh = case.case.mesh.model_copy(update={"level": "coarse"})
    return replace(case, case=case.case.model_copy(update={"section": section, "mesh": mesh}))


class Answers:
    """Diagnoses of trials by one model, which is expanded once."""

    def __init__(self, folder: Path, effects: list[str]):
        case, self.protocol = on_coarse_mesh(case_of(folder)), read_protocol(folder)
        evaluator = Evaluator(TyreDesign(case), "bundled", store=Store(folder / "store"))
        self.model = tyre_model(case, evaluator, self.protocol, 1, effects)
        self.rows = rows_of(case, self.protocol)
        self.known = expand(self.model, self.model.start)
        print(evaluator.counts, flush=True)

    def of(self, trial: Path) -> dict[str, Any]:
        """The content of the diagnosis."""
        answer = one_answer(self.model, self.rows, self.protocol, self.known, trial)
        content: dict[str, Any] = answer["diagnosis"]
        return content


def known() -> dict[str, dict[str, Any]]:
    """Lines of the record by trial."""
    lines = RECORD.read_text().splitlines() if RECORD.exists() else []
    return {each["trial"]: each for each in map(json.loads, lines)}


def run(folder: Path, count: int, only: list[str]) -> None:
    """Answer the trials that are not on record."""
    marked = folder / "weighed.json"
    if not marked.exists():
        unpack(STUDY, folder)
        marked.write_text(json.dumps(weighed(folder / "answers")))
    effects = only or json.loads(marked.read_text())
    every = sorted((folder / "trials").glob("*.csv"))
    chosen = every[:: len(every) // count][:count]
    waiting = [trial for trial in chosen if trial.stem not in known()]
    exact = Answers(folder, effects)
    with without_gradients():
        differing = Answers(folder, effects)
    for trial in waiting:
        own = exact.of(trial)
        with without_gradients():
            other = differing.of(trial)
        p, its = own["probabilities"], other["probabilities"]
        off = {key: abs(p.get(key, 0.0) - its.get(key, 0.0)) for key in {*p, *its}}
        worst = max(off, key=lambda key: off[key])
        entry = {
            "trial": trial.stem,
            "effects": len(effects),
            "exact": [own["verdict"], own["effect"]],
            "differences": [other["verdict"], other["effect"]],
            "off": round(off[worst], 5),
            "of": worst,
        }
        with RECORD.open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry) + "\n")
        print(entry, flush=True)


def table() -> None:
    """Print what the record says in one line."""
    lines = list(known().values())
    same = sum(each["exact"] == each["differences"] for each in lines)
    largest = max(each["off"] for each in lines)
    print(f"{len(lines)} trials: the same verdict in {same}, probabilities within {largest:.4f}")


def main() -> None:
    if sys.argv[1] == "table":
        table()
    else:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        run(folder, int(sys.argv[2]), sys.argv[3:])


if __name__ == "__main__":
    main()
