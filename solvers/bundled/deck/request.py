"""What a deck cannot say, from the file JOB.request.json beside it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from math import isfinite
from pathlib import Path
from typing import Any

from . import grammar
from .keywords import DeckError, Keyword, read_deck, read_keywords
from .steps import Tangent

MAX_HARMONIC, MAX_MODES = 999, 999  # harmonic; modes of one


class BadRequest(DeckError):
    """The side file is not a request: the message has file, key, value and what would be right."""

    def __init__(self, file: str, key: str, value: Any, right: str):
        told = f"{key} is {json.dumps(value):.60}, " if key else ""
        ValueError.__init__(self, f"{file}: {told}{right}")
        self.line = 0


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


def read_request(path: Path, jobs: Sequence[str]) -> Request:
    """The side file of ``jobs``, or the plain request where there is none. Raises DeckError."""
    if not path.exists():
        return Request()
    if not path.is_file():
        raise BadRequest(path.name, "", None, "is no file")
    try:
        content = json.loads(read_deck(path))
    except DeckError:
        raise
    except (ValueError, RecursionError) as error:
        raise BadRequest(path.name, "", None, f"is not JSON: {error}") from None
    _object(path.name, "the request", content, [each.name for each in fields(Request)])
    for key, value in content.items():
        _CHECKS[key](path.name, key, value)
    request = Request(**content)
    known = [*jobs, *([request.sector["job"]] if request.sector else [])]
    for variable, rows in request.sensitivities.items():
        for i, row in enumerate(rows):
            if row[0] not in known:
                key = f"sensitivities.{variable}[{i}][0]"
                raise BadRequest(path.name, key, row[0], f"must be a job: {' or '.join(known)}")
    if request.sector and not path.with_name(f"{request.sector['job']}.inp").is_file():
        raise BadRequest(path.name, "sector.job", request.sector["job"], "has no deck beside it")
    return request


def read_sector(folder: Path, sector: dict[str, Any]) -> list[Keyword]:
    """The model blocks of the sector's section job. Raises DeckError, OSError."""
    job = sector["job"]
    text = read_deck(folder / f"{job}.inp")
    return grammar.check(read_keywords(text, job), False)[0]


def _whole(least: int, most: int | None = None) -> Callable[[str, str, Any], None]:
    """Checks for a whole number."""
    right = f"must be a whole number from {least}" + ("" if most is None else f" to {most}")

    def check(file: str, key: str, value: Any) -> None:
        if type(value) is not int or value < least or (most is not None and value > most):
            raise BadRequest(file, key, value, right)

    return check


def _harmonics(file: str, key: str, value: Any) -> None:
    if value is None:
        return
    if not isinstance(value, list) or not value:
        raise BadRequest(file, key, value, "must be a list of harmonics, as in [0, 1, 2], or null")
    for i, n in enumerate(value):
        _whole(0, MAX_HARMONIC)(file, f"{key}[{i}]", n)
        if n in value[:i]:
            raise BadRequest(file, f"{key}[{i}]", n, "must stand there once")


def _sensitivities(file: str, key: str, value: Any) -> None:
    _object(file, key, value)
    for variable, rows in value.items():
        place = f"{key}.{variable}"
        if not isinstance(rows, list):
            raise BadRequest(file, place, rows, "must be a list of rows")
        for i, row in enumerate(rows):
            if not isinstance(row, list) or len(row) != 4:
                right = "must be a row [job, line, field, d number / d variable]"
                raise BadRequest(file, f"{place}[{i}]", row, right)
            job, line, index, slope = row
            _text(file, f"{place}[{i}][0]", job)
            _whole(1)(file, f"{place}[{i}][1]", line)
            _whole(0)(file, f"{place}[{i}][2]", index)
            _finite(file, f"{place}[{i}][3]", slope)


def _own_frequency(file: str, key: str, value: Any) -> None:
    if not isinstance(value, bool):
        raise BadRequest(file, key, value, "must be true or false")


def _cavity(file: str, key: str, value: Any) -> None:
    if value is None:
        return
    _object(file, key, value, ["material", "surfaces"], all_of_them=True)
    _text(file, f"{key}.material", value["material"])
    surfaces = value["surfaces"]
    if not isinstance(surfaces, list) or not surfaces:
        raise BadRequest(file, f"{key}.surfaces", surfaces, "must be a list of surfaces' names")
    for i, name in enumerate(surfaces):
        _text(file, f"{key}.surfaces[{i}]", name)


def _sector(file: str, key: str, value: Any) -> None:
    if value is None:
        return
    _object(file, key, value, ["job", "width_deg"], all_of_them=True)
    _text(file, f"{key}.job", value["job"])
    if Path(value["job"]).name != value["job"]:
        raise BadRequest(file, f"{key}.job", value["job"], "must be a job in the same folder")
    _finite(file, f"{key}.width_deg", value["width_deg"])
    if not 0 < value["width_deg"] <= 360:
        raise BadRequest(
            file, f"{key}.width_deg", value["width_deg"], "must be above 0 and at most 360"
        )


def _object(
    file: str, key: str, value: Any, names: Sequence[str] = (), all_of_them: bool = False
) -> None:
    """Checks for an object, where there are ``names`` with no others."""
    told = f" with {' and '.join(names)}" if all_of_them else ""
    if not isinstance(value, dict) or (all_of_them and set(value) != set(names)):
        raise BadRequest(file, key, value, f"must be an object{told}")
    for name in value:
        if names and name not in names:
            raise BadRequest(file, name, value[name], f"no such key; there are {', '.join(names)}")


def _text(file: str, key: str, value: Any) -> None:
    if not isinstance(value, str) or not value:
        raise BadRequest(file, key, value, "must be a name")


def _finite(file: str, key: str, value: Any) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or abs(value) > 1e300 or not isfinite(value):
        raise BadRequest(file, key, value, "must be a finite number")


_CHECKS: dict[str, Callable[[str, str, Any], None]] = {
    "harmonics": _harmonics,
    "modes_per_harmonic": _whole(1, MAX_MODES),
    "sensitivities": _sensitivities,
    "own_frequency": _own_frequency,
    "cavity": _cavity,
    "sector": _sector,
}
