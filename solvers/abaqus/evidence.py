"""Whether what a run left is its result: new, whole, complete, sound, and the same in
.fil and .dat. The printed output (.dat) has a table of eigenvalues, about five digits, and the
model's mass.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import RunFailed
from ..language.text import number_from
from .fil import SIM, ResultModes, read_fil

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


# largest relative difference of a frequency between .fil and .dat, which prints about five digits
PRINTED_RTOL = 1e-3


def checked_modes(path: Path, expected: int | None, table: DatTable) -> ResultModes:
    """Modes of the results file at ``path``; ``expected`` of them (None: any number), those of the
    .dat's table. Raises RunFailed: ``no_results``, or ``unstable`` for a negative eigenvalue."""
    dat = path.with_suffix(".dat").name
    if not path.exists():
        printed = f"{dat} lists {len(table.frequencies_Hz)} frequencies, but "
        raise _failed(f"{printed * bool(table.frequencies_Hz)}there is no {path.name}: {SIM}")
    if path.stat().st_mtime < path.with_suffix(".inp").stat().st_mtime:
        raise _failed(f"{path.name} is older than the deck: not of this run")
    modes = read_fil(path)
    values = modes.eigenvalues
    if expected is not None and len(values) != expected:
        raise _failed(f"{path.name} has {len(values)} modes, {expected} were requested")
    if not all(np.isfinite(part).all() for part in (values, modes.masses, modes.displacement)):
        raise _failed(f"{path.name} has values that are not numbers")
    if (values < 0).any():
        raise RunFailed("unstable", f"{path.name}: eigenvalue {values.min():g} is negative")
    if not (values.all() and (modes.masses > 0).all() and modes.displacement.any((1, 2)).all()):
        raise _failed(f"{path.name}: a mode's eigenvalue, mass or shape is zero")
    own_Hz = np.sqrt(values) / (2 * np.pi)
    for number, printed_Hz in table.frequencies_Hz.items():
        own = own_Hz[number - 1] if number <= len(own_Hz) else np.nan
        if not abs(own - printed_Hz) <= PRINTED_RTOL * printed_Hz:
            raise _failed(f"{path.name} and {dat} disagree on mode {number}")
    if table.mass is None:
        raise _failed(f"{dat} states no TOTAL MASS OF MODEL")
    return modes


def _failed(message: str) -> RunFailed:
    return RunFailed("no_results", message)
