"""The runner's options, from the case's ``solver.options``, kept in the run folder."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

FILE = "abaqus.json"


class OptionRefused(ValueError):
    """An option that the runner does not have, or a value that it cannot take."""


@dataclass(frozen=True)
class Options:
    """command: starts ABAQUS, a string or a list (no shell; a relative path starts from the run
    folder); licence_wait_s: longest time spent waiting for a licence, 0 = none;
    licence_first_wait_s: the first wait, each later one twice as long.
    """

    command: list[str] = field(default_factory=lambda: ["abaqus"])
    licence_wait_s: float = 600.0
    licence_first_wait_s: float = 5.0

    def save(self, folder: Path) -> Path:
        """Write them into a run folder."""
        path = folder / FILE
        path.write_text(json.dumps(asdict(self), indent=1) + "\n")
        return path


def load(folder: Path) -> Options:
    """Options that were saved in a run folder. Raises OSError."""
    return Options(**json.loads((folder / FILE).read_text()))


def read_options(given: Mapping[str, Any]) -> Options:
    """Options of a case. Raises OptionRefused."""
    unknown = sorted(set(given) - set(Options.__dataclass_fields__))
    if unknown:
        known = ", ".join(Options.__dataclass_fields__)
        raise OptionRefused(f"solver.options: abaqus has no '{unknown[0]}', only {known}")
    values = dict(given)
    if "command" in values:
        values["command"] = _command(values["command"])
    for name, least in (("licence_wait_s", 0.0), ("licence_first_wait_s", 1e-3)):
        value = values.get(name, least)
        if isinstance(value, bool) or not isinstance(value, int | float) or not value >= least:
            raise OptionRefused(
                f"solver.options.{name} must be a number of at least {least:g}, got {value!r}"
            )
    return Options(**values)


def _command(given: object) -> list[str]:
    try:
        words = shlex.split(given) if isinstance(given, str) else given
    except ValueError:  # an open quotation mark
        words = None
    if not (isinstance(words, list) and words and all(isinstance(w, str) and w for w in words)):
        raise OptionRefused(
            f"solver.options.command must be a command or a list of words, got {given!r}"
        )
    return list(words)
