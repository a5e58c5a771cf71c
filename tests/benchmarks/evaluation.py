"""One evaluation with gradients against the bare LAPACK work inside it, in one run.

    python tests/benchmarks/evaluation.py [rounds]

The floor: the banded factorisations and back-substitutions that the evaluation made, replayed on
copies of the same matrices and right-hand sides with nothing around them. Prints the ratio of the
medians of processor time, where the rest goes, and the same for the solver alone without deck and
files.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import statistics
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from tyrecal_solvers.bundled import adapter, frequency_step
from tyrecal_solvers.bundled.modes import lanczos
from tyrecal_solvers.bundled.section import band, inflation, kept_fields, mechanics

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

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


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 15)
