"""The results folder, and the volatile facts of a run."""

from __future__ import annotations

import contextlib
import json
import platform
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..files import forget_previous, json_text, set_aside, write_text
from . import lock
from .talk import resume

if TYPE_CHECKING:
    from ..evaluate.door import Counts
    from ..evaluate.store import Store


class OutputRefused(ValueError):
    """The results folder belongs to another case."""


class Run:
    """One command's run: its folder, locked until the command ends, and run.json, which holds
    all that differs between runs.

    Raises OutputRefused where the folder holds another case's results; Locked; OSError.
    """

    def __init__(self, case: Path, output: Path | None, command: str, solver: Any = None):
        self.case, self.command, self.solver = case.resolve(), command, solver
        self.folder = output or Path(case.stem)
        self.started = datetime.now(UTC).isoformat(timespec="seconds")
        self._clock, self._finished, self._renewed = time.monotonic(), False, ""
        self.store: Store | None = None
        self.counts: Counts | None = None
        if self.folder.exists() and not self.folder.is_dir():
            raise OutputRefused(f"'{self.folder}' is a file; give a folder with --output")
        self.folder.mkdir(parents=True, exist_ok=True)
        self._lock = lock.lock(self.folder, command, self.started)
        click.get_current_context().call_on_close(self._close)
        refuse_other(self.folder, self.case)
        if self._lock and solver:
            from ..evaluate.folders import drop_unfinished

            drop_unfinished(self.runs)
        self._write_facts()
        click.get_current_context().call_on_close(self._say_unfinished)

    def open_store(self, folder: Path | None, none: bool) -> Store | None:
        """The record of evaluations: in ``folder``, or beside the results, or ``none``."""
        words = "with --no-store nothing is on record; the same command starts from the beginning"
        if not none:
            from ..evaluate.store import Store

            self.store = Store((folder or self.folder / "record").resolve())
            words = (
                f"evaluations that had finished are on record in '{self.store.folder}'; the same"
                " command goes on from there"
            )
        resume(words)
        return self.store

    def write_json(self, name: str, content: Any) -> Path:
        """Write a result file whole or not at all."""
        return self.write_text(name, json_text(content))

    def write_text(self, name: str, text: str) -> Path:
        """Write a result file whole or not at all."""
        write_text(self.folder / name, text)
        return self.folder / name

    @property
    def runs(self) -> Path:
        """Where the solver's run folders go."""
        return self.folder / "runs"

    def renew(self, study: str) -> None:
        """Set aside an earlier run's results of ``study`` until this is done. Raises OSError."""
        set_aside(self.folder, study)
        self._renewed = study

    def finish(self, **facts: Any) -> None:
        """Write run.json: command, times, host, versions, and what else is volatile."""
        self._finished = True
        self._write_facts(**facts)
        if self._renewed:
            forget_previous(self.folder, self._renewed)

    def _write_facts(self, **facts: Any) -> None:
        import tyrecal

        counts = self.counts and {
            "solver_runs": self.counts.runs,
            "answered_from_record": self.counts.recorded,
        }
        self.write_json(
            "run.json",
            {
                "case": str(self.case),
                "command": self.command,
                "arguments": sys.argv[1:],
                "started": self.started,
                "finished": self._finished,
                "seconds": round(time.monotonic() - self._clock, 3),
                "host": platform.node(),
                "python": platform.python_version(),
                "tyrecal": tyrecal.__version__,
                "solver": f"{self.solver.name} {self.solver.version}" if self.solver else None,
                "record": str(self.store.folder) if self.store else None,
                **(counts or {}),
                **facts,
            },
        )

    def _say_unfinished(self) -> None:
        if not self._finished:
            with contextlib.suppress(OSError):  # what went wrong before is what is told
                self._write_facts()

    def _close(self) -> None:
        with contextlib.suppress(OSError):  # it holds failures, or was never made
            self.runs.rmdir()
        if self.store:
            self.store.prune()
        if self._lock:
            self._lock.close()


def refuse_other(folder: Path, case: Path) -> None:
    """Raises OutputRefused where ``folder`` holds results of another case than ``case``."""
    record = folder / "run.json"
    if not record.exists():
        return
    try:
        facts = json.loads(record.read_text(encoding="utf-8"))
    except ValueError:
        facts = None
    facts = facts if isinstance(facts, dict) else {}
    owner = facts.get("case")
    if owner != str(case) and not _moved(facts, case):
        raise OutputRefused(
            f"folder '{folder}' holds results of {owner or 'something else'};"
            " give another one with --output"
        )


def _moved(facts: dict[str, Any], case: Path) -> bool:
    """Whether ``case`` is what ``facts`` are of: nothing is at the old place any more, and it has
    the same name, as after a project's folder was renamed, or is a batch's folder itself."""
    owner = facts.get("case")
    if not isinstance(owner, str) or Path(owner).exists():
        return False
    return Path(owner).name == case.name or ("cases" in facts and case.is_dir())
