"""Fits of two checkouts, one after the other in turn: processor time, pair by pair.

    python tests/benchmarks/paired.py PYTHON [rounds]

PYTHON: that of the other checkout's environment. A fit of the main case in a process that has
imported all is nine evaluations with three slopes, on any commit whose `tyrecal.api` has
`fit_case`. What else runs on the machine slows both of a pair alike.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
from pathlib import Path

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
CHILD = """
import sys, time
from tyrecal.api import fit_case, load_case
case = load_case(sys.argv[1])
for line in sys.stdin:
    start = time.process_time()
    fit_case(case)
    print(time.process_time() - start, flush=True)
"""


def main(other: str, rounds: int) -> None:
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    children = [
        subprocess.Popen(
            [python, "-c", CHILD, str(CASE)],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for python in (other, sys.executable)
    ]
    pairs = []
    for _ in range(rounds + 1):
        pair = []
        for child in children:
            assert child.stdin and child.stdout
            child.stdin.write("\n")
            child.stdin.flush()
            pair.append(float(child.stdout.readline()))
        pairs.append(pair)
    for child in children:
        child.communicate()
    there, here = zip(*pairs[1:], strict=True)  # the first finds nothing in memory
    ratios = [b / a for a, b in zip(there, here, strict=True)]
    median = statistics.median
    print(f"a fit: there {median(there):.3f} s, here {median(here):.3f} s of processor time")
    print(f"ratio, median of {rounds} pairs: {median(ratios):.3f}")
    print(f"from {min(ratios):.3f} to {max(ratios):.3f}")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 7)
