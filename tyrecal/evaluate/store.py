"""The record of evaluations: a folder of files named by what was asked of which solver.

A key is the hash of every file that was written for a run (names and contents), of the solver's
name and version, and of the adapter's own sources, since they read the results.
"""

from __future__ import annotations

import contextlib
import inspect
import json
import logging
import os
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

from ..files import whole
from .record import DIGEST, Damaged, pack, unpack
from .solver import Solver

FORMAT = "1"
MOST_BYTES = 2_000_000_000
LEFTOVER_S = 3600.0  # age of a half-written file whose writer must be dead
log = logging.getLogger("tyrecal")


def key_of(folder: Path, solver: Solver) -> str:
    """What ``solver`` is asked by the files in ``folder``, as 64 hexadecimal digits."""
    digest = sha256()
    parts = [FORMAT, solver.name, solver.version, sources_of(type(solver))]
    pieces = [part.encode() for part in parts]
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        pieces += [path.relative_to(folder).as_posix().encode(), path.read_bytes()]
    for piece in pieces:  # with its length, so that no two lists of pieces run together
        digest.update(b"%d:" % len(piece))
        digest.update(piece)
    return digest.hexdigest()


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

    A record that does not match its checksum is moved aside, reported and otherwise absent.
    Writing never raises: an evaluation that succeeded is not lost to a full disc.
    """

    folder: Path
    opened: float = field(default_factory=lambda: time.time() - 1)  # file times lag behind
    _warned: bool = False

    def path(self, key: str) -> Path:
        """Where the record of a key stands."""
        return self.folder / key[:2] / f"{key}.record"

    def read(self, key: str) -> Any:
        """What was recorded, or None."""
        path = self.path(key)
        try:
            content = unpack(path.read_bytes())[1]
        except OSError:
            return None
        except Damaged as error:
            self._set_aside(path, str(error))
            return None
        with contextlib.suppress(OSError):  # a store that may only be read
            os.utime(path)  # the time of last use, for `prune`
        return content

    def write(self, key: str, about: dict[str, Any], content: Any) -> None:
        """Record ``content`` (see `pack`) whole or not at all; warns once where it cannot."""
        path = self.path(key)
        try:
            data = pack(about, content)
            path.parent.mkdir(parents=True, exist_ok=True)
            with whole(path, many_writers=True) as partial:
                partial.write_bytes(data)
        except (OSError, TypeError) as error:
            if not self._warned:
                log.warning("evaluations are not recorded in '%s': %s", self.folder, error)
            self._warned = True

    def prune(self, most_bytes: int = MOST_BYTES) -> int:
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

    def summary(self, verify: bool = False) -> dict[str, Any]:
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
                about = unpack(path.read_bytes())[0] if verify else _about(path)
            except Damaged as error:
                damaged += 1
                self._set_aside(path, str(error))
                continue
            except (OSError, ValueError, KeyError):
                damaged += 1
                continue
            records, size = records + 1, size + status.st_size
            solvers[f"{about['solver']} {about['version']}"] += 1
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
        for path in self.folder.glob("??/*"):
            if path.suffix in (".record", ".damaged", ".partial"):
                with contextlib.suppress(OSError):
                    yield path, path.stat()

    def _set_aside(self, path: Path, why: str) -> None:
        log.warning("record '%s' is damaged and not used: %s", path, why)
        with contextlib.suppress(OSError):
            path.replace(path.with_suffix(".damaged"))


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):  # another process was faster
        path.unlink()


def _about(path: Path) -> dict[str, Any]:
    """The record's first facts, without its arrays."""
    with path.open("rb") as file:
        file.seek(DIGEST)
        about: dict[str, Any] = json.loads(file.readline())["about"]
        return about
