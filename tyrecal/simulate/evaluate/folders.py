"""Run folders: a fresh one for each run, dropped when it went well, kept when it did not."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from pathlib import Path

from ...files import private_dir, refuse_link
from ...interrupt import defer_interrupts

OUTCOME = "outcome.txt"  # in every kept folder; one without it was cut off in the middle


def fresh(parent: Path | None) -> Path:
    """An empty folder under ``parent``, or among the system's temporary ones. Raises OSError."""
    if parent is None:
        return Path(tempfile.mkdtemp(prefix="tyrecal-"))
    return Path(tempfile.mkdtemp(prefix="run-", dir=private_dir(parent)))


def keep(folder: Path, outcome: str) -> Path:
    """Leave the folder, and write in it how the run ended: a failure's words, or
    ``finished``."""
    with contextlib.suppress(OSError):
        (folder / OUTCOME).write_text(outcome + "\n", encoding="utf-8")
    return folder


def drop(folder: Path) -> None:
    """Remove the folder."""
    with defer_interrupts():  # one inside rmtree ends as the error of a file closed twice
        shutil.rmtree(folder, ignore_errors=True)


def drop_unfinished(parent: Path) -> None:
    """Remove folders of processes that were killed; call it where none can be at work.

    Raises NotAFile where ``parent`` is a link.
    """
    refuse_link(parent)
    for folder in parent.glob("run-*"):
        if not (folder / OUTCOME).exists():
            drop(folder)
