"""Many cases on some cores against one after the other; one of them cannot stand.

    python tests/benchmarks/batch.py [--cases 50] [--jobs 2] [--default-mesh]

Fits variations of the shipped case (other pressures), on a coarse mesh unless told. Prints times,
ratio, exit codes, and whether both wrote the same batch.json.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.batch.support import poison, vary


def main(count: int, jobs: int, coarse: bool) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        cases = vary(folder / "cases", count, coarse)
        poison(cases[count // 2])
        command = [sys.executable, "-m", "tyrecal", "batch", *map(str, cases), "--quiet"]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        seconds = {}
        for n in (1, jobs):
            clock = time.perf_counter()
            out = ["--output", str(folder / str(n)), "--jobs", str(n)]
            code = subprocess.run([*command, *out], env=environment).returncode
            seconds[n] = time.perf_counter() - clock
            counts = json.loads((folder / str(n) / "batch.json").read_text())["counts"]
            facts = json.loads((folder / str(n) / "run.json").read_text())["cases"].values()
            cpu = sum(each["cpu_seconds"] for each in facts)
            print(f"{count} cases, {n} at a time: {seconds[n]:.1f} s, {cpu:.1f} s of a core in"
                  f" the cases, exit code {code}, {counts}", flush=True)  # fmt: skip
        texts = [(folder / str(n) / "batch.json").read_bytes() for n in seconds]
        print(f"{seconds[1] / seconds[jobs]:.2f} times as fast; same bytes: {texts[0] == texts[1]}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--default-mesh", action="store_true")
    options = parser.parse_args()
    main(options.cases, options.jobs, not options.default_mesh)
