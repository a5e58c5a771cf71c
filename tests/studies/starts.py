"""Ends and numbers of designs of both methods of the fit, from drawn starts.

    python -m tests.studies.starts [--count 50] [--seed 0] [--record DIR]

For each shipped case and each drawn start: the final objective of `slsqp` and of `gauss-newton`, in
Hz, and their design points. Prints every start where one method ends more than 0.01 Hz above the
other.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies.fit.calibrate import METHODS, TOLERANCE
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.search import minimise
from tyrecal.tyre.load import load_case

CASES = Path(__file__).parents[2] / "cases"
NAMES = ("p235_75r17", "p235_75r17_narrow_rim", "205_60r15")
APART_HZ = 0.01


def compare(name: str, count: int, seed: int, record: Path | None) -> None:
    """Print a line for each start of a case where the methods part, and a summary."""
    case = load_case(CASES / f"{name}.yaml")
    evaluator = Evaluator(TyreDesign(case), store=Store(record) if record else None)
    random = np.random.default_rng(seed)
    points: dict[str, list[int]] = {method: [] for method in METHODS}
    apart = failed = 0
    while len(points["slsqp"]) < count:
        box = Problem(case, evaluator)
        start = random.uniform(box.lower, box.upper)
        try:
            box.evaluate(start)
        except EvaluationFailed:  # no tyre stands at this start
            failed += 1
            continue
        ends = {}
        for method, descend in METHODS.items():
            problem = Problem(case, evaluator)
            ends[method] = minimise(problem, start, TOLERANCE, descend)
            points[method].append(len(problem.points))
        hertz = [end.point.objective for end in ends.values()]
        if max(hertz) - min(hertz) > APART_HZ:
            apart += 1
            words = [f"{m} {end.point.objective:.3f} Hz, {end.message}" for m, end in ends.items()]
            values = {k: float(f"{v:.4g}") for k, v in box.values(start).items()}
            print(f"{name} from {values}: {'; '.join(words)}", flush=True)
    medians = ", ".join(
        f"{m} {np.median(n):g} designs (at most {max(n)})" for m, n in points.items()
    )
    print(f"{name}: {apart} of {count} starts apart, {failed} replaced; {medians}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--record", type=Path, help="folder of an evaluation store")
    options = parser.parse_args()
    for each in NAMES:
        compare(each, options.count, options.seed, options.record)
