"""The printed output (.dat): table of eigenvalues, about five digits, and the model's mass."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ..language.text import number_from

_HEADER = re.compile(r"E I G E N V A L U E\s+O U T P U T")
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][-+]?\d+)?"
_ROW = re.compile(rf"^\s*(\d+)((?:\s+{_NUMBER}){{5}})\s*$")
_MASS = re.compile(rf"TOTAL MASS OF MODEL[\s=:]*({_NUMBER})")


@dataclass(frozen=True)
class DatTable:
    """Frequencies and mass that a job prints; a deck's unit of time is the second."""

    frequencies_Hz: dict[int, float]  # of the last table, by number of the mode
    mass: float | None  # of all the elements, in the deck's unit; None if it is not printed


def read_dat(path: Path) -> DatTable:
    """The last table of eigenvalues and the last total mass; empty where the file has none.

    Rows hold mode, eigenvalue, rad/time, cycles/time, generalised mass, composite damping.
    """
    text = path.read_text(encoding="latin-1") if path.exists() else ""
    headers = list(_HEADER.finditer(text))
    masses = _MASS.findall(text)
    return DatTable(
        _rows(text[headers[-1].end() :]) if headers else {},
        number_from(masses[-1]) if masses else None,
    )


def _rows(text: str) -> dict[int, float]:
    """Numbers of the first table of eigenvalues, by mode number."""
    by_number: dict[int, float] = {}
    for line in text.splitlines():
        row = _ROW.match(line)
        if row and int(row[1]) == len(by_number) + 1:
            by_number[int(row[1])] = number_from(row[2].split()[2])  # cycles/time
        elif by_number and line.strip():  # the next table, of participation factors
            break
    return by_number
