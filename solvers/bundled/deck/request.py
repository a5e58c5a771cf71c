"""Requests that a deck cannot express, read from the file JOB.request.json next to it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from math import radians
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, ConfigDict, Field, TypeAdapter, ValidationError

from ...errors import Refused
from ...language.text import Block, read_deck, read_keywords
from . import steps

MAX_HARMONIC, MAX_MODES = 999, 999  # harmonic; modes of one
MAX_RESPONSE_LINES = 20_000  # of a response
TREAD_DIRECTIONS = "radial", "tangential", "lateral"  # components 0, 1, 2 of displacements


def _each_once(harmonics: list[int]) -> list[int]:
    if len(set(harmonics)) < len(harmonics):
        raise ValueError("must have each harmonic once")
    return harmonics


Finite = Annotated[float, Field(ge=-1e300, le=1e300)]
Name = Annotated[str, Field(min_length=1)]
Harmonic = Annotated[int, Field(ge=0, le=MAX_HARMONIC)]
Modes = Annotated[int, Field(ge=1, le=MAX_MODES)]
# job, 1-based line, 0-based field, d number / d variable
Slope = tuple[Name, Annotated[int, Field(ge=1)], Annotated[int, Field(ge=0)], Finite]
Points = Annotated[  # Theta in degrees, direction
    list[tuple[Finite, Literal["radial", "tangential", "lateral"]]], Field(min_length=1)
]


@dataclass
class _Strict:
    """Content of a request file: no other keys, no number as a text."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True)


@dataclass
class CavityRequest(_Strict):
    """A gas in closed surfaces."""

    material: Name
    surfaces: Annotated[list[Name], Field(min_length=1)]


@dataclass
class SectorRequest(_Strict):
    """A sector about Theta = 0 in which the tyre is that of another section job, of the same
    mesh."""

    job: Name
    width_deg: Annotated[float, Field(gt=0, le=360)]


@dataclass
class ResponseRequest(_Strict):
    """Responses to a force on a square patch of the tread."""

    lowest_Hz: Annotated[float, Field(ge=0, le=1e4)]
    highest_Hz: Annotated[float, Field(ge=1, le=1e4)]
    lines: Annotated[int, Field(ge=2, le=MAX_RESPONSE_LINES)]  # frequencies of equal steps
    patch_m: Annotated[float, Field(ge=1e-3, le=0.5)]  # width of the patch
    excite: Points  # where a force acts
    respond: Points  # where motions are wanted
    modes: Modes | None = None  # also matrices of the rim's motions and so many modes

    def points(self) -> list[list[tuple[float, int]]]:
        """Angle, rad, and component of the points that are excited, and of those that respond."""
        return [
            [(radians(angle), TREAD_DIRECTIONS.index(way)) for angle, way in points]
            for points in (self.excite, self.respond)
        ]


@dataclass
class Request(_Strict):
    """Results and settings requested in addition to the deck."""

    # None: as many as *FREQUENCY's number of modes takes
    harmonics: Annotated[list[Harmonic], Field(min_length=1), AfterValidator(_each_once)] | None = (
        None
    )
    modes_per_harmonic: Modes = 2
    sensitivities: dict[str, list[Slope]] = field(default_factory=dict)  # by variable
    # rubber with a table of moduli has, in each mode, that of the mode's own frequency, not of the
    # frequency that PROPERTY EVALUATION of *FREQUENCY states
    own_frequency: bool = False
    cavity: CavityRequest | None = None
    sector: SectorRequest | None = None
    response: ResponseRequest | None = None


ROWS = {  # what a list of lists holds
    "sensitivities": "; a row is [job, line, field, d number / d variable]",
    "response": "; a point is [angle in degrees, direction]",
}


def read_request(path: Path, jobs: Sequence[str]) -> Request:
    """The side file of ``jobs``, or the plain request where there is none. Raises Refused: key,
    value and what would be right."""
    if not path.exists():
        return Request()
    try:
        request = _schema().validate_json(read_deck(path))
    except ValidationError as error:
        raise Refused(f"{path.name}: {_sentence(error)}") from None
    wrong, known, sector, response = [], [*jobs], request.sector, request.response
    if sector:
        known.append(sector.job)
        if Path(sector.job).name != sector.job or not (path.parent / f"{sector.job}.inp").is_file():
            right = "must be a job with its deck in the same folder"
            wrong.append(f"sector.job is {sector.job}, {right}")
    if response and not response.lowest_Hz < response.highest_Hz:
        wrong.append(f"response.highest_Hz is {response.highest_Hz}, must be above lowest_Hz")
    for variable, rows in request.sensitivities.items():
        for i in (i for i, (job, *_) in enumerate(rows) if job not in known):
            right = f"must be a job: {' or '.join(known)}"
            wrong.append(f"sensitivities.{variable}[{i}][0] is {rows[i][0]}, {right}")
    if wrong:
        raise Refused(f"{path.name}: {wrong[0]}")
    return request


@cache
def _schema() -> TypeAdapter[Request]:
    """The schema of requests, built once: that takes as long as a tenth of an evaluation."""
    return TypeAdapter(Request)


def _sentence(error: ValidationError) -> str:
    """The first mistake of a request: key, value and what would be right."""
    first = error.errors(include_url=False)[0]
    kind, words = first["type"], first["msg"].removeprefix("Value error, ")
    if kind == "json_invalid":
        return f"is not JSON: {words}"
    loc = first["loc"]
    key = "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in loc).lstrip(".")
    row = ROWS.get(str(loc[0]), "") if any(isinstance(k, int) for k in loc) else ""
    if kind == "missing":
        return f"{key} is missing{row}"
    if kind == "unexpected_keyword_argument":
        shapes = {"cavity": CavityRequest, "sector": SectorRequest, "response": ResponseRequest}
        shape = shapes.get(key.partition(".")[0], Request)
        words = f"no such key; there are {', '.join(each.name for each in fields(shape))}"
    words = re.sub(r"^(Input|List|Tuple|String) should", "must", words)
    return f"{key or 'the request'} is {json.dumps(first['input']):.60}, {words}{row}"


def read_sector(folder: Path, sector: SectorRequest) -> list[Block]:
    """The model blocks of the sector's section job, which by `steps.check` may have only what is
    honoured in a section. Raises DeckError, OSError."""
    text = read_deck(folder / f"{sector.job}.inp")
    return steps.check(read_keywords(text, sector.job), revolve=False)[0]
