"""Files of other formats, recognised by how they begin, so that a message can name them."""

from __future__ import annotations

import re

HEAD = 4096  # bytes that tell
PROPERTY_FILE, TYDEX = "tyre property file (.tir)", "TYDEX file"
FORMATS = (
    (rb"MATLAB [57]\.\d MAT-file", "MATLAB file (.mat)"),
    (rb"\x89HDF\r\n\x1a\n", "HDF5 file"),
    (
        rb"(?im)^\s*\[(?:MDI_HEADER|UNITS|MODEL|DIMENSION|OPERATING_CONDITIONS|VERTICAL)\]",
        PROPERTY_FILE,
    ),
    (rb"(?im)^\*\*(?:HEADER|CONSTANTS|MEASURCHANNELS)", TYDEX),
)


def other_format(raw: bytes) -> str | None:
    """Name of the format of a file that is neither a table nor a universal file; None if it may
    be one. raw: the file, or its first 4096 bytes."""
    head = raw[:HEAD]
    return next((name for pattern, name in FORMATS if re.search(pattern, head)), None)
