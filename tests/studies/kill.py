"""A fit that a signal meets at random moments; then the same command again.

    python tests/studies/kill.py [rounds] [seed] [KILL|INT|TERM|HUP] [-- CASE OPTION ...]

CASE OPTION ...: arguments of the fit, default cases/p235_75r17.yaml. Where they are given, every
other round has two processes, and every other pair of rounds two threads of the BLAS.

Every round is a fit from nothing in a folder of its own, signalled once at a moment drawn over the
whole run (drawn again where the fit had ended by then), and run again. Checked: result files byte
for byte those of an undisturbed run, every evaluation that had finished is answered from the
record, and no process of the first fit is left. With other signals than KILL the fit searches from
three starts, in two processes every other round; checked too: the exit code, one sentence, how to
go on, alone, and neither run folders nor half-written files by then. INT goes to all processes, as
a terminal sends it; TERM and HUP in every other pair of rounds, else to the command alone. A signal
that comes before the tool's first own line is Python's, or the system's: nothing was changed.
Exit code 1 where one is not.

And a sweep that is killed several times at random moments; then the same command once more:

    python -m tests.studies.kill sweep [points] [kills] [seed] [jobs]

Each sweep is killed outright (SIGKILL), all of its processes at a time. In the end
the result files must be byte for byte those of an undisturbed sweep. No point that had finished
may run again: its file in the evaluation store is never written anew, and the last run evaluates
exactly those that are not there. Exit code 1 where one is not so.
"""

from __future__ import annotations

import contextlib
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
STARTS = ["--mesh", "coarse", "--starts", "3", "--seed", "1"]
RESULTS = ("fit.json", "fit.csv", "fit_history.csv")
WORDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated", signal.SIGHUP: "hung up"}
SAID = r"\n{}: (nothing was c.*|nothing was computed.*|.*same command again to resume.*)\n"
GONE_S = 5.0  # within which the processes of one that was killed outright have ended


def fit(out: Path, arguments: list[str], threads: int = 1) -> subprocess.Popen[str]:
    """A fit that writes to ``out``, with so many ``threads`` of the BLAS."""
    command = [sys.executable, "-m", "tyrecal", "fit", *arguments, "--output", str(out)]
    return subprocess.Popen(
        [*command, "--no-pictures", "--quiet"],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": f"{threads}"},
    )


def finished(out: Path) -> int:
    """Evaluations on record."""
    return len(list(out.glob("record/*/*.record")))


def left(session: int) -> list[str]:
    """Processes of a session that are still there."""
    commands = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended
            state, _, _, own = path.read_text().rpartition(")")[2].split()[:4]
            if int(own) == session and state != "Z":
                commands.append(path.with_name("cmdline").read_text().replace("\0", " "))
    return commands


def rubbish(out: Path) -> bool:
    """Return whether run folders or half-written files are there."""
    left = (".new-*", "runs", "*.partial")
    return any(path for each in left for path in out.rglob(each))


def stopped(
    out: Path,
    arguments: list[str],
    how: int,
    all_of_them: bool,
    chance: random.Random,
    seconds: float,
) -> tuple[float, str]:
    """Start a fit and signal it within ``seconds``; the moment, and what it did wrong."""
    while True:
        shutil.rmtree(out, ignore_errors=True)
        process = fit(out, arguments)
        moment = chance.uniform(0, seconds)
        time.sleep(moment)
        alive = process.poll() is None
        if alive:
            (os.killpg if all_of_them else os.kill)(process.pid, how)
        words = process.communicate()[1]
        if not alive or (out / "fit.json").exists():
            continue
        end = time.monotonic() + GONE_S
        while left(process.pid) and time.monotonic() < end:
            time.sleep(0.05)
        wrong = [f"LEFT {each}" for each in left(process.pid)]
        code = process.returncode
        early = code == -how and not out.exists() and "tyrecal" not in words
        if how in WORDS and not early:
            if code != 128 + how or not re.fullmatch(SAID.format(WORDS[how]), words):
                wrong.append(f"{code}: {words}")
            wrong += ["LEFTOVERS"] if rubbish(out) else []
        return moment, ", ".join(wrong)


