"""One evaluation with gradients against the bare LAPACK work inside it, in one run.

    python tests/benchmarks/evaluation.py [rounds]

The floor: the banded factorisations and back-substitutions that the evaluation made, replayed on
copies of the same matrices and right-hand sides with nothing around them. Prints the ratio of the
medians, where the rest of the time goes, and the same for the solver alone without deck and files.
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
from tyrecal_solvers.bundled import adapter
from tyrecal_solvers.bundled.modes import lanczos, sensitivity
from tyrecal_solvers.bundled.section import band, inflation, mechanics

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"


def record(evaluator: Evaluator, question: Question) -> list[tuple[np.ndarray, list[np.ndarray]]]:
    """Matrices factorised in one evaluation, each with its right-hand sides."""
    log: list[tuple[np.ndarray, list[np.ndarray]]] = []
    plain = band.Cholesky

    class Recorder(plain):  # type: ignore[valid-type,misc]
        def __init__(self, matrix: np.ndarray):
            self.log: list[np.ndarray] = []
            log.append((matrix.copy(order="F"), self.log))
            super().__init__(matrix)

        def solve(self, right: np.ndarray) -> np.ndarray:
            self.log.append(right.copy(order="F"))
            return super().solve(right)

    from tyrecal_solvers.bundled.modes import harmonics

    users = (band, inflation, harmonics)
    for module in users:
        module.Cholesky = Recorder
    try:
        evaluator.evaluate(question)
    finally:
        for module in users:
            module.Cholesky = plain
    return log


def replay(log: list[tuple[np.ndarray, list[np.ndarray]]]) -> float:
    """Seconds for the recorded factorisations and back-substitutions alone."""
    copies = [matrix.copy(order="F") for matrix, _ in log]
    start = time.perf_counter()
    for matrix, (_, rights) in zip(copies, log, strict=True):
        factor = band.Cholesky(matrix)
        for right in rights:
            factor.solve(right)
    return time.perf_counter() - start


def timed_parts(evaluator: Evaluator, question: Question) -> dict[str, float]:
    """Seconds by part of one evaluation, from wrapped functions (outermost only)."""
    spent: dict[str, float] = defaultdict(float)
    places = [
        (inflation, "_newton", "inflation"),
        (mechanics, "mass", "mass"),
        (lanczos, "lowest", "eigenproblems"),
        (sensitivity, "state_rate", "sensitivities"),
        (sensitivity, "eigenvalue_rates", "sensitivities"),
        (adapter.Bundled, "write", "writing decks"),
        (adapter.Bundled, "run", "solver, all"),
        (adapter.Bundled, "read", "reading results"),
    ]
    kept = []
    for owner, name, label in places:
        original = getattr(owner, name)
        kept.append((owner, name, original))

        def wrapped(*args, original=original, label=label, **kwargs):
            start = time.perf_counter()
            try:
                return original(*args, **kwargs)
            finally:
                spent[label] += time.perf_counter() - start

        setattr(owner, name, wrapped)
    start = time.perf_counter()
    evaluator.evaluate(question)
    spent["everything"] = time.perf_counter() - start
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
        start = time.perf_counter()
        evaluator.evaluate(question)
        whole.append(time.perf_counter() - start)
        floor.append(replay(log))
        for label, seconds in timed_parts(evaluator, question).items():
            parts[label].append(seconds)
        solver.append(parts["solver, all"][-1])
    factorisations = len(log)
    columns = sum(1 if r.ndim == 1 else r.shape[1] for _, rights in log for r in rights)
    size, width = log[0][0].shape[1], log[0][0].shape[0] - 1
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
