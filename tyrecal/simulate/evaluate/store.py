"""The evaluation store: a folder of files named by the question and the solver.

A key is the hash of every file that was written for a run (names and contents, but for the comment
that a deck begins with), of the solver's name and version, of the program that it starts, and of
the adapter's own sources, since they read the results.
"""

from __future__ import annotations

import contextlib
import inspect
import json
import logging
import os
import stat
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...files import (
    Json,
    NotAFile,
    atomic_write,
    make_folder,
    open_file,
    private_dir,
    read_bytes,
    refuse_link,
)
from ..deck.decks import without_header
from ..program import program_identity
from .record import DIGEST, Damaged, pack, unpack
from .recorded import check
from .solver import Solver

FORMAT = "2"  # part of each key: another one makes all older records unknown
MAX_STORE_BYTES = 2_000_000_000  # bytes that `prune` leaves
MAX_RECORD_BYTES = 500_000_000  # bytes of one record
LEFTOVER_S = 3600.0  # age of a half-written file whose writer must be dead
log = logging.getLogger("tyrecal")


def key_of(folder: Path, solver: Solver) -> str:
    """Key of the question that the files in ``folder`` put to ``solver``, 64 hexadecimal digits."""
    digest = sha256()
    parts = [FORMAT, *solver_identity(solver)]
    pieces = [part.encode() for part in parts]
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        name = path.relative_to(folder).as_posix().encode()
        pieces += [name, without_header(path.read_bytes())]
    for piece in pieces:  # with its length, so that no two lists of pieces run together
        digest.update(b"%d:" % len(piece))
        digest.update(piece)
    return digest.hexdigest()


def solver_identity(solver: Solver) -> list[str]:
    """The marks by which answers of solvers differ: name, version, adapter, program."""
    command = getattr(solver, "command", None)
    program = program_identity(command) if command else []
    return [solver.name, solver.version, sources_of(type(solver)), *program]


_SOURCES: dict[type, str] = {}


def sources_of(adapter: type) -> str:
    """Hash of the adapter's package: an edit of a reader must not be forgotten in a version."""
    if adapter not in _SOURCES:
        digest = sha256()
        with contextlib.suppress(OSError, TypeError):  # an adapter without a source file
            for path in sorted(Path(inspect.getfile(adapter)).parent.glob("*.py")):
                digest.update(path.read_bytes())
        _SOURCES[adapter] = digest.hexdigest()
    return _SOURCES[adapter]


