"""Files of other formats, recognised by how they begin, so that a message can name them."""

from __future__ import annotations

import re

HEAD = 4096  # bytes that tell
FORMATS = (
    (rb"MATLAB [57]\.\d MAT-file", "MATLAB file (.mat)"),
    (rb"\x89HDF\r\n\x1a\n", "HDF5 file"),
    (rb"(?i)(?:^|[\r\n])\s*\[MDI_HEADER\]", "tyre property file (.tir)"),
    (rb"(?i)(?:^|[\r\n])\*\*HEADER", "TYDEX file"),
)


def other_format(raw: bytes) -> str | None:
    """Name of the format of a file that is neither a table nor a universal file; None if it may
    be one. raw: the file, or its first 4096 bytes."""
    head = raw[:HEAD]
    return next((name for pattern, name in FORMATS if re.search(pattern, head)), None)
