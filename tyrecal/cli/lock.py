"""A results folder belongs to one process at a time."""

from __future__ import annotations

import fcntl
import json
import os
import platform
from pathlib import Path
from typing import IO

FILE = ".lock"


class Locked(ValueError):
    """Another process works in the folder."""


def lock(folder: Path, command: str, started: str) -> IO[str] | None:
    """Lock ``folder`` until the file returned is closed or the process ends, however it ends.

    None where the file system has no locks. Raises Locked, naming the other process; OSError.
    """
    file = (folder / FILE).open("a+", encoding="utf-8")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.seek(0)
        owner = _owner(file.read())
        file.close()
        raise Locked(
            f"folder '{folder}' is in use by {owner}: wait for it, or give another folder with"
            " --output"
        ) from None
    except OSError:
        file.close()
        return None
    facts = {"pid": os.getpid(), "host": platform.node(), "command": command, "started": started}
    file.truncate(0)
    file.write(json.dumps(facts) + "\n")
    file.flush()
    return file


def _owner(text: str) -> str:
    try:
        return "'tyrecal {command}', process {pid} on {host} since {started}".format(
            **json.loads(text)
        )
    except (ValueError, KeyError):  # it has the lock and is about to write who it is
        return "another process"
