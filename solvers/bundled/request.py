"""What a deck cannot say, from the file JOB.request.json beside it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from . import grammar
from .keywords import DeckError, Keyword, read_keywords
from .steps import Tangent


@dataclass
class Request:
    """harmonics: n to solve (None: as many as *FREQUENCY's number of modes takes);
    modes_per_harmonic; sensitivities: variable to [job, line, field, d number / d variable] rows;
    own_frequency: rubber with a table of moduli over frequency has, in each mode, that of the
    mode's own frequency, not of PROPERTY EVALUATION; cavity: {"material", "surfaces"} of the gas
    inside the closed surfaces; sector: {"job", "width_deg"} of a sector about Theta = 0 in which
    the tyre is that of another section job, of the same mesh.
    """

    harmonics: list[int] | None = None
    modes_per_harmonic: int = 2
    sensitivities: dict[str, list[Tangent]] = field(default_factory=dict)
    own_frequency: bool = False
    cavity: dict[str, Any] | None = None
    sector: dict[str, Any] | None = None


def read_request(path: Path) -> Request:
    """The side file, or the plain request where there is none. Raises DeckError."""
    if not path.exists():
        return Request()
    try:
        return Request(**json.loads(path.read_text()))
    except (ValueError, TypeError) as error:
        raise DeckError(0, f"{path.name} is not a request: {error}") from None


def read_sector(folder: Path, sector: dict[str, Any]) -> list[Keyword]:
    """The model blocks of the sector's section job. Raises DeckError, OSError."""
    job = sector["job"]
    text = (folder / f"{job}.inp").read_text()
    return grammar.check(read_keywords(text, job), False)[0]
