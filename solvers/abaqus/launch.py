"""Runs one ABAQUS job to its end, waits where a licence is denied, and judges how it ended.
The runner's options, from the case's ``solver.options``, are kept in the run folder."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..decks import save_texts
from ..errors import Refused, RunFailed
from ..process import last_words, run_command

OPTIONS_FILE = "abaqus.json"


@dataclass(frozen=True)
class Options:
    """Options of the solver, and the units of the decks."""

    licence_wait_s: float = 600.0  # longest time spent waiting for a licence, 0 = none
    licence_first_wait_s: float = 5.0  # the first wait, each later one twice as long
    length_m: float = 1.0  # metres per unit of length of the decks
    mass_kg: float = 1.0  # kilograms per unit of mass of the decks

    def save(self, folder: Path) -> list[Path]:
        """Write them into a run folder."""
        return save_texts({OPTIONS_FILE: json.dumps(asdict(self), indent=1) + "\n"}, folder)


def load(folder: Path) -> Options:
    """Options that were saved in a run folder. Raises OSError."""
    return Options(**json.loads((folder / OPTIONS_FILE).read_text(encoding="utf-8")))


def read_options(given: Mapping[str, Any], **units: float) -> Options:
    """Options of a case; units: ``length_m`` and ``mass_kg`` of a user's deck. Raises Refused."""
    smallest = {"licence_wait_s": 0.0, "licence_first_wait_s": 1e-3}
    unknown = sorted(set(given) - set(smallest))
    if unknown:
        known = ", ".join(smallest)
        raise Refused(f"solver.options: abaqus has no '{unknown[0]}', only {known}")
    for name, least in smallest.items():
        value = given.get(name, least)
        if isinstance(value, bool) or not isinstance(value, int | float) or not value >= least:
            raise Refused(
                f"solver.options.{name} must be a number of at least {least:g}, got {value!r}"
            )
    return Options(**given, **units)


# Only looked for when a job did not complete: a healthy log names the licence manager too
# ("Abaqus License Manager checked out the following licenses: ... from Flexnet server ...").
_LICENCE = r"licen[sc]\w*"
_DENIED = r"(?:denied|unavailable|not available|fail\w*|unable|could not|cannot|can't|exceed\w*)"
PATTERNS = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"{_LICENCE}[^\n]*\b{_DENIED}",  # the manager's own sentence, either way round
        rf"\b{_DENIED}\b[^\n]*{_LICENCE}",
        rf"\bno\b[^\n]*\b{_LICENCE}\b[^\n]*available",
        r"\b(?:cannot|could not|unable to) check\s?out",  # of tokens, "license" unsaid
        r"flex(?:net|lm)\b[^\n]*\berror",  # FLEXnet's error header; "error -5,357" follows
        r"licensed number of users already reached",  # FLEXnet error -4
        r"insufficient tokens",
    )
)

# Printed while ABAQUS itself queues: it only means something as the last that was said.
QUEUEING = re.compile(rf"\b(?:waiting|queue\w*)\b.*{_LICENCE}|{_LICENCE}.*queue", re.IGNORECASE)


def denial(text: str) -> str:
    """The first line of ``text`` that reports a denied licence; empty where there is none."""
    for line in text.splitlines():
        if any(pattern.search(line) for pattern in PATTERNS):
            return line.strip()
    return ""


def is_queueing(last_words: str) -> bool:
    """Whether a job whose last line this is was still waiting for its licence."""
    return bool(QUEUEING.search(last_words) or denial(last_words))


SUCCESS = "THE ANALYSIS HAS COMPLETED SUCCESSFULLY"  # last line of the .sta file
NO_EQUILIBRIUM = (  # of the .sta and .msg files, from memory, not compared with such files
    "TOO MANY ATTEMPTS MADE FOR THIS INCREMENT",
    "TIME INCREMENT REQUIRED IS LESS THAN THE MINIMUM",
    "FIXED TIME INCREMENT IS TOO LARGE",
)
TAIL = 200_000  # bytes of a file that are searched for messages: they stand near its end


def run_job(
    job: str,
    oldjob: str | None,
    program: Sequence[str],
    options: Options,
    folder: Path,
    time_limit_s: float,
) -> float:
    """Run ``job`` (continuing ``oldjob``, if any) by ``program`` in ``folder``; the seconds that
    its last attempt took.

    Output goes to JOB.out. A denied licence is asked for again, after waits that double, until
    ``options.licence_wait_s`` are over; waiting does not count towards ``time_limit_s``.
    Raises RunFailed: ``licence``, ``timed_out``, ``no_equilibrium`` or ``crashed``.
    """
    command = [*program, f"job={job}", *([f"oldjob={oldjob}"] if oldjob else [])]
    waited, wait = 0.0, options.licence_first_wait_s
    while True:
        _clear(job, folder)
        start = time.monotonic()
        failure = _attempt([*command, "interactive"], job, folder, time_limit_s)
        if failure is None:
            return time.monotonic() - start
        refusal = denial(_said(job, folder))
        if not refusal:
            raise failure
        wait = min(wait, options.licence_wait_s - waited)
        if wait <= 0:
            raise RunFailed(
                "licence", f"no licence for job {job} after {waited:g} s of waiting", refusal
            )
        time.sleep(wait)
        waited, wait = waited + wait, 2 * wait


def _clear(job: str, folder: Path) -> None:
    """Remove all that an earlier attempt left: no stale result, no question before overwriting."""
    for path in folder.glob(f"{job}.*"):
        if path.suffix != ".inp":
            path.unlink()


def _attempt(command: list[str], job: str, folder: Path, time_limit_s: float) -> RunFailed | None:
    """How the job ended badly, or None. Raises RunFailed where asking again is no use."""
    try:
        code = run_command(command, folder, time_limit_s, f"{job}.out")
    except RunFailed:
        last_line = last_words(folder / f"{job}.out", 1)
        if is_queueing(last_line):
            raise RunFailed("licence", f"job {job} never got its licence", last_line) from None
        raise
    status = _tail(folder / f"{job}.sta")
    if code == 0 and SUCCESS in status:
        return None
    ended = f"exit code {code}" if code else "exit code 0, but without completing"
    lost = any(words in status + _said(job, folder) for words in NO_EQUILIBRIUM)
    cause = "no_equilibrium" if lost else "crashed"
    return RunFailed(cause, f"abaqus ended job {job} with {ended}", words(job, folder))


def words(job: str, folder: Path) -> str:
    """The solver's own last words: the errors of .dat and .msg, or else the end of its output."""
    errors = []
    for name in (f"{job}.dat", f"{job}.msg"):
        lines = [line.strip() for line in _tail(folder / name).splitlines()]
        errors += [line for line in lines if line.startswith("***ERROR")]
    return " | ".join(errors[:3]) or last_words(folder / f"{job}.out")


def _said(job: str, folder: Path) -> str:
    return "\n".join(_tail(folder / f"{job}.{end}") for end in ("out", "log", "dat", "msg"))


def _tail(path: Path) -> str:
    if not path.exists():
        return ""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - TAIL))
        return file.read().decode(errors="replace")