def main(rounds: int, seed: int, how: int, own: list[str]) -> int:
    """Return 1 if a round went wrong; own: arguments of the fit."""
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
    chance, bad = random.Random(seed), 0
    searching = [*(own or [str(CASE)]), *(STARTS if how in WORDS else [])]
    at_once = bool(own) or how in WORDS
    with tempfile.TemporaryDirectory() as place:
        plain = Path(place) / "plain"
        start = time.monotonic()
        words = fit(plain, searching).communicate()[1]
        if not (plain / "fit.json").exists():
            sys.exit(words)
        seconds = time.monotonic() - start
        total = json.loads((plain / "run.json").read_text())["fit"]["solver_runs"]
        print(f"undisturbed: {seconds:.1f} s, {total} evaluations", flush=True)
        for number in range(1, rounds + 1):
            out = Path(place) / f"{number}"
            arguments = [*searching, *(["--jobs", "2"] if at_once and number % 2 else [])]
            to_all = how == signal.SIGINT or number // 2 % 2 == 0
            moment, wrong = stopped(out, arguments, how, to_all, chance, seconds)
            before = finished(out)
            fit(out, arguments, 1 + (bool(own) and number // 2 % 2)).communicate()
            facts = json.loads((out / "run.json").read_text())["fit"]
            same = all((out / n).read_bytes() == (plain / n).read_bytes() for n in RESULTS)
            once = facts["solver_runs"] == total - before == total - facts["answered_from_record"]
            bad += not (same and once) or rubbish(out) or bool(wrong)
            print(
                f"{number:3d}: stopped at {moment:.2f} s with {before}"
                f" finished; then {facts['solver_runs']} runs, {facts['answered_from_record']} from"
                f" the record; {'same bytes' if same else 'OTHER BYTES'}"
                f"{'' if once else ', RUN TWICE'}{', LEFTOVERS' if rubbish(out) else ''}"
                f"{f', {wrong}' if wrong else ''}",
                flush=True,
            )
            shutil.rmtree(out)
    print(f"{rounds} rounds, {bad} bad")
    return int(bad > 0)


SWEEP = [sys.executable, "-m", "tyrecal", "sweep", str(CASE), "--mesh", "coarse"]
SWEEP_RESULTS = ("sweep.json", "sweep.csv", "sweep_modes.csv")


def sweep(out: Path, points: int, jobs: int) -> subprocess.Popen[bytes]:
    """A sweep of a grid of ``points``, an even number, that writes to ``out``."""
    ranges = [f"C10=8e5:1.2e6:{points // 2}", "pressure_kPa=200:280:2"]
    options = ["--no-pictures", "--quiet", "--jobs", f"{jobs}", "--output", str(out)]
    return subprocess.Popen([*SWEEP, *ranges, *options], start_new_session=True)


def stored(out: Path) -> dict[Path, int]:
    """Files of the evaluation store with their inodes: a file that is written anew has another."""
    return {path: path.stat().st_ino for path in out.glob("record/*/*.record")}


def killed_sweep(points: int = 200, kills: int = 5, seed: int = 0, jobs: int = 2) -> int:
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
        same = all(
            (out / name).read_bytes() == (plain / name).read_bytes() for name in SWEEP_RESULTS
        )
        print(
            f"last: {facts['solver_runs']} runs, {facts['answered_from_record']} from the store;"
            f" {'same' if same else 'OTHER'} bytes, {again} points run twice"
        )
    return int(not same or again > 0)


if __name__ == "__main__":
    if sys.argv[1:2] == ["sweep"]:
        sys.exit(killed_sweep(*map(int, sys.argv[2:])))
    at = sys.argv.index("--") if "--" in sys.argv else len(sys.argv)
    given, own = sys.argv[1:at], sys.argv[at + 1 :]
    rounds, seed, how = given + ["20", "0", "KILL"][len(given) :]
    sys.exit(main(int(rounds), int(seed), signal.Signals[f"SIG{how}"], own))