@dataclass
class Store:
    """Answers by key under ``folder``; any number of processes may read and write at once.

    A record that does not match its checksum or its name is moved aside, reported and otherwise
    absent.
    Writing never raises: an evaluation that succeeded is not lost to a full disc.
    """

    folder: Path
    # time, s, from which on used evaluations are this run's; 1 s early: file times lag behind
    opened: float = field(default_factory=lambda: time.time() - 1)
    _warned: bool = False

    def __post_init__(self) -> None:
        with contextlib.suppress(OSError):  # it is not there yet
            if os.name == "posix" and self.folder.stat().st_mode & stat.S_IWOTH:
                log.warning(
                    "evaluation store '%s' can be written by every user of this machine, who can"
                    " change your results: run 'chmod o-w' on it",
                    self.folder,
                )

    def path(self, key: str) -> Path:
        """Where the record of a key stands."""
        return self.folder / key[:2] / f"{key}.record"

    def read(self, key: str) -> Any:
        """The content that was recorded; None if it is absent or damaged."""
        path = self.path(key)
        try:
            refuse_link(path.parent)
            content = _read(path)[1]
        except Damaged as error:
            self.set_aside(path, str(error))
            return None
        except OSError:
            return None
        with contextlib.suppress(OSError):  # a store that may only be read
            os.utime(path)  # the time of last use, for `prune`
        return content

    def write(self, key: str, about: Json, content: Any) -> None:
        """Record ``content`` (see `pack`) whole or not at all; warns once if it cannot.

        about: facts for people: ``solver``, ``version`` and, of a failure, its ``cause``.
        """
        path = self.path(key)
        try:
            data = pack(key, about, content)
            if len(data) > MAX_RECORD_BYTES:
                raise ValueError(f"an answer of {len(data) / 1e6:.0f} MB is too large")
            make_folder(self.folder)
            private_dir(path.parent)
            with atomic_write(path, many_writers=True) as partial:
                partial.write_bytes(data)
        except (OSError, TypeError, ValueError) as error:
            if not self._warned:
                log.warning("evaluations are not stored in '%s': %s", self.folder, error)
            self._warned = True

    def prune(self, most_bytes: int = MAX_STORE_BYTES) -> int:
        """Remove what was least recently used until the store fits; the number removed.

        What this run wrote or read stays. Damaged records and leftovers of killed writers go.
        """
        records, removed = [], 0
        for path, status in self._files():
            used = status.st_mtime
            if path.suffix == ".record":
                records.append((used, status.st_size, path))
            elif path.suffix == ".damaged" or used < time.time() - LEFTOVER_S:
                _remove(path)
        size = sum(each for _, each, _ in records)
        for used, each, path in sorted(records):
            if size <= most_bytes or used >= self.opened:
                break
            _remove(path)
            size, removed = size - each, removed + 1
        return removed

    def summary(self, verify: bool = False) -> Json:
        """``records``, ``bytes``, ``solvers`` {name and version: records}, ``failures`` recorded,
        ``damaged``; ``verify`` checks every checksum, else only what was set aside counts."""
        records = size = damaged = failures = 0
        solvers: Counter[str] = Counter()
        for path, status in self._files():
            if path.suffix == ".damaged":
                damaged += 1
            if path.suffix != ".record":
                continue
            try:
                about = _read(path)[0] if verify else _about(path)
                solvers[f"{about['solver']} {about['version']}"] += 1
            except Damaged as error:
                damaged += 1
                self.set_aside(path, str(error))
                continue
            except (OSError, ValueError, KeyError, TypeError, RecursionError):
                damaged += 1
                continue
            records, size = records + 1, size + status.st_size
            failures += bool(about.get("cause"))
        return {
            "folder": str(self.folder),
            "records": records,
            "bytes": size,
            "solvers": dict(sorted(solvers.items())),
            "failures": failures,
            "damaged": damaged,
        }

    def _files(self) -> Iterator[tuple[Path, os.stat_result]]:
        folders = [path for path in self.folder.glob("??") if not path.is_symlink()]
        for path in (path for folder in folders for path in folder.glob("*")):
            if path.suffix in (".record", ".damaged", ".partial"):
                with contextlib.suppress(OSError):
                    yield path, path.lstat()

    def set_aside(self, path: Path, why: str) -> None:
        """Set a record aside, so that it counts as absent, and report why."""
        log.warning("evaluation '%s' is damaged and not used: %s", path, why)
        with contextlib.suppress(OSError):
            path.replace(path.with_suffix(".damaged"))


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):  # another process was faster
        path.unlink()


def _about(path: Path) -> Json:
    """The record's first facts, without its arrays."""
    with open_file(path, follow=False) as file:
        file.seek(DIGEST)
        about: Json = json.loads(file.readline(MAX_RECORD_BYTES))["about"]
        return about


def _read(path: Path) -> tuple[Json, Any]:
    """Read a record whole: the question that it is named by, and an answer that passes the checks.

    Raises Damaged; OSError where there is none, or it may not be read.
    """
    try:
        about, content = unpack(read_bytes(path, MAX_RECORD_BYTES, follow=False), path.stem)
    except NotAFile as error:
        raise Damaged(f"it {error.strerror}") from None
    check(content)
    if not {"solver", "version"} <= about.keys():
        raise Damaged("it does not state its solver")
    return about, content
