"""Deck, files and record around one evaluation with gradients, against the solver's work in it.

    python tests/benchmarks/overhead.py [rounds]

The work: the same analysis on decks already in memory, nothing read or written. The whole: from a
design to its modes through the evaluator, with a record that does not know it yet. Sides alternate.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import statistics
import sys
import tempfile
import time
from pathlib import Path

from threadpoolctl import threadpool_limits
from tyrecal_solvers.bundled.adapter import JOB, OLDJOB
from tyrecal_solvers.bundled.deck.request import read_request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.store import Store
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"


def main(rounds: int) -> None:
    case = load_case(CASE)
    values = start_values(case)
    names = tuple(values)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        record = folder / "record"
        evaluator = Evaluator(TyreDesign(case), folder=folder / "runs", keep=True)
        evaluator.evaluate(Question(values, names))
        (run,) = (folder / "runs").iterdir()
        texts = {name: (run / f"{name}.inp").read_text() for name in (JOB, OLDJOB)}
        request = read_request(run / f"{JOB}.request.json")
        work, whole, again = [], [], []
        for number in range(rounds):
            with threadpool_limits(1, "blas"):
                start = time.perf_counter()
                Job(Deck(texts, JOB, OLDJOB), request).run()
                work.append(time.perf_counter() - start)
            question = Question({**values, "C10": values["C10"] * (1 + 1e-6 * (number + 1))}, names)
            for seconds in (whole, again):
                evaluator = Evaluator(TyreDesign(case), folder=folder / "runs", store=Store(record))
                start = time.perf_counter()
                evaluator.evaluate(question)
                seconds.append(time.perf_counter() - start)
        size = sum(p.stat().st_size for p in record.rglob("*.record")) / rounds
    ratios = [w / s for w, s in zip(whole, work, strict=True)]
    median = statistics.median
    print(
        f"solver's work {1e3 * median(work):.1f} ms, whole evaluation {1e3 * median(whole):.1f} ms:"
        f" overhead {100 * (median(ratios) - 1):.0f} %"
    )
    print(f"answered from the record {1e3 * median(again):.1f} ms; a record {size / 1e3:.0f} kB")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 25)
