"""One record as bytes: a checksum, a line of JSON, then the arrays as npz. No pickle anywhere."""

from __future__ import annotations

import io
import json
from hashlib import sha256
from typing import Any

import numpy as np

ARRAY = "__array__"
DIGEST = 65  # bytes of the first line: 64 hexadecimal digits and its end


class Damaged(ValueError):
    """The bytes are not those that were written."""


def pack(about: dict[str, Any], content: Any) -> bytes:
    """``content``: dicts with text keys, lists, text, numbers, None and arrays, all kept to the
    last bit (tuples become lists, arrays of no dimension numbers). ``about``: plain JSON, for
    whoever lists records.

    Raises TypeError for anything else.
    """
    arrays: list[np.ndarray] = []  # one that stands in several places is kept once
    line = json.dumps({"about": about, "content": _plain(content, arrays)}) + "\n"
    stored = io.BytesIO()
    if arrays:
        np.savez(stored, *arrays)
    body = line.encode() + stored.getvalue()
    return sha256(body).hexdigest().encode() + b"\n" + body


def unpack(data: bytes) -> tuple[dict[str, Any], Any]:
    """(about, content) of `pack`. Raises Damaged."""
    digest, body = data[: DIGEST - 1], data[DIGEST:]
    if sha256(body).hexdigest().encode() != digest:
        raise Damaged("its checksum does not match")
    line, _, stored = body.partition(b"\n")
    parsed = json.loads(line)
    arrays = dict(np.load(io.BytesIO(stored), allow_pickle=False)) if stored else {}
    return parsed["about"], _filled(parsed["content"], arrays)


def _plain(value: Any, arrays: list[np.ndarray]) -> Any:
    """The value with arrays (NumPy's other numbers too) replaced by where they stand."""
    if isinstance(value, dict):
        if not all(isinstance(key, str) for key in value):
            raise TypeError("a dict whose keys are not text cannot be recorded")
        return {key: _plain(each, arrays) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each, arrays) for each in value]
    if isinstance(value, (np.ndarray, complex)) or (
        isinstance(value, np.generic) and not isinstance(value, float)
    ):
        array = np.asarray(value)
        if array.dtype.hasobject:
            raise TypeError("an array of Python objects cannot be recorded")
        place = next((i for i, known in enumerate(arrays) if known is array), len(arrays))
        if place == len(arrays):
            arrays.append(array)
        return {ARRAY: f"arr_{place}"}
    return value


def _filled(value: Any, arrays: Any) -> Any:
    if isinstance(value, dict):
        if ARRAY in value:
            array = arrays[value[ARRAY]]
            return array if array.ndim else array[()]
        return {key: _filled(each, arrays) for key, each in value.items()}
    return [_filled(each, arrays) for each in value] if isinstance(value, list) else value
