"""Where Newton's method begins: an inflated shape, or another tyre on the road, in a file next to
the deck. The deck's last line states the hash as a comment, so that an answer is a function of the
deck alone."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from ...errors import Refused

Array = np.ndarray
FILE = "start.npy"
PRESSED_FILE = "start.npz"
PRESSED_ARRAYS = ("nodes", "displacement", "load_N", "deflection_m")
# the deck's last line: file and hash
COMMENT = re.compile(r"^\*\* Newton's method starts from (\S+), SHA-256 ([0-9a-f]{64})$", re.M)


@dataclass(frozen=True)
class PressedStart:
    """State of another tyre of the same mesh on the road, which is a good start, at q loads."""

    nodes: Array  # (n,) deck numbers
    # (q, ring, n, 3) r, theta, z, m, of rings all round from the road on: `HalfCircle.angles`, then
    # the angles between pi and 2 pi
    displacement: Array
    load_N: Array  # (q,)
    deflection_m: Array  # (q,) way of the axle from where the tyre just touches the road


def write_pressed_start(folder: Path, shape: PressedStart) -> str:
    """Write a tyre on the road next to the deck; the deck's last line. Raises OSError."""
    content = io.BytesIO()
    np.savez(content, **{name: getattr(shape, name) for name in PRESSED_ARRAYS})
    (folder / PRESSED_FILE).write_bytes(content.getvalue())
    return _last_line(PRESSED_FILE, _hash(content.getvalue()))


def read_pressed_start(folder: Path, text: str) -> PressedStart | None:
    """The tyre on the road that a deck's ``text`` names, None where it names none. Raises Refused
    where it is not there, or another one is; OSError."""
    named = COMMENT.search(text)
    if not named:
        return None
    content = _content(folder, PRESSED_FILE, named)
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return PressedStart(**{name: arrays[name] for name in PRESSED_ARRAYS})


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
    content = _content(folder, FILE, comment)
    shape: Array = np.load(io.BytesIO(content), allow_pickle=False)
    if shape.ndim != 2 or shape.shape[1] != 4 or shape.dtype.kind != "f":
        raise Refused(f"{FILE} must have four numbers a node: its own, and its displacement")
    return shape


def _content(folder: Path, file: str, named: re.Match[str]) -> bytes:
    """The file that a deck names. Raises Refused where it, or the one named, is not there;
    OSError."""
    if named[1] != file or not (folder / file).is_file():
        raise Refused(f"the deck names a state to start from, and {file} is not next to it")
    content = (folder / file).read_bytes()
    if _hash(content) != named[2]:
        raise Refused(f"{file} is not the state that the deck names: its SHA-256 differs")
    return content


def _last_line(file: str, digest: str) -> str:
    return f"** Newton's method starts from {file}, SHA-256 {digest}\n"


def _hash(content: bytes) -> str:
    return sha256(content).hexdigest()
