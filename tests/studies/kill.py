"""`kill -9` of a fit at random moments, then the same command again, until it ends by itself.

    python tests/studies/kill.py [kills] [seed]

Every round is a fit from nothing in a folder of its own, killed once at a moment drawn over the
whole run (drawn again where the fit had ended by then), and run again. Checked: result files byte
for byte those of an undisturbed run, and every evaluation that had finished is answered from the
record. Exit code 1 where one is not.
"""

from __future__ import annotations

import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
COMMAND = [sys.executable, "-m", "tyrecal", "fit", str(CASE), "--no-pictures", "--quiet"]
RESULTS = ("fit.json", "fit.csv", "fit_history.csv")


def fit(out: Path) -> subprocess.Popen[bytes]:
    """A fit that writes to ``out``."""
    return subprocess.Popen([*COMMAND, "--output", str(out)])


def finished(out: Path) -> int:
    """Evaluations on record."""
    return len(list(out.glob("record/*/*.record")))


def killed(out: Path, chance: random.Random, seconds: float) -> float:
    """Start a fit and kill it within ``seconds``; the moment."""
    while True:
        shutil.rmtree(out, ignore_errors=True)
        process, moment = fit(out), chance.uniform(0, seconds)
        time.sleep(moment)
        alive = process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
        if alive:
            return moment


def main(kills: int, seed: int) -> int:
    chance, bad = random.Random(seed), 0
    with tempfile.TemporaryDirectory() as place:
        plain = Path(place) / "plain"
        start = time.monotonic()
        fit(plain).wait()
        seconds = time.monotonic() - start
        total = json.loads((plain / "run.json").read_text())["solver_runs"]
        print(f"undisturbed: {seconds:.1f} s, {total} evaluations")
        for number in range(1, kills + 1):
            out = Path(place) / f"{number}"
            moment = killed(out, chance, seconds)
            before = finished(out)
            fit(out).wait()
            facts = json.loads((out / "run.json").read_text())
            same = all((out / n).read_bytes() == (plain / n).read_bytes() for n in RESULTS)
            once = facts["solver_runs"] == total - before == total - facts["answered_from_record"]
            rubbish = (out / "runs").exists() or any(out.rglob("*.partial"))
            bad += not (same and once) or rubbish
            print(
                f"{number:3d}: killed at {moment:.2f} s with {before}"
                f" finished; then {facts['solver_runs']} runs, {facts['answered_from_record']} from"
                f" the record; {'same bytes' if same else 'OTHER BYTES'}"
                f"{'' if once else ', RUN TWICE'}{', LEFTOVERS' if rubbish else ''}"
            )
    print(f"{kills} kills, {bad} bad")
    return int(bad > 0)


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:]]
    sys.exit(main(*(numbers + [20, 0][len(numbers) :])))
