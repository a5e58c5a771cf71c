"""Records of the ASCII results file: typed items on lines of 80 characters.

Written from the format in the ABAQUS manual, chapter "Results file output format". A record is
``*`` and items: ``I`` + width (2 characters) + digits, ``D`` + 22 characters, ``A`` + 8. The first
item is the record's length in words (items), itself included, the second its key. Items run on
across line ends; after an increment's end the line is filled with blanks and a blank line follows.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

Item = int | float | str
RECORD_LINE = 80  # characters of a line


def records(text: str) -> Iterator[tuple[int, list[Item]]]:
    """(key, attributes) of each record. Raises ValueError where the text is not whole."""
    lines = text.splitlines()
    if any(len(line) > RECORD_LINE for line in lines):
        raise ValueError(f"a line is longer than {RECORD_LINE} characters")
    data = "".join(line.ljust(RECORD_LINE) for line in lines).rstrip()
    at = 0
    while at < len(data):
        if data[at] != "*":
            raise ValueError(f"line {at // RECORD_LINE + 1}: an entry does not begin at its place")
        start, at = at, at + 1
        items: list[Item] = []
        try:
            count, at = _item(data, at)
            for _ in range(int(count) - 1):
                item, at = _item(data, at)
                items.append(item)
            yield int(items[0]), items[1:]
        except (ValueError, IndexError):
            raise ValueError(
                f"line {start // RECORD_LINE + 1}: an entry is cut short or damaged"
            ) from None
        while at < len(data) and data[at] == " ":  # after 2001 the line is filled with blanks
            at += 1


def _item(data: str, at: int) -> tuple[Item, int]:
    """The item of a record at place ``at``, and the place after it. Raises ValueError."""
    kind = data[at]
    if kind == "A":
        return data[at + 1 : at + 9], at + 9
    stop = at + 23 if kind == "D" else at + 3 + int(data[at + 1 : at + 3])
    if kind not in "ID" or data[stop - 1] == " ":
        raise ValueError
    if kind == "I":
        return int(data[at + 3 : stop]), stop
    return _float(data[at + 1 : stop]), stop


def _float(text: str) -> float:
    """A Fortran number; its exponent loses the letter where it takes three digits: 1.0-101."""
    return float(re.sub(r"D|(?<=\d)(?=[-+]\d{3}$)", "E", text))
