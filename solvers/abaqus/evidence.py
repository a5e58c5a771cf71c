"""Whether what a run left is its result: new, whole, complete, sound, and the same in
.fil and .dat."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..errors import RunFailed
from .dat import DatTable
from .fil import SIM, ResultModes, read_fil

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
