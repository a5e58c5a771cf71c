"""A fit that is killed, or hears Ctrl-C, at random moments; then the same command again.

    python tests/studies/kill.py [rounds] [seed] [KILL|INT]

Every round is a fit from nothing in a folder of its own, signalled once at a moment drawn over the
whole run (drawn again where the fit had ended by then), and run again. Checked: result files byte
for byte those of an undisturbed run, and every evaluation that had finished is answered from the
record. With INT, to all processes as a terminal sends it, the fit searches from three starts, in
two processes every other round; checked too: exit code 130 and one sentence, how to go on, alone.
Exit code 1 where one is not.
"""

from __future__ import annotations

import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CASE = Path(__file__).parents[2] / "cases" / "p235_75r17.yaml"
COMMAND = [sys.executable, "-m", "tyrecal", "fit", str(CASE), "--no-pictures", "--quiet"]
STARTS = ["--mesh", "coarse", "--starts", "3", "--seed", "1"]
RESULTS = ("fit.json", "fit.csv", "fit_history.csv")
STARTED_S = 0.5  # Python itself answers Ctrl-C before it has imported us
SAID = re.compile(r"\ninterrupted: (nothing was changed|.*same command goes on.*)\n")
INTERRUPTED = (130, -signal.SIGINT)  # alike to a shell; Python's own imports make one of the other


def fit(out: Path, arguments: list[str]) -> subprocess.Popen[str]:
    """A fit that writes to ``out``."""
    command = [*COMMAND, *arguments, "--output", str(out)]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)


def finished(out: Path) -> int:
    """Evaluations on record."""
    return len(list(out.glob("record/*/*.record")))


def stopped(
    out: Path, arguments: list[str], how: int, chance: random.Random, seconds: float
) -> tuple[float, str]:
    """Start a fit and signal it within ``seconds``; the moment, and what it did wrong."""
    while True:
        shutil.rmtree(out, ignore_errors=True)
        process = fit(out, arguments)
        moment = chance.uniform(STARTED_S if how == signal.SIGINT else 0, seconds)
        time.sleep(moment)
        alive = process.poll() is None
        if alive:
            os.killpg(process.pid, how)
        words = process.communicate()[1]
        if not alive or (out / "fit.json").exists():
            continue
        right = process.returncode in INTERRUPTED and SAID.fullmatch(words)
        return moment, "" if how == signal.SIGKILL or right else f"{process.returncode}: {words}"


def main(rounds: int, seed: int, how: int) -> int:
    chance, bad = random.Random(seed), 0
    searching = STARTS if how == signal.SIGINT else []
    with tempfile.TemporaryDirectory() as place:
        plain = Path(place) / "plain"
        start = time.monotonic()
        fit(plain, searching).communicate()
        seconds = time.monotonic() - start
        total = json.loads((plain / "run.json").read_text())["solver_runs"]
        print(f"undisturbed: {seconds:.1f} s, {total} evaluations", flush=True)
        for number in range(1, rounds + 1):
            out = Path(place) / f"{number}"
            arguments = [*searching, *(["--jobs", "2"] if searching and number % 2 else [])]
            moment, wrong = stopped(out, arguments, how, chance, seconds)
            before = finished(out)
            fit(out, arguments).communicate()
            facts = json.loads((out / "run.json").read_text())
            same = all((out / n).read_bytes() == (plain / n).read_bytes() for n in RESULTS)
            once = facts["solver_runs"] == total - before == total - facts["answered_from_record"]
            rubbish = (out / "runs").exists() or any(out.rglob("*.partial"))
            bad += not (same and once) or rubbish or bool(wrong)
            print(
                f"{number:3d}: stopped at {moment:.2f} s with {before}"
                f" finished; then {facts['solver_runs']} runs, {facts['answered_from_record']} from"
                f" the record; {'same bytes' if same else 'OTHER BYTES'}"
                f"{'' if once else ', RUN TWICE'}{', LEFTOVERS' if rubbish else ''}"
                f"{f', {wrong}' if wrong else ''}",
                flush=True,
            )
            shutil.rmtree(out)
    print(f"{rounds} rounds, {bad} bad")
    return int(bad > 0)


if __name__ == "__main__":
    given = sys.argv[1:]
    rounds, seed, how = given + ["20", "0", "KILL"][len(given) :]
    sys.exit(main(int(rounds), int(seed), signal.Signals[f"SIG{how}"]))
