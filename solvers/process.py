"""Running an external solver: own process group, time limit, output to files, typed failures."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path


class RunFailed(RuntimeError):
    """An external solver did not deliver.

    cause: ``crashed``, ``timed_out``, ``no_results``, ``licence``, ``unstable`` or
    ``no_equilibrium``; the message ends with the solver's own last words.
    """

    def __init__(self, cause: str, message: str, words: str = ""):
        super().__init__(f"{message}: {words}" if words else message)
        self.cause = cause


def run_command(
    command: Sequence[str],
    folder: Path,
    time_limit_s: float,
    log: str,
    environment: Mapping[str, str] | None = None,
) -> int:
    """Run ``command`` (an argument list, no shell) in ``folder``; its exit code.

    All output goes to the file ``log`` there. The command gets a process group of its own, which
    is ended as a whole when the time is over or this process is interrupted. Where this process
    is killed outright, Linux ends the command, but not what the command has started.
    Raises RunFailed (``timed_out``, or ``crashed`` where the command cannot be started).
    """
    with (folder / log).open("wb") as output:
        try:
            process = subprocess.Popen(
                [*_leash(command[0]), *command],
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, **(environment or {})},
                start_new_session=True,
            )
        except OSError as error:
            raise RunFailed("crashed", f"cannot start '{command[0]}'", str(error)) from None
        try:
            return process.wait(time_limit_s)
        except subprocess.TimeoutExpired:
            raise RunFailed(
                "timed_out",
                f"'{Path(command[0]).name}' was ended after its time limit of {time_limit_s:g} s",
                last_words(folder / log),
            ) from None
        finally:
            if process.poll() is None:
                _end(process)


def _leash(program: str) -> list[str]:
    """What a command starts with so that the kernel ends it with the thread that started it.

    `run_command` waits in that thread. (util-linux; Python's preexec_fn is not safe in threads.)
    Nothing where it is not installed, or where ``program`` is not: Popen then says so.
    """
    setpriv = shutil.which("setpriv") if shutil.which(program) else None
    return [setpriv, "--pdeathsig", "KILL", "--"] if setpriv else []


def _end(process: subprocess.Popen[bytes]) -> None:
    """End the whole group: children that the command started too."""
    for sign, patience in ((signal.SIGTERM, 2.0), (signal.SIGKILL, 10.0)):
        try:
            os.killpg(process.pid, sign)
            process.wait(patience)
            return
        except ProcessLookupError:
            return
        except subprocess.TimeoutExpired:
            continue


def last_words(log: Path, lines: int = 3) -> str:
    """The last lines of a log that say something, joined; empty where there are none."""
    if not log.exists():
        return ""
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - 4000))
        text = file.read().decode(errors="replace")
    said = [line.strip() for line in text.splitlines() if line.strip()]
    return " | ".join(said[-lines:])
