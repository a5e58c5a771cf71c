"""The seal of a blind trial: its truth is in a separate folder, its sha256 with the trials.

truth.json has a random number, so that the truth cannot be guessed from its hash. ``answer`` never
opens its folder, and refuses to work if a truth is among the trials. Answers are hashed before
``score`` opens the truth and checks its hash.
"""

from __future__ import annotations

import secrets
from hashlib import sha256
from pathlib import Path

from ...errors import InputError
from ...files import Json, read_bytes
from .protocol import read_json, write_json

SEAL, TRUTH, ANSWERS = "seal.json", "truth.json", "answers.json"


def seal(folder: Path, sealed: Path, content: Json) -> str:
    """Write the truth to ``sealed`` and its sha256 to ``folder``; returns the sha256."""
    write_json(sealed / TRUTH, {"nonce": secrets.token_hex(32), **content})
    digest = _sha256(sealed / TRUTH)
    write_json(folder / SEAL, {"sha256": digest})
    return digest


def open_truth(folder: Path, sealed: Path) -> Json:
    """Content of truth.json. Raises InputError if it is not the sealed one, or an answer is missing
    or was changed since `seal_answers`."""
    stated = read_json(folder / ANSWERS)
    answered = {path.stem for path in (folder / "answers").glob("*.json")}
    if answered != {path.stem for path in (folder / "trials").glob("*.csv")}:
        raise InputError(f"{folder}: not every trial has one answer; 'tyrecal blind answer' first")
    if stated != _hashed_answers(folder):
        raise InputError(f"{folder}: answers were changed after they were hashed")
    content = read_json(sealed / TRUTH)
    if _sha256(sealed / TRUTH) != read_json(folder / SEAL).get("sha256"):
        raise InputError(f"{sealed / TRUTH} is not the truth that {folder / SEAL} seals")
    return content


def refuse_open_truth(folder: Path) -> None:
    """Raises InputError if a truth is in ``folder``, where answers are computed, or no seal is."""
    paths = sorted(folder.rglob(TRUTH))
    if paths:
        raise InputError(f"{paths[0]} is open among the trials; move it to another folder")
    read_json(folder / SEAL)


def seal_answers(folder: Path) -> str:
    """Write the sha256 of all answers together to ``folder``; returns it."""
    hashed = _hashed_answers(folder)
    write_json(folder / ANSWERS, hashed)
    return str(hashed["sha256"])


def _hashed_answers(folder: Path) -> Json:
    """sha256 of one line for each answer, its file's name and sha256; and how many these are."""
    files = sorted((folder / "answers").glob("*.json"))
    lines = "".join(f"{path.name} {_sha256(path)}\n" for path in files)
    return {"sha256": sha256(lines.encode()).hexdigest(), "count": len(files)}


def _sha256(path: Path) -> str:
    return sha256(read_bytes(path, follow=False)).hexdigest()
