"""Work of two checkouts, in turn: processor time, pair by pair.

    python -m tests.benchmarks.paired PYTHON fit|near|path|refined [rounds]
    python -m tests.benchmarks.paired PYTHON command ROUNDS fit cases/p235_75r17.yaml --no-pictures

PYTHON: that of the other checkout's environment, on any commit whose `tyrecal.api` has `fit_case`.
In processes that have imported all: ``fit`` of the main case; an evaluation with three slopes,
``near``: of designs within 12 % of the start, ``path``: on the way from there to the optimum,
``refined``: as near, on the refined mesh. ``command``: a whole `tyrecal` command, its imports and
all its processes counted, with nothing on record. Each side reads the case of its own checkout, as
keys come and go. What else runs on the machine slows both of a
pair alike.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
ENVIRONMENT.pop("PYTHONDONTWRITEBYTECODE", None)  # byte code is compiled once
CHILD = """
import math, pathlib, random, sys, time
from tyrecal import api
work = sys.argv[1]
path = pathlib.Path(api.__file__).resolve().parents[1] / "cases" / "p235_75r17.yaml"
case = api.load_case(path, "refined") if work == "refined" else api.load_case(path)
start, ask = api.start_values(case), getattr(api, "_evaluator", None) or api._door
optimum = {"A_belt": 2.595e-7, "A_carcass": 6.872e-8, "C10": 5.5087e5}
drawn = random.Random(1)
near = lambda v: v * math.exp(drawn.uniform(-0.12, 0.12))
designs = [{n: near(v) for n, v in start.items()} for _ in range(9)]
if work == "path":
    designs = [
        {n: v * (optimum[n] / v) ** (k / 8) for n, v in start.items()} for k in range(9)
    ]
evaluator = ask(case, "", None)
for line in sys.stdin:
    began = time.process_time()
    if work == "fit":
        api.fit_case(case)
    else:
        for design in designs:
            evaluator.evaluate(api.Question(design, tuple(design)))
    print((time.process_time() - began) / (1 if work == "fit" else len(designs)), flush=True)
"""


def within(python: str, work: str, stack: ExitStack) -> Callable[[], float]:
    """Seconds of one more round of the work in a process of its own."""
    child = stack.enter_context(
        subprocess.Popen(
            [python, "-c", CHILD, work],
            env=ENVIRONMENT,
            cwd=stack.enter_context(tempfile.TemporaryDirectory()),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
    )

    def once() -> float:
        assert child.stdin and child.stdout
        child.stdin.write("\n")
        child.stdin.flush()
        return float(child.stdout.readline())

    return once


def command(python: str, words: list[str], stack: ExitStack) -> Callable[[], float]:
    """Seconds of a whole command, its processes and their children."""
    folder = stack.enter_context(tempfile.TemporaryDirectory())
    where = [python, "-c", "import tyrecal; print(tyrecal.__file__)"]
    root = Path(subprocess.check_output(where, cwd=folder, text=True).strip()).parents[1]
    words = [str(root / word) if (root / word).is_file() else word for word in words]

    def once() -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        more = ["--no-store", "--quiet", "--output", folder]
        command = [python, "-m", "tyrecal", *words, *more]
        subprocess.run(command, env=ENVIRONMENT, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return once


def main(other: str, work: str, *more: str) -> None:
    rounds = int(more[0]) if more else 7
    with ExitStack() as stack:
        sides = [
            command(python, list(more[1:]), stack)
            if work == "command"
            else within(python, work, stack)
            for python in (other, sys.executable)
        ]
        pairs = [[side() for side in sides] for _ in range(rounds + 1)]
    there, here = zip(*pairs[1:], strict=True)  # the first finds nothing in memory
    ratios = [b / a for a, b in zip(there, here, strict=True)]
    median = statistics.median
    print(f"{work}: there {median(there):.4f} s, here {median(here):.4f} s of processor time")
    print(f"ratio, median of {rounds} pairs: {median(ratios):.3f}")
    print(f"from {min(ratios):.3f} to {max(ratios):.3f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
