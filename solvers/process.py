"""Running an external solver: own process group, time limit, output to files, typed failures."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from .errors import RunFailed

GRACE_S = 2.0  # for a group that was asked to end
OWN_GROUP: dict[str, Any] = {"start_new_session": True}
if sys.platform == "win32":
    OWN_GROUP = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}

_running: list[subprocess.Popen[bytes]] = []


def run_command(
    command: Sequence[str],
    folder: Path,
    time_limit_s: float,
    log: str,
    environment: Mapping[str, str] | None = None,
) -> int:
    """Run ``command`` (an argument list, no shell) in ``folder``; its exit code.

    All output goes to the file ``log`` there. The command gets a process group of its own, which
    is ended as a whole when the time is over or this process is interrupted: asked first, and
    killed if it has not ended after `GRACE_S`. Where this process is killed outright, Linux ends
    the command, but not what the command has started.
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
                **OWN_GROUP,
            )
        except OSError as error:
            raise RunFailed(
                "crashed", f"cannot start '{command[0]}'", error.strerror or ""
            ) from None
        _running.append(process)
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
            _running.remove(process)


def end_commands() -> None:
    """End all commands that `run_command` runs in other threads, which hear of no interruption."""
    for process in list(_running):
        _end(process)


def _leash(program: str) -> list[str]:
    """Words that start a command so that the kernel ends it with the thread that started it.

    `run_command` waits in that thread. (util-linux; Python's preexec_fn is not safe in threads.)
    Nothing where it is not installed, or where ``program`` is not: Popen then says so.
    """
    setpriv = shutil.which("setpriv") if shutil.which(program) else None
    return [setpriv, "--pdeathsig", "KILL", "--"] if setpriv else []


def _end(process: subprocess.Popen[bytes]) -> None:
    """End the whole group: children that the command started too, whatever they ignore."""
    if not hasattr(os, "killpg"):
        _end_tree(process)
        return
    try:
        os.killpg(process.pid, signal.SIGTERM)
        end = time.monotonic() + GRACE_S
        while _is_alive(process) and time.monotonic() < end:
            time.sleep(0.02)
    except OSError:  # there is none any more
        pass
    finally:  # at once, where patience is interrupted
        with suppress(OSError):
            os.killpg(process.pid, signal.SIGKILL)
        with suppress(subprocess.TimeoutExpired):  # one that the kernel does not let go
            process.wait(10.0)


def _is_alive(process: subprocess.Popen[bytes]) -> bool:
    """Whether any of the group is; its number is not given away as long as one is."""
    process.poll()
    try:
        os.killpg(process.pid, 0)
    except OSError:
        return False
    return True


def _end_tree(process: subprocess.Popen[bytes]) -> None:
    """End a process tree on Windows, which knows what started what as long as it lives."""
    taskkill = shutil.which("taskkill")
    if taskkill:
        command = [taskkill, "/T", "/F", "/PID", str(process.pid)]
        subprocess.run(command, capture_output=True, check=False)
    process.kill()
    process.wait()


def program_version(command: Sequence[str], pattern: str, time_limit_s: float) -> str:
    """The version that a program prints, by a pattern; "unknown" where there is none."""
    try:
        given = subprocess.run(
            command, capture_output=True, text=True, timeout=time_limit_s, stdin=subprocess.DEVNULL
        )
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    match = re.search(pattern, given.stdout, re.IGNORECASE)
    return match[1] if match else "unknown"


def last_words(log: Path, lines: int = 3) -> str:
    """The last lines of a log that are not blank, joined; empty where there are none."""
    if not log.exists():
        return ""
    with log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - 4000))
        text = file.read().decode(errors="replace")
    nonblank = [line.strip() for line in text.splitlines() if line.strip()]
    return " | ".join(nonblank[-lines:])
