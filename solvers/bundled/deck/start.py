"""Where Newton's method begins: an inflated shape in a file next to the deck, or another tyre on
the road in a folder next to it. The deck's last line states the hash as a comment, so that an
answer is a function of the deck alone."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ...decks import save_texts
from ...errors import Refused

Array = np.ndarray
FILE = "start.npy"
PRESSED_FOLDER, PRESSED_FILE = "start", "start/pressed.npz"
PRESSED_ARRAYS = ("nodes", "inflated", "displacement", "load_N", "deflection_m")
# the deck's last line: file and hash
COMMENT = re.compile(r"^\*\* Newton's method starts from (\S+), SHA-256 ([0-9a-f]{64})$", re.M)


@dataclass(frozen=True)
class PressedStart:
    """State of another tyre of the same mesh on the road, which is a good start."""

    texts: Mapping[str, str]  # its decks, file name to text
    nodes: Array  # (n,) deck numbers
    inflated: Array  # (n, 3) displacements r, theta, z before any load, m
    # (ring, n, 3) the same on the road, of rings all round from the road on: `HalfCircle.angles`,
    # then the angles between pi and 2 pi
    displacement: Array
    load_N: float
    deflection_m: float  # way of the axle from where the tyre just touches the road
    sha256: str = ""  # names it once it is written


def write_pressed_start(folder: Path, shape: PressedStart) -> str:
    """Put a tyre on the road next to the deck; the deck's last line. Raises OSError."""
    content = io.BytesIO()
    np.savez(content, **{name: getattr(shape, name) for name in PRESSED_ARRAYS})
    (folder / PRESSED_FOLDER).mkdir()
    (folder / PRESSED_FILE).write_bytes(content.getvalue())
    save_texts(shape.texts, folder / PRESSED_FOLDER)
    return _last_line(PRESSED_FILE, _hash_pressed(content.getvalue(), shape.texts))


def read_pressed_start(folder: Path, text: str) -> PressedStart | None:
    """The tyre on the road that a deck's ``text`` names, None where it names none. Raises Refused
    where it is not there, or another one is; OSError."""
    named = COMMENT.search(text)
    if not named:
        return None
    content = _content(folder, PRESSED_FILE, named, "a tyre", "there")
    texts = {
        each.name: each.read_text(encoding="utf-8")
        for each in sorted((folder / PRESSED_FOLDER).glob("*.inp"))
    }
    if _hash_pressed(content, texts) != named[2]:
        raise Refused(f"{PRESSED_FOLDER} is not the tyre that the deck names: its SHA-256 differs")
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        fields: dict[str, Any] = {name: arrays[name] for name in PRESSED_ARRAYS}
    fields |= {name: float(fields[name]) for name in ("load_N", "deflection_m")}
    return PressedStart(texts, **fields, sha256=named[2])


def write_start(folder: Path, shape: Array) -> str:
    """Write ``shape`` (n, 4), node number and displacement r, theta, z in m, next to the deck;
    returns the deck's last line. Raises OSError."""
    content = io.BytesIO()
    np.save(content, np.ascontiguousarray(shape, dtype="<f8"), allow_pickle=False)
    (folder / FILE).write_bytes(content.getvalue())
    return _last_line(FILE, _hash(content.getvalue()))


def read_start(folder: Path, text: str) -> Array | None:
    """The shape (n, 4) that a deck's ``text`` names, None where it names none. Raises Refused where
    it is not there, or another one is; OSError."""
    comment = COMMENT.search(text)
    if not comment:
        return None
    content = _content(folder, FILE, comment, "a shape", "next to it")
    if _hash(content) != comment[2]:
        raise Refused(f"{FILE} is not the shape that the deck names: its SHA-256 differs")
    shape: Array = np.load(io.BytesIO(content), allow_pickle=False)
    if shape.ndim != 2 or shape.shape[1] != 4 or shape.dtype.kind != "f":
        raise Refused(f"{FILE} must have four numbers a node: its own, and its displacement")
    return shape


def _content(folder: Path, file: str, named: re.Match[str], what: str, where: str) -> bytes:
    """The file that a deck names. Raises Refused where it is not there; OSError."""
    if named[1] != file or not (folder / file).is_file():
        raise Refused(f"the deck names {what} to start from, and {file} is not {where}")
    return (folder / file).read_bytes()


def _last_line(file: str, digest: str) -> str:
    return f"** Newton's method starts from {file}, SHA-256 {digest}\n"


def _hash_pressed(content: bytes, texts: Mapping[str, str]) -> str:
    """The hash of a tyre on the road; comments of its decks do not count."""
    lines = [
        line
        for name in sorted(texts)
        for line in [name, *texts[name].splitlines()]
        if not line.startswith("**")
    ]
    return _hash(content + "\n".join(lines).encode())


def _hash(content: bytes) -> str:
    return sha256(content).hexdigest()
