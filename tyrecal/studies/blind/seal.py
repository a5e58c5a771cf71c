"""The seal: the truth lies in a folder of its own, its sha256 next to the trials.

truth.json holds a nonce, so that nobody can find the truth by trying; ``answer`` never opens its
folder and refuses to work where a truth lies among the trials; answers are hashed before ``score``
opens the truth and checks that it is the one that was sealed.
"""

from __future__ import annotations

import json
import secrets
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...files import atomic_write, read_bytes
from .protocol import read_json, write_json

SEAL, TRUTH, ANSWERS = "seal.json", "truth.json", "answers.json"


def seal(folder: Path, sealed: Path, content: dict[str, Any]) -> str:
    """Write the truth to ``sealed`` and its sha256 to ``folder``; returns the sha256."""
    text = json.dumps({"nonce": secrets.token_hex(32), **content}, indent=1, allow_nan=False)
    with atomic_write(sealed / TRUTH) as partial:
        partial.write_text(text + "\n", encoding="utf-8")
    mark = _sha256(sealed / TRUTH)
    write_json(folder / SEAL, {"sha256": mark})
    return mark


def open_truth(folder: Path, sealed: Path) -> dict[str, Any]:
    """The truth, if it is the sealed one and the answers are in. Raises InputError."""
    check_answers(folder)
    content = read_json(sealed / TRUTH)
    if _sha256(sealed / TRUTH) != read_json(folder / SEAL).get("sha256"):
        raise InputError(f"{sealed / TRUTH} is not the truth that {folder / SEAL} seals")
    return content


def refuse_open_truth(folder: Path) -> None:
    """Raises InputError where the truth can be read from the folder that is answered."""
    paths = sorted(folder.rglob(TRUTH))
    if paths:
        raise InputError(f"{paths[0]} lies open among the trials; move it elsewhere")
    read_json(folder / SEAL)


def seal_answers(folder: Path, files: list[Path]) -> str:
    """Write one sha256 over all answers, by name; returns it."""
    mark = _of_all(files)
    write_json(folder / ANSWERS, {"sha256": mark, "count": len(files)})
    return mark


def check_answers(folder: Path) -> list[Path]:
    """The answers, if all are in and none was changed since. Raises InputError."""
    stated = read_json(folder / ANSWERS)
    files = sorted((folder / "answers").glob("*.json"))
    names = {path.stem for path in (folder / "trials").glob("*.csv")}
    if {path.stem for path in files} != names:
        raise InputError(f"{folder}: not every trial has one answer; 'tyrecal blind answer' first")
    if stated.get("sha256") != _of_all(files):
        raise InputError(f"{folder}: answers were changed after they were hashed")
    return files


def _of_all(files: list[Path]) -> str:
    marks = "".join(f"{path.name} {_sha256(path)}\n" for path in sorted(files))
    return sha256(marks.encode()).hexdigest()


def _sha256(path: Path) -> str:
    return sha256(read_bytes(path, follow=False)).hexdigest()
