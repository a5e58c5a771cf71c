"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import json
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any


@contextlib.contextmanager
def whole(path: Path, many_writers: bool = False) -> Iterator[Path]:
    """A path beside ``path`` to write to; it takes its place at the end, or is removed.

    Raises OSError, naming ``path``, where the disc is full or the folder cannot be written.
    """
    mark = f".{secrets.token_hex(8)}" if many_writers else ""
    partial = path.with_name(f".{path.name}{mark}.partial")
    try:
        yield partial
        partial.replace(path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            partial.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror or str(error), str(path)) from None
        raise


def write_text(path: Path, text: str) -> None:
    """Write ``text`` whole or not at all, the same bytes on every system. Raises OSError."""
    with whole(path) as partial:
        partial.write_text(text, encoding="utf-8", newline="")


def json_text(content: Any) -> str:
    """A result as JSON. Raises ValueError where a number of it is not finite."""
    return json.dumps(content, indent=1, allow_nan=False) + "\n"
