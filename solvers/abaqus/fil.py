"""The ASCII results file (.fil): modes with their shapes.

Keys of records read here: 1901 node, 101 U and 107 COORD (node number, components), 1980 mode
(number, omega^2, generalised mass), 2000 and 2001 start and end of an increment; nodal records
after a 1980 belong to its mode.

Records are typed items on lines of 80 characters, read by the format in the ABAQUS manual, chapter
"Results file output format". A record is
``*`` and items: ``I`` + width (2 characters) + digits, ``D`` + 22 characters, ``A`` + 8. The first
item is the record's length in words (items), itself included, the second its key. Items run on
across line ends; after an increment's end the line is filled with blanks and a blank line follows.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import RunFailed

Array = np.ndarray


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


NODE, MODE, U, COORD, START, END = 1901, 1980, 101, 107, 2000, 2001  # keys of records
SIM = (
    "a mode without a shape cannot be labelled; a release that uses the SIM architecture may"
    " need SIM=NO on *FREQUENCY to write shapes to the results file"
)


@dataclass(frozen=True)
class ResultModes:
    """Modes of a results file, in global x, y, z and in the units of the decks."""

    eigenvalues: Array  # (m,): omega^2 in 1/s2
    masses: Array  # (m,): generalised, of the shapes in `displacement`
    nodes: Array  # (k,): numbers
    # (k, 3): undeformed, of record 1901; of a node without one COORD, which may be inflated
    coordinates: Array
    displacement: Array  # (m, k, 3): any scale


def read_fil(path: Path) -> ResultModes:
    """Modes with shapes. Raises RunFailed (``no_results``) for a file that is not whole."""
    try:
        return _modes(path.read_text(encoding="latin-1"))
    except (OSError, ValueError, TypeError, IndexError) as error:
        raise RunFailed("no_results", f"{path.name}: {error}") from None


def _modes(text: str) -> ResultModes:
    """Eigenvalues, shapes and nodes from the records of a results file, modes by rising number.
    Raises ValueError."""
    places: dict[int, list[float]] = {}
    mode_data: dict[int, tuple[float, float]] = {}
    shapes: dict[int, dict[int, list[float]]] = {}
    mode, is_open, last = 0, False, 0
    for key, a in records(text):
        last = key
        if key in (START, END):
            mode, is_open = 0, key == START
        elif key == NODE:
            places[int(a[0])] = _vector(a)
        elif key == MODE:
            mode = int(a[0])
            if mode in mode_data:
                raise ValueError(f"mode {mode} is in it twice: two runs, or two steps of modes")
            mode_data[mode], shapes[mode] = (float(a[1]), float(a[2])), {}
        elif key == U and mode:
            shapes[mode][int(a[0])] = _vector(a)
        elif key == COORD and mode:
            places.setdefault(int(a[0]), _vector(a))
    if is_open or last != END:
        raise ValueError("it is cut short: its last increment does not end")
    if not mode_data:
        raise ValueError("it has no mode")
    order = sorted(mode_data)
    nodes = list(shapes[order[0]])
    if not nodes:
        raise ValueError(f"no shapes in it: {SIM}")
    for number in order:
        if list(shapes[number]) != nodes:
            raise ValueError(f"mode {number} is not given at the same nodes as mode {order[0]}")
    bare = [node for node in nodes if node not in places]
    if bare:
        raise ValueError(f"node {bare[0]} has no coordinates")
    return ResultModes(
        np.array([mode_data[n][0] for n in order]),
        np.array([mode_data[n][1] for n in order]),
        np.array(nodes),
        np.array([places[n] for n in nodes]),
        np.array([list(shapes[n].values()) for n in order]),
    )


def _vector(a: list[Item]) -> list[float]:
    """x, y, z of a nodal record; a component that is not there is 0."""
    return [float(value) for value in (*a[1:4], 0.0, 0.0)[:3]]
