"""One evaluation with gradients, in one run: against the bare LAPACK work inside it, what is around
the solver, and the cost over the size of the section.

    python tests/benchmarks/evaluation.py floor|overhead|scaling [rounds]

The floor: the banded factorisations and back-substitutions that the evaluation made, replayed on
copies of the same matrices and right-hand sides with nothing around them. Prints the ratio of the
medians of processor time, where the rest goes, and the same for the solver alone without deck and
files.

The overhead is that of deck, files and record against the solver's work. The work: the same
analysis on decks already in memory, nothing read or written. The whole: from a design to its modes
through the evaluator, with a record that does not know it yet. Sides alternate.

Scaling is the cost against the section's unknowns, 600 to 10,000. Elements along the section and
rows through it grow together; prints the growth exponent, the slope of log(time) over
log(unknowns), between neighbours and over all.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import math
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits
from tyrecal_solvers.bundled import adapter, frequency_step
from tyrecal_solvers.bundled.adapter import JOB, OLDJOB
from tyrecal_solvers.bundled.deck.request import read_request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.job import Job
from tyrecal_solvers.bundled.modes import lanczos
from tyrecal_solvers.bundled.section import band, inflation, kept_fields, mechanics

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.store import Store
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"


FACTORS = (band.Cholesky, kept_fields.KeptCholesky)
Factored = tuple[type, list[np.ndarray], list[np.ndarray]]  # class, matrices, right-hand sides


def record(evaluator: Evaluator, question: Question) -> list[Factored]:
    """Factorisations of one evaluation, each with its right-hand sides."""
    log: list[Factored] = []
    plain = [(kind, kind.__init__, kind.solve) for kind in FACTORS]
    for kind, init, solve in plain:

        def noted(self, *matrices, kind=kind, init=init):
            self.rights = []
            log.append((kind, [each.copy(order="F") for each in matrices], self.rights))
            init(self, *matrices)

        def solved(self, right, solve=solve):
            self.rights.append(right.copy(order="F"))
            return solve(self, right)

        kind.__init__, kind.solve = noted, solved
    try:
        evaluator.evaluate(question)
    finally:
        for kind, init, solve in plain:
            kind.__init__, kind.solve = init, solve
    return log


def replay(log: list[Factored]) -> float:
    """Seconds for the recorded factorisations and back-substitutions alone."""
    copies = [[each.copy(order="F") for each in matrices] for _, matrices, _ in log]
    start = time.process_time()
    for (kind, _, rights), matrices in zip(log, copies, strict=True):
        factor = kind(*matrices)
        for right in rights:
            factor.solve(right)
    return time.process_time() - start


def timed_parts(evaluator: Evaluator, question: Question) -> dict[str, float]:
    """Seconds by part of one evaluation, from wrapped functions (outermost only)."""
    spent: dict[str, float] = defaultdict(float)
    places = [
        (inflation, "_newton", "inflation"),
        (mechanics, "mass", "mass"),
        (lanczos, "lowest", "eigenproblems"),
        (frequency_step, "state_rate", "slopes"),
        (frequency_step, "eigenvalue_rates", "slopes"),
        (adapter.Bundled, "write", "writing decks"),
        (adapter.Bundled, "run", "solver, all"),
        (adapter.Bundled, "read", "reading results"),
    ]
    kept = []
    for owner, name, label in places:
        original = getattr(owner, name)
        kept.append((owner, name, original))

        def wrapped(*args, original=original, label=label, **kwargs):
            start = time.process_time()
            try:
                return original(*args, **kwargs)
            finally:
                spent[label] += time.process_time() - start

        setattr(owner, name, wrapped)
    start = time.process_time()
    evaluator.evaluate(question)
    spent["everything"] = time.process_time() - start
    for owner, name, original in kept:
        setattr(owner, name, original)
    return spent


def main(rounds: int) -> None:
    case = load_case(CASE)
    values = start_values(case)
    evaluator = Evaluator(TyreDesign(case))
    question = Question(values, tuple(values))
    log = record(evaluator, question)
    whole, floor, solver = [], [], []
    parts: dict[str, list[float]] = defaultdict(list)
    for _ in range(rounds):  # interleaved, so that a slow spell of the machine hits both
        start = time.process_time()
        evaluator.evaluate(question)
        whole.append(time.process_time() - start)
        floor.append(replay(log))
        for label, seconds in timed_parts(evaluator, question).items():
            parts[label].append(seconds)
        solver.append(parts["solver, all"][-1])
    factorisations = len(log)
    columns = sum(1 if r.ndim == 1 else r.shape[1] for _, _, rights in log for r in rights)
    first = log[0][1][0]
    size, width = first.shape[1], first.shape[0] - 1
    median = statistics.median
    print(
        f"{size} equations, {width} sub-diagonals: {factorisations} factorisations,"
        f" {columns} back-substitutions"
    )
    ratios = [w / f for w, f in zip(whole, floor, strict=True)]
    print(
        f"evaluation with gradients {1e3 * median(whole):.1f} ms, floor"
        f" {1e3 * median(floor):.1f} ms, ratio {median(ratios):.2f}"
        f" (solver alone {median(s / f for s, f in zip(solver, floor, strict=True)):.2f})"
    )
    for label, seconds in sorted(parts.items(), key=lambda item: -median(item[1])):
        print(f"  {label:18s} {1e3 * median(seconds):7.1f} ms")


def overhead(rounds: int) -> None:
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
        request = read_request(run / f"{JOB}.request.json", list(texts))
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


MESHES = [  # elements per region of the half section, rows outside the belts
    ((2, 2, 2, 1), 1),
    ((4, 3, 3, 1), 1),
    ((6, 6, 6, 1), 2),
    ((8, 8, 8, 2), 3),
    ((12, 12, 12, 3), 3),
    ((16, 16, 16, 4), 4),
    ((24, 24, 24, 4), 4),
]


def scaling(rounds: int) -> None:
    case = load_case(CASE)
    values = start_values(case)
    sizes, seconds = [], []
    for elements, rows in MESHES:
        level = "mesh.levels.default"
        numbers = {
            f"{level}.elements.{name}": n
            for (name, _), n in zip(case.section.regions, elements, strict=True)
        }
        evaluator = Evaluator(TyreDesign(with_values(case, {**numbers, f"{level}.rows.3": rows})))
        question = Question(values, tuple(values))
        evaluation = evaluator.evaluate(question)
        moving = (abs(evaluation.displacement) > 0).any(1).sum()
        times = []
        for _ in range(rounds):
            start = time.perf_counter()
            evaluator.evaluate(question)
            times.append(time.perf_counter() - start)
        sizes.append(3 * int(moving))
        seconds.append(statistics.median(times))
        growth = ""
        if len(sizes) > 1:
            slope = math.log(seconds[-1] / seconds[-2]) / math.log(sizes[-1] / sizes[-2])
            growth = f"   exponent {slope:.2f}"
        print(
            f"{sizes[-1]:6d} unknowns {1e3 * seconds[-1]:8.1f} ms{growth}   {elements} x"
            f" (1, 1, 1, {rows})"
        )
    logs = [(math.log(n), math.log(t)) for n, t in zip(sizes, seconds, strict=True)]
    mean_x = statistics.mean(x for x, _ in logs)
    mean_y = statistics.mean(y for _, y in logs)
    slope = sum((x - mean_x) * (y - mean_y) for x, y in logs) / sum(
        (x - mean_x) ** 2 for x, _ in logs
    )
    print(f"growth exponent over all: {slope:.2f}")


PARTS = {"floor": (main, 15), "overhead": (overhead, 25), "scaling": (scaling, 5)}  # and rounds

if __name__ == "__main__":
    part, rounds = PARTS[sys.argv[1] if sys.argv[1:] else "floor"]
    part(int(sys.argv[2]) if sys.argv[2:] else rounds)
