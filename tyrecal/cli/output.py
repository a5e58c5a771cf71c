"""The results folder, which belongs to one process at a time, and the volatile facts of a run."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import platform
import shutil
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from pydantic import BaseModel

from ..errors import InputError
from ..files import (
    PREVIOUS,
    RUN,
    NotWritten,
    json_text,
    make_folder,
    open_file,
    private_dir,
    read_json,
    read_runs,
    refuse_link,
    results,
    take_place,
    write_runs,
    write_text,
    writing,
)
from ..interrupt import defer_interrupts
from ..simulate.case_folder import belongs_to, named_case, owner
from ..simulate.evaluate.solver import solver_facts
from ..simulate.provenance import stamped
from ..simulate.settings import root
from ..studies.result import Result
from .terminal import resume

if TYPE_CHECKING:
    from filelock import BaseFileLock
    from matplotlib.figure import Figure

    from ..simulate.evaluate.evaluator import Counts
    from ..simulate.evaluate.store import Store
    from ..tyre.case import LoadedCase

# the locked file; facts on the process that holds it, apart because Windows reads no locked file
LOCK_FILE, OWNER = ".lock", ".lock.json"
log = logging.getLogger("tyrecal")
AnyResult = TypeVar("AnyResult", bound=Result)
NEW = ".new-"  # start of the name of a run's folder of results until all are written


class Lock:
    """The lock of a folder by this process."""

    def __init__(self, held: BaseFileLock, owner: Path):
        self._held, self._owner = held, owner

    def close(self) -> None:
        """Release the folder; the end of the process releases it too."""
        self._owner.unlink(missing_ok=True)
        self._held.release()


def lock(folder: Path, command: str, started: str) -> Lock | None:
    """Lock ``folder``; None, with a warning, where the file system has no locks.

    Raises InputError, with the process that holds it; NotAFile if the lock is no file; OSError.
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
            raise NotWritten(error.errno, error.strerror, str(folder)) from None
        log.warning(
            "folder '%s' cannot be locked (%s): start no second command there until this one ends",
            folder,
            getattr(error, "strerror", None) or error,
        )
        return None
    facts = {"pid": os.getpid(), "host": platform.node(), "command": command, "started": started}
    write_text(folder / OWNER, json.dumps(facts) + "\n")
    return Lock(held, folder / OWNER)


def _owner(path: Path) -> str:
    """The command that uses a results folder, in words."""
    try:
        return "'tyrecal {command}', process {pid} on {host} since {started}".format(
            **read_json(path, follow=False)
        )
    except (OSError, ValueError, KeyError, TypeError):  # not written yet
        return "another process"


