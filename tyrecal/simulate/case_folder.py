"""Which case a folder of results belongs to, by its entries in run.json, one for each study.

An entry has the path of the case file relative to the folder (``case``), which stays right if a
project is moved, copied or renamed as a whole. If no file is there any more, the hash of the file's
tyre (``tyre_sha256``, without what the command line sets) decides.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..tyre.case import LoadedCase
from ..tyre.case.identity import tyre_sha256
from ..tyre.load import load_case


def owner(folder: Path, path: Path, loaded: LoadedCase | None = None) -> dict[str, str]:
    """The part of an entry that names the owner of the results in ``folder``: the case at ``path``,
    ``loaded`` if it is valid, or a batch, whose path is the folder itself. Raises OSError."""
    try:
        relative = os.path.relpath(path.resolve(), folder.resolve())
    except ValueError:  # on another drive of Windows
        relative = str(path.resolve())
    entry = {"case": Path(relative).as_posix()}
    return {**entry, "tyre_sha256": tyre_sha256(loaded.as_read or loaded)} if loaded else entry


def named_case(entry: Mapping[str, Any], folder: Path) -> Path | None:
    """Where the case of an entry of ``folder`` should be; None where the entry names none."""
    relative = entry.get("case")
    if not isinstance(relative, str):
        return None
    return Path(os.path.normpath(folder.resolve() / relative))


def belongs_to(entries: Sequence[Mapping[str, Any]], folder: Path, path: Path) -> bool:
    """Whether ``folder``, with these entries, is of the case, or batch, at ``path``: by the file
    if any is still there, else by the tyre, else by the file's name. Raises OSError."""
    named = [(entry, file) for entry in entries if (file := named_case(entry, folder))]
    there = [file for _, file in named if file.exists()]
    if there:
        return any(file.samefile(path) for file in there)
    return any(
        entry["tyre_sha256"] == _tyre_of(path) if "tyre_sha256" in entry else file.name == path.name
        for entry, file in named
    )


def _tyre_of(path: Path) -> str | None:
    """Hash of the tyre of a case file, None where it is not a valid case."""
    try:
        return tyre_sha256(load_case(path, allow_unusual=True))
    except (InputError, OSError):
        return None
