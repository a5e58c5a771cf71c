"""Many cases on some cores against one after the other; one of them cannot stand.

    python tests/benchmarks/batch.py [--cases 50] [--jobs 2] [--default-mesh]

Fits variations of the shipped case (other pressures), on a coarse mesh unless told. Prints times,
ratio, exit codes, and whether both wrote the same batch.json. On Linux also the times without what
the processes waited for a core that somebody else had (/proc/PID/schedstat): those of quiet cores,
but for caches that are shared.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.batch.support import poison, vary


def main(count: int, jobs: int, coarse: bool) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        cases = vary(folder / "cases", count, coarse)
        poison(cases[count // 2])
        command = [sys.executable, "-m", "tyrecal", "batch", *map(str, cases), "--quiet"]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        seconds, quiet = {}, {}
        for n in (1, jobs):
            out = ["--output", str(folder / str(n)), "--jobs", str(n)]
            code, seconds[n], waited = run([*command, *out], environment)
            quiet[n] = seconds[n] - waited
            counts = json.loads((folder / str(n) / "batch.json").read_text())["counts"]
            facts = json.loads((folder / str(n) / "run.json").read_text())["batch"]
            facts = facts["cases"].values()
            cpu = sum(each["cpu_seconds"] for each in facts)
            print(
                f"{count} cases, {n} at a time: {seconds[n]:.1f} s, without waiting for a core"
                f" {quiet[n]:.1f} s; {cpu:.1f} s of a core in the cases, exit code {code},"
                f" {counts}",
                flush=True,
            )
        texts = [(folder / str(n) / "batch.json").read_bytes() for n in seconds]
        print(
            f"{seconds[1] / seconds[jobs]:.2f} times as fast, without waiting"
            f" {quiet[1] / quiet[jobs]:.2f}; same bytes: {texts[0] == texts[1]}"
        )


def run(command: Sequence[str], environment: Mapping[str, str]) -> tuple[int, float, float]:
    """Exit code, seconds, and the seconds of them in which it waited for a core: its first process
    or the one that workers are forked from, whichever did longer, and a worker on average."""
    clock = time.perf_counter()
    process = subprocess.Popen(command, env=environment, process_group=0)
    first: dict[int, float] = {process.pid: 0.0}
    workers: dict[int, float] = {}
    while process.poll() is None:
        for place in Path("/proc").glob("[0-9]*"):
            with suppress(OSError, IndexError):  # it ended meanwhile
                parent, group = (place / "stat").read_text().rpartition(")")[2].split()[1:3]
                if int(group) == process.pid:
                    own = int(place.name) == process.pid or int(parent) == process.pid
                    threads = (place / "task").glob("*/schedstat")
                    waited = sum(int(each.read_text().split()[1]) for each in threads) / 1e9
                    (first if own else workers)[int(place.name)] = waited
        time.sleep(0.1)
    seconds = time.perf_counter() - clock
    average = sum(workers.values()) / max(len(workers), 1)
    return process.returncode, seconds, max(first.values()) + average


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--default-mesh", action="store_true")
    options = parser.parse_args()
    main(options.cases, options.jobs, not options.default_mesh)
