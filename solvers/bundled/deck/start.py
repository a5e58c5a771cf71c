"""Where Newton's method begins: an inflated shape in a file beside the deck, whose hash the deck's
last line states as a comment, so that an answer is a function of the deck alone."""

from __future__ import annotations

import io
import re
from hashlib import sha256
from pathlib import Path

import numpy as np

from ...errors import Refused

Array = np.ndarray
FILE = "start.npy"
COMMENT = re.compile(r"^\*\* Newton's method starts from (\S+), SHA-256 ([0-9a-f]{64})$", re.M)


def write_start(folder: Path, shape: Array) -> str:
    """Put ``shape`` (n, 4), node number and displacement in m, beside the deck; the deck's last
    line. Raises OSError."""
    content = io.BytesIO()
    np.save(content, np.ascontiguousarray(shape, dtype="<f8"), allow_pickle=False)
    (folder / FILE).write_bytes(content.getvalue())
    return f"** Newton's method starts from {FILE}, SHA-256 {_hash(content.getvalue())}\n"


def read_start(folder: Path, text: str) -> Array | None:
    """The shape (n, 4) that a deck's ``text`` names, None where it names none.

    Raises Refused where it is not there, or another one is; OSError.
    """
    found = COMMENT.search(text)
    if not found:
        return None
    path = folder / FILE
    if found[1] != FILE or not path.is_file():
        raise Refused(f"the deck names a shape to start from, and {FILE} is not beside it")
    content = path.read_bytes()
    if _hash(content) != found[2]:
        raise Refused(f"{FILE} is not the shape that the deck names: its SHA-256 is another")
    shape: Array = np.load(io.BytesIO(content), allow_pickle=False)
    if shape.ndim != 2 or shape.shape[1] != 4 or shape.dtype.kind != "f":
        raise Refused(f"{FILE} must have four numbers a node: its own, and its displacement")
    return shape


def _hash(content: bytes) -> str:
    return sha256(content).hexdigest()
