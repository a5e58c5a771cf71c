"""The runner's options, from the case's ``solver.options``, kept in the run folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..decks import save_texts
from ..errors import Refused

OPTIONS_FILE = "abaqus.json"


@dataclass(frozen=True)
class Options:
    """Options of the solver, and the units of the decks."""

    licence_wait_s: float = 600.0  # longest time spent waiting for a licence, 0 = none
    licence_first_wait_s: float = 5.0  # the first wait, each later one twice as long
    length_m: float = 1.0  # metres per unit of length of the decks
    mass_kg: float = 1.0  # kilograms per unit of mass of the decks

    def save(self, folder: Path) -> list[Path]:
        """Write them into a run folder."""
        return save_texts({OPTIONS_FILE: json.dumps(asdict(self), indent=1) + "\n"}, folder)


def load(folder: Path) -> Options:
    """Options that were saved in a run folder. Raises OSError."""
    return Options(**json.loads((folder / OPTIONS_FILE).read_text(encoding="utf-8")))


def read_options(given: Mapping[str, Any], **units: float) -> Options:
    """Options of a case; units: ``length_m`` and ``mass_kg`` of a user's deck. Raises Refused."""
    smallest = {"licence_wait_s": 0.0, "licence_first_wait_s": 1e-3}
    unknown = sorted(set(given) - set(smallest))
    if unknown:
        known = ", ".join(smallest)
        raise Refused(f"solver.options: abaqus has no '{unknown[0]}', only {known}")
    for name, least in smallest.items():
        value = given.get(name, least)
        if isinstance(value, bool) or not isinstance(value, int | float) or not value >= least:
            raise Refused(
                f"solver.options.{name} must be a number of at least {least:g}, got {value!r}"
            )
    return Options(**given, **units)
