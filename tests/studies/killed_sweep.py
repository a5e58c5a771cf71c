"""A sweep that is killed several times at random moments; then the same command once more.

    python -m tests.studies.killed_sweep [points] [kills] [seed] [jobs]

Each sweep is killed outright (SIGKILL), all of its processes at a time. In the end
the result files must be byte for byte those of an undisturbed sweep. No point that had finished
may run again: its file in the evaluation store is never written anew, and the last run evaluates
exactly those that are not there. Exit code 1 where one is not so.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
COMMAND = [sys.executable, "-m", "tyrecal", "sweep", str(CASE), "--mesh", "coarse"]
RESULTS = ("sweep.json", "sweep.csv", "sweep_modes.csv")


def sweep(out: Path, points: int, jobs: int) -> subprocess.Popen[bytes]:
    """A sweep of a grid of ``points``, an even number, that writes to ``out``."""
    ranges = [f"C10=8e5:1.2e6:{points // 2}", "pressure_kPa=200:280:2"]
    options = ["--no-pictures", "--quiet", "--jobs", f"{jobs}", "--output", str(out)]
    return subprocess.Popen([*COMMAND, *ranges, *options], start_new_session=True)


def stored(out: Path) -> dict[Path, int]:
    """Files of the evaluation store with their inodes: a file that is written anew has another."""
    return {path: path.stat().st_ino for path in out.glob("record/*/*.record")}


def main(points: int = 200, kills: int = 5, seed: int = 0, jobs: int = 2) -> int:
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        plain, out = Path(place) / "plain", Path(place) / "killed"
        start = time.monotonic()
        sweep(plain, points, jobs).wait()
        seconds = time.monotonic() - start
        total = json.loads((plain / "run.json").read_text())["sweep"]["solver_runs"]
        print(f"undisturbed: {seconds:.1f} s, {total} runs of the solver", flush=True)
        known: dict[Path, int] = {}
        again = 0
        for _ in range(kills):
            process = sweep(out, points, jobs)
            wanted = len(known) + chance.randint(1, max(1, (total - len(known)) // 2))
            while len(now := stored(out)) < wanted and process.poll() is None:
                time.sleep(0.002)
            alive = process.poll() is None
            if alive:
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            now = stored(out)
            again += sum(now.get(path) != inode for path, inode in known.items())
            print(f"killed with {len(now)} points stored" if alive else "ended", flush=True)
            known = now
        sweep(out, points, jobs).wait()
        facts = json.loads((out / "run.json").read_text())["sweep"]
        again += sum(stored(out)[path] != inode for path, inode in known.items())
        again += abs(facts["solver_runs"] - (total - len(known)))
        same = all((out / name).read_bytes() == (plain / name).read_bytes() for name in RESULTS)
        print(
            f"last: {facts['solver_runs']} runs, {facts['answered_from_record']} from the store;"
            f" {'same' if same else 'OTHER'} bytes, {again} points run twice"
        )
    return int(not same or again > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
