"""A record of the evaluation store as bytes: a checksum, a line of JSON, then arrays as npz.

A record holds the answer (frequencies, shapes, sensitivities) to one question: a deck, a solver and
what is requested of it. Its key is a hash of the question. `Store` writes and reads the files.
joblib's Memory is not used: it has no checksum, and unpickling a stranger's file can run code.
"""

from __future__ import annotations

import io
import json
from hashlib import sha256
from math import prod
from typing import Any
from zipfile import ZIP_STORED, ZipFile

import numpy as np

from ...errors import InputError
from ...files import Json

ARRAY = "__array__"
MAX_JSON_BYTES = 2_000_000  # a hundred times the longest line of an answer
MAX_ARRAYS = 5000  # in one record
DIGEST = 65  # bytes of the first line: 64 hexadecimal digits and the line's end


class Damaged(InputError):
    """The bytes of a record are not those that tyrecal wrote."""


def pack(key: str, about: Json, content: Any) -> bytes:
    """Bytes of a record: ``content``, the answer to the question with the hash ``key``.

    content: dicts with text keys, lists, text, finite numbers, None and arrays, kept to the last
    bit; tuples become lists, and arrays without a dimension become numbers. about: plain JSON on
    the answer (the solver's name and version, the cause of a failure), which lists of records read
    without the arrays.

    Raises TypeError for anything else, ValueError for a number that is not finite or more text or
    arrays than `unpack` reads.
    """
    arrays: list[np.ndarray] = []  # an array that content holds several times is stored once
    record = {"key": key, "about": about, "content": _plain(content, arrays)}
    line = json.dumps(record, allow_nan=False) + "\n"
    if len(line) > MAX_JSON_BYTES or len(arrays) > MAX_ARRAYS:
        raise ValueError(f"an answer of {len(line)} bytes and {len(arrays)} arrays is too large")
    stored = io.BytesIO()
    if arrays:
        np.savez(stored, *arrays)
    body = line.encode() + stored.getvalue()
    return sha256(body).hexdigest().encode() + b"\n" + body


def unpack(data: bytes, key: str) -> tuple[Json, Any]:
    """``about`` and ``content`` of the bytes that `pack` made. Raises Damaged, also if they have
    another key."""
    digest, body = data[: DIGEST - 1], data[DIGEST:]
    if sha256(body).hexdigest().encode() != digest:
        raise Damaged("its checksum does not match")
    try:
        line, _, stored = body.partition(b"\n")
        if len(line) > MAX_JSON_BYTES:
            raise Damaged(f"its text is longer than {MAX_JSON_BYTES / 1e6:g} MB")
        record = json.loads(line, parse_constant=_not_finite)
        about, content = record["about"], _with_arrays(record["content"], _arrays(stored))
    except Damaged:
        raise
    except Exception as error:  # any content that tyrecal does not write
        raise Damaged(f"it is not what tyrecal writes ({type(error).__name__})") from None
    if record.get("key") != key:
        raise Damaged("its content is of another evaluation than its name")
    if not isinstance(about, dict):
        raise Damaged("it does not state its solver")
    return about, content


def _not_finite(word: str) -> None:
    raise Damaged(f"{word} is not a number")


def _arrays(stored: bytes) -> dict[str, np.ndarray]:
    """Arrays by name, uncompressed only, so that none is larger than the file. Raises Damaged."""
    arrays: dict[str, np.ndarray] = {}
    if not stored:
        return arrays
    with ZipFile(io.BytesIO(stored)) as archive:
        members = archive.infolist()
        if len(members) > MAX_ARRAYS:
            raise Damaged(f"it has more than {MAX_ARRAYS} arrays")
        packed = any(each.compress_type != ZIP_STORED for each in members)
        if packed or sum(each.file_size for each in members) > len(stored):
            raise Damaged("its arrays are larger than the file")
        for each in members:
            with archive.open(each) as file:
                if np.lib.format.read_magic(file) != (1, 0):
                    raise Damaged("an array has another format")
                shape, _, dtype = np.lib.format.read_array_header_1_0(file)
                if dtype.hasobject or prod(shape) * dtype.itemsize != each.file_size - file.tell():
                    raise Damaged("an array has another size than stated")
            with archive.open(each) as file:
                array = np.lib.format.read_array(file, allow_pickle=False)
            arrays[each.filename.removesuffix(".npy")] = array
    return arrays


def _plain(value: Any, arrays: list[np.ndarray]) -> Any:
    """The value with each array, complex number and NumPy number except float64 moved to
    ``arrays`` and replaced by its name there."""
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


def _with_arrays(value: Any, arrays: dict[str, np.ndarray]) -> Any:
    """The value with arrays in place of their names: the inverse of `_plain`."""
    if isinstance(value, dict):
        if ARRAY in value:
            array = arrays[value[ARRAY]]
            return array if array.ndim else array[()]
        return {key: _with_arrays(each, arrays) for key, each in value.items()}
    return [_with_arrays(each, arrays) for each in value] if isinstance(value, list) else value
