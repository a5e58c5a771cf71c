"""Running ccx on one deck. It lies about failure: an exit code of 0 proves nothing."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from ..errors import RunFailed
from ..process import last_words, run_command

RESULT_SUFFIXES = ("dat", "frd", "sta", "cvg", "12d", "rout")
MAX_LINE_LENGTH = 10_000  # characters of a log
MAX_PATH_LENGTH = 100  # ccx keeps 132 characters of a file's path, the file's name included
# of the log of ccx 2.20
NO_EQUILIBRIUM = re.compile(r"increment size smaller|too many cutbacks|max\. # of increments", re.I)


def run_job(
    folder: Path, job: str, inputs: Sequence[str], command: Sequence[str], time_limit_s: float
) -> None:
    """Run ``job``.inp of ``folder`` to its end; the results and ``job``.log are next to it.

    ``inputs``: other files that it reads. One thread: two are slower, and results of one are the
    same to the last bit. Where ccx could not cope with the folder's path it runs elsewhere. Raises
    RunFailed: ``timed_out``, ``no_equilibrium``, ``crashed``."""
    clear(folder, job)
    if _is_safe(folder):
        _run(folder, job, command, time_limit_s)
        return
    with tempfile.TemporaryDirectory(prefix="ccx-") as short:
        for name in (f"{job}.inp", *inputs):
            shutil.copy(folder / name, short)
        try:
            _run(Path(short), job, command, time_limit_s)
        finally:
            for suffix in (*RESULT_SUFFIXES, "log"):
                if (Path(short) / f"{job}.{suffix}").exists():
                    shutil.copy(Path(short) / f"{job}.{suffix}", folder)


def clear(folder: Path, job: str) -> None:
    """Remove results of another run, which must not pass for this one's."""
    for suffix in (*RESULT_SUFFIXES, "log"):
        (folder / f"{job}.{suffix}").unlink(missing_ok=True)


def _is_safe(folder: Path) -> bool:
    """ccx writes astray where a path holds a blank, and ends where it is too long."""
    path = str(folder.resolve())
    return len(path) <= MAX_PATH_LENGTH and path.isascii() and " " not in path


def _run(folder: Path, job: str, command: Sequence[str], time_limit_s: float) -> None:
    log = folder / f"{job}.log"
    threads = {"OMP_NUM_THREADS": "1", "CCX_NPROC_STIFFNESS": "1", "CCX_NPROC_RESULTS": "1"}
    code = run_command([*command, job], folder, time_limit_s, log.name, threads)
    error, lost, finished = _said(log)
    words = error or last_words(log)
    if lost:
        raise RunFailed("no_equilibrium", f"CalculiX found no inflated state ({job})", words)
    if code != 0:
        raise RunFailed("crashed", f"CalculiX ended with code {code} ({job})", words)
    if error:
        raise RunFailed("crashed", f"CalculiX reported an error ({job})", words)
    if not finished:
        raise RunFailed("crashed", f"CalculiX stopped before its end ({job})", words)


def _said(log: Path) -> tuple[str, bool, bool]:
    """First error, lost equilibrium and end of a log of any length: the first ``*ERROR`` with the
    two lines that follow it, or ""; whether there was no equilibrium; whether the job finished.

    A card that ccx skips, or of which it skips a parameter, is an error too: it only warns.
    """
    error: list[str] = []
    lost = finished = False
    with log.open(encoding="utf-8", errors="replace") as file:
        for line in iter(lambda: file.readline(MAX_LINE_LENGTH), ""):
            lost = lost or bool(NO_EQUILIBRIUM.search(line))
            finished = finished or "Job finished" in line
            line = line.strip()
            skipped = line.startswith("*WARNING reading") and line.endswith("Card image:")
            begins = skipped or line.upper().startswith("*ERROR")
            if line and len(error) < 3 and (error or begins):
                error.append(line)
    return " ".join(error), lost, finished
