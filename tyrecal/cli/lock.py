"""A results folder belongs to one process at a time."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import platform
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..files import open_file, read_json, write_text

if TYPE_CHECKING:
    from filelock import BaseFileLock

LOCK_FILE, OWNER = (
    ".lock",
    ".lock.json",
)  # what is locked; who holds it, which Windows reads meanwhile
log = logging.getLogger("tyrecal")


class Lock:
    """A folder that this process holds."""

    def __init__(self, held: BaseFileLock, owner: Path):
        self._held, self._owner = held, owner

    def close(self) -> None:
        """Give the folder back; the end of the process does so too, however it ends."""
        self._owner.unlink(missing_ok=True)
        self._held.release()


def lock(folder: Path, command: str, started: str) -> Lock | None:
    """Lock ``folder``; None, with a warning, where the file system has no locks.

    Raises InputError, naming the other process; NotAFile for what is no lock; OSError.
    """
    from filelock import FileLock, SoftFileLock, Timeout

    for name in (LOCK_FILE, OWNER):
        with contextlib.suppress(FileNotFoundError):
            open_file(folder / name, follow=False).close()
    held = FileLock(folder / LOCK_FILE, fallback_to_soft=False)
    try:
        if isinstance(held, SoftFileLock):  # a mere file, which a killed process leaves behind
            raise NotImplementedError("this Python has none")
        held.acquire(timeout=0)
    except Timeout:
        raise InputError(
            f"folder '{folder}' is in use by {_owner(folder / OWNER)}: wait for it, or give"
            " another folder with --output"
        ) from None
    except (OSError, NotImplementedError) as error:
        if isinstance(error, PermissionError):
            raise
        log.warning(
            "folder '%s' cannot be locked (%s): give no second command there meanwhile",
            folder,
            getattr(error, "strerror", None) or error,
        )
        return None
    facts = {"pid": os.getpid(), "host": platform.node(), "command": command, "started": started}
    write_text(folder / OWNER, json.dumps(facts) + "\n")
    return Lock(held, folder / OWNER)


def _owner(path: Path) -> str:
    try:
        return "'tyrecal {command}', process {pid} on {host} since {started}".format(
            **read_json(path, follow=False)
        )
    except (OSError, ValueError, KeyError, TypeError):  # it is about to write who it is
        return "another process"
