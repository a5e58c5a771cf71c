"""Runs what is quick and marked ``numbers`` under every BLAS kernel that this processor can run.

    python -m tests.kernels [--every] [pytest's arguments]

Each kernel once but this processor's own, which `pytest` itself has, with one thread and with two
in turn; ``--every``: all kernels with one and with two. One run more at a time than there are
cores. A kernel that the processor cannot run, or for which the libraries have another's,
is said.
Exits with 1 where a run failed.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

KERNELS = ("Prescott", "Haswell", "Zen", "SkylakeX")
THREADS = (1, 2)
ASK = """
import numpy, scipy.linalg, threadpoolctl
a = numpy.random.default_rng(0).normal(size=(200, 200))
for linalg in (numpy.linalg, scipy.linalg):  # each has its own library
    linalg.eigh(a @ a.T), linalg.svd(a), linalg.solve(a, a)
print(*sorted({x["architecture"] for x in threadpoolctl.threadpool_info()}))
"""


def run(words: list[str], kernel: str, threads: int = 1) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, "OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": str(threads)}
    root = Path(__file__).parents[1]
    return subprocess.run(
        [sys.executable, *words], env=env, cwd=root, capture_output=True, text=True
    )


def kernels(usual: str) -> dict[str, str]:
    """Kernels to run under, with the libraries' names for them; prints which are not run, and
    why."""
    taken: dict[str, str] = {}
    for name in KERNELS:
        probe = run(["-c", ASK], name)
        core = probe.stdout.strip()
        if probe.returncode:
            print(f"{name}: not run, this processor cannot: {probe.stderr.strip()[-200:]}")
        elif core in taken.values():
            print(f"{name}: not run again, the libraries take {core} for it")
        else:
            taken[name] = core
    if usual not in taken.values():
        print(f"what this processor takes by itself, {usual}, is none of them: run too")
        taken[""] = usual
    return taken


def tested(kernel: str, core: str, threads: int, more: list[str]) -> bool:
    start = time.monotonic()
    marked = [
        path
        for path in Path(__file__).parent.rglob("test_*.py")
        if "mark.numbers" in path.read_text()
    ]  # the others take long to be collected
    chosen = ["-m", "numbers and quick", "-p", "no:cacheprovider", *map(str, marked)]
    words = ["-m", "pytest", *chosen, *more]
    done = run(words, kernel, threads)
    last = (done.stdout.strip().splitlines() or [""])[-1]
    name = f"{kernel or 'by itself'} ({core})"
    print(f"{name}, {threads} thread(s): {last} [{time.monotonic() - start:.0f} s]", flush=True)
    if done.returncode:
        print(done.stdout, done.stderr, flush=True)
    return done.returncode == 0


def main(more: list[str]) -> int:
    own = run(["-c", ASK], "").stdout.strip()
    every, more = "--every" in more, [each for each in more if each != "--every"]
    chosen = [(name, core) for name, core in kernels(own).items() if every or core != own]
    turns = {core: THREADS[(len(chosen) - i) % 2] for i, (_, core) in enumerate(chosen)}
    jobs = [
        (name, core, n, more) for name, core in chosen for n in THREADS if every or n == turns[core]
    ]
    with ThreadPoolExecutor((os.cpu_count() or 1) + 1) as pool:  # no core idles
        return not all([*pool.map(lambda job: tested(*job), jobs)])  # a failure stops no other


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