class Run:
    """One command's run: its results folder, locked until the command ends, and the entry of its
    study in run.json, with all facts that differ between runs.

    Results are written to a separate folder, ``new``. Those of the study's last run stay in place
    until all new ones are written (`finish`), and if the run fails. Raises InputError if the folder
    holds results of another case or another command works in it; OSError.
    """

    def __init__(
        self,
        case: Path,
        output: Path | None,
        command: str,
        solver: Any = None,
        study: str = "",
        provenance: dict[str, Any] | None = None,
        loaded: LoadedCase | None = None,
    ):
        self.case, self.command, self.solver = case.resolve(), command, solver
        self.study, self.provenance, self.loaded = study or command, provenance, loaded
        self.folder = self.placed = output or root() / case.stem
        self.started = datetime.now(UTC).isoformat(timespec="seconds")
        self.figure_format = "png"
        self._clock, self._finished = time.monotonic(), False
        self.store: Store | None = None
        self.counts: Counts | None = None
        self.measured: Sequence[Path] = ()  # input files, which no result may replace
        resume("nothing was computed; the same command starts from the beginning")
        if self.folder.exists() and not self.folder.is_dir():
            raise InputError(f"'{self.folder}' is a file; give a folder with --output")
        make_folder(self.folder)
        self._lock = lock(self.folder, command, self.started)
        click.get_current_context().call_on_close(self._close)
        for own in (self.runs, self.folder / PREVIOUS):
            refuse_link(own)
        refuse_other(self.folder, self.case)
        if self._lock:
            drop_new(self.folder)
            if solver:
                self._drop_unfinished()
        with writing(self.folder):
            self.new = Path(tempfile.mkdtemp(prefix=NEW, dir=self.folder))
        self._write_facts()
        click.get_current_context().call_on_close(self._record_unfinished)

    def open_store(self, folder: Path | None, none: bool) -> Store | None:
        """The evaluation store in ``folder`` (None: next to the results). none: no store."""
        words = "no evaluation is stored (--no-store); the same command starts from the beginning"
        if not none:
            from ..simulate.evaluate.store import Store

            if not folder:
                refuse_link(self.folder / "record")
            self.store = Store((folder or self.folder / "record").resolve())
            words = (
                f"finished evaluations are stored in '{self.store.folder}'; run the same command"
                " again to resume"
            )
        resume(words)
        return self.store

    def write(self, result: AnyResult, figures: Mapping[str, Figure] | None = None) -> AnyResult:
        """Write a study's files and figures; returns the result with its provenance."""
        result = result.stamped(self.provenance or {})
        for name, text in result.texts().items():
            self.write_text(name, text)
        self.write_figures(figures or {})
        return result

    def write_figures(self, figures: Mapping[str, Figure]) -> None:
        """Write figures by name, as files of the run's format."""
        if figures:
            from ..report.figure import save

            for name, figure in figures.items():
                save(figure, self.new / f"{name}.{self.figure_format}")

    def write_json(self, name: str, content: Any) -> Any:
        """Write a result file with its provenance; returns its content."""
        if isinstance(content, BaseModel):
            content = content.model_dump(exclude_unset=True)
        if self.provenance:
            content = stamped(content, self.provenance)
        self.write_text(name, json_text(content))
        return content

    def write_text(self, name: str, text: str) -> None:
        """Write a result file. Raises InputError if it would replace an input file."""
        place = self.folder / name
        if place.resolve() in [each.resolve() for each in self.measured]:
            raise InputError(f"'{place}' is read, a result would replace it: give another --output")
        write_text(self.new / name, text)

    @property
    def runs(self) -> Path:
        """Where the solver's run folders go."""
        return self.folder / "runs"

    @property
    def has_earlier(self) -> bool:
        """Whether an earlier run of the study has left results, and this one none."""
        return not self._finished and any(results(self.folder, self.study))

    def finish(self, aside: str = "", **facts: Any) -> None:
        """Move the results to the results folder, or to its folder ``aside``, and write run.json:
        command, times, host, versions and further ``facts``."""
        if aside:
            self.placed = self.folder / aside
            private_dir(self.placed)
        with defer_interrupts():
            take_place(self.new, self.placed, self.study)
            self._finished = True
            self._write_facts(**({"results": aside} if aside else {}), **facts)

    def _write_facts(self, **facts: Any) -> None:
        from ..version import __version__

        counts = self.counts and {
            "solver_runs": self.counts.runs,
            "answered_from_record": self.counts.recorded,
        }
        entry = {
            **owner(self.folder, self.case, self.loaded),
            "command": self.command,
            "arguments": _arguments(),
            "started": self.started,
            "finished": self._finished,
            "seconds": round(time.monotonic() - self._clock, 3),
            "host": platform.node(),
            "python": platform.python_version(),
            "tyrecal": __version__,
            **solver_facts(self.solver),
            "record": str(self.store.folder) if self.store else None,
            **(counts or {}),
            **facts,
        }
        write_runs(self.folder, {self.study: entry})

    def _record_unfinished(self) -> None:
        """Write to run.json when an unfinished run ended."""
        if not self._finished:
            with contextlib.suppress(OSError):  # the error that ended the run is the one to print
                self._write_facts()

    def _drop_unfinished(self) -> None:
        """Remove the solver's run folders that ended processes have left."""
        from ..simulate.evaluate.folders import drop_unfinished

        drop_unfinished(self.runs)

    def _close(self) -> None:
        with defer_interrupts():
            if hasattr(self, "new"):
                shutil.rmtree(self.new, ignore_errors=True)
            if self.solver and self._lock and not self._finished:
                from ..simulate.evaluate.executor import end_workers

                end_workers()
                self._drop_unfinished()
            with contextlib.suppress(OSError):  # it holds failures, or was never made
                self.runs.rmdir()
        if self.store:
            self.store.prune()
        if self._lock:
            self._lock.close()


def drop_new(folder: Path) -> None:
    """Remove results of killed runs; call it only if no run can be active."""
    for left in folder.glob(f"{NEW}*"):
        shutil.rmtree(left, ignore_errors=True)  # which leaves a link alone


def refuse_other(folder: Path, case: Path) -> None:
    """Raises InputError if ``folder`` holds results of another case than ``case``; OSError if its
    run.json is no file."""
    if not os.path.lexists(folder / RUN):
        return
    entries = list(read_runs(folder).values())
    if not belongs_to(entries, folder, case):
        named = [file for entry in entries if (file := named_case(entry, folder))]
        named.sort(key=lambda file: not file.exists())  # existing files first
        raise InputError(
            f"folder '{folder}' holds results of {named[0] if named else 'something else'};"
            " give another one with --output"
        )


def _arguments() -> list[str]:
    """The words of the command line, as `main` got them."""
    context = click.get_current_context(silent=True)
    given = context.find_root().obj if context else None
    return list(sys.argv[1:] if given is None else given)
