"""Cost of an evaluation with gradients against the section's unknowns, 600 to 10,000.

    python tests/benchmarks/scaling.py [rounds]

Elements along the section and rows through it grow together; prints the growth exponent, the
slope of log(time) over log(unknowns), between neighbours and over all.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import math
import statistics
import sys
import time
from pathlib import Path

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
MESHES = [  # elements per region of the half section, rows outside the belts
    ((2, 2, 2, 1), 1),
    ((4, 3, 3, 1), 1),
    ((6, 6, 6, 1), 2),
    ((8, 8, 8, 2), 3),
    ((12, 12, 12, 3), 3),
    ((16, 16, 16, 4), 4),
    ((24, 24, 24, 4), 4),
]


def main(rounds: int) -> None:
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


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
