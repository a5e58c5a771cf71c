"""Mistakes in a case: where, what is written there, and what would be right."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...files import printable

MAX_FILES = 1000  # whose names are compared with a mistyped one
# least `difflib` ratio of two names, in the folder of a file and one folder down
MIN_SIMILARITY = {"*": 0.6, "*/*": 0.8}
Keys = tuple[str | int, ...]
"""Keys and list indices that lead to a value of the case."""
CaseData = Mapping[str, Any]
"""Content of a case file, or of a part of it, as it is written."""


@dataclass(frozen=True)
class Mistake:
    """One mistake in a file of the user."""

    file: str
    line: int  # from 1, 0 where it has none
    key: str  # dotted, empty where the file as a whole is wrong
    value: str  # as written, shortened; "missing" where nothing is
    message: str  # what would be right

    def __str__(self) -> str:
        what = f"{self.key} is {self.value}: " if self.key else ""
        where = f"{self.file}, line {self.line}" if self.line else self.file
        return "\n".join(map(printable, f"{where}: {what}{self.message}".split("\n")))


class CaseError(InputError):
    """A case that cannot be used; ``mistakes`` holds all that is wrong with it."""

    def __init__(self, mistakes: list[Mistake]):
        super().__init__("\n".join(map(str, mistakes)))
        self.mistakes = mistakes


def dotted(keys: Keys) -> str:
    """The key as people write it: ``materials.rubber.prony.0.g``."""
    return ".".join(map(str, keys))


def shortened(text: str, length: int = 40) -> str:
    """``text`` on one line, cut to ``length`` characters."""
    text = printable(text)
    return text if len(text) <= length else text[: length - 3] + "..."


def suggestion(name: str, known: Iterable[str], otherwise: str | None = None) -> str:
    """``; did you mean 'x'?``; where nothing is close ``otherwise``, or what is known."""
    names = list(known)
    close = get_close_matches(name, names, 1)
    if close:
        return f"; did you mean '{close[0]}'?"
    return f"; known: {', '.join(map(str, names)) or 'none'}" if otherwise is None else otherwise


def nearby(path: Path, suffix: str) -> str:
    """``; did you mean 'x'?``: the file with this suffix that was probably meant by ``path``, which
    is not there; next to it, or one folder down. Empty where none has such a name."""
    name = path.name.removesuffix(suffix) + suffix
    folder = path.parent if path.parent.is_dir() else path.parent.parent
    for pattern, alike in MIN_SIMILARITY.items():
        with suppress(OSError, ValueError):
            files = (p for p in folder.glob(f"{pattern}{suffix}") if p.is_file())
            # Names alone are compared: any two paths in one long folder look alike.
            names = {p.name: p for p in islice(files, MAX_FILES) if p.parent.name[:1] != "."}
            for close in get_close_matches(name, names, 1, alike):
                return f"; did you mean '{names[close]}'?"
    return ""
