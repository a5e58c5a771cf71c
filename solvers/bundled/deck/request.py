"""Requests that a deck cannot express, read from the file JOB.request.json next to it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from math import isfinite, radians
from pathlib import Path
from typing import Any

from ...errors import Refused
from ...language.text import Block, DeckError, read_deck, read_keywords
from . import grammar
from .steps import Tangent

MAX_HARMONIC, MAX_MODES = 999, 999  # harmonic; modes of one
MAX_RESPONSE_LINES = 20_000  # of a response
TREAD_DIRECTIONS = "radial", "tangential", "lateral"  # components of displacements


@dataclass
class Request:
    """Results and settings requested in addition to the deck."""

    harmonics: list[int] | None = None  # None: as many as *FREQUENCY's number of modes takes
    modes_per_harmonic: int = 2
    # variable to [job, line, field, d number / d variable] rows
    sensitivities: dict[str, list[Tangent]] = field(default_factory=dict)
    # rubber with a table of moduli has, in each mode, that of the mode's own frequency, not of
    # PROPERTY EVALUATION
    own_frequency: bool = False
    cavity: dict[str, Any] | None = None  # {"material", "surfaces"} of a gas in closed surfaces
    # {"job", "width_deg"} of a sector about Theta = 0 in which the tyre is that of another section
    # job, of the same mesh
    sector: dict[str, Any] | None = None
    # {"lowest_Hz", "highest_Hz", "lines", "patch_m", "excite", "respond"} of responses to a force
    # on a square patch of the tread, patch_m wide, at "lines" frequencies of equal steps: points
    # are lists [Theta in degrees, direction]; with "modes": N also matrices of the rim's motions
    # and N coordinates of modes
    response: dict[str, Any] | None = None


def read_request(path: Path, jobs: Sequence[str]) -> Request:
    """The side file of ``jobs``, or the plain request where there is none. Raises Refused: key,
    value and what would be right."""
    if not path.exists():
        return Request()
    try:
        _must(path.is_file(), "", None, "is no file")
        return _request(json.loads(read_deck(path)), path.parent, jobs)
    except DeckError:
        raise
    except Refused as error:
        raise Refused(f"{path.name}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise Refused(f"{path.name}: is not JSON: {error}") from None


def _request(content: Any, folder: Path, jobs: Sequence[str]) -> Request:
    """The checked content of a request file. Raises Refused with the key that is wrong."""
    _object("the request", content, [each.name for each in fields(Request)])
    for key, value in content.items():
        if value is not None or key not in ("harmonics", "cavity", "sector", "response"):
            _CHECKS[key](key, value)
    request = Request(**content)
    known = [*jobs, *([request.sector["job"]] if request.sector else [])]
    for variable, rows in request.sensitivities.items():
        for i, row in enumerate(rows):
            if row[0] not in known:
                right = f"must be a job: {' or '.join(known)}"
                _must(False, f"sensitivities.{variable}[{i}][0]", row[0], right)
    if request.sector:
        job = request.sector["job"]
        _must((folder / f"{job}.inp").is_file(), "sector.job", job, "has no deck next to it")
    return request


def read_sector(folder: Path, sector: dict[str, Any]) -> list[Block]:
    """The model blocks of the sector's section job, which by `grammar.check` may have only what is
    honoured in a section. Raises DeckError, OSError."""
    job = sector["job"]
    text = read_deck(folder / f"{job}.inp")
    return grammar.check(read_keywords(text, job), revolve=False)[0]


def response_points(response: Mapping[str, Any]) -> list[list[tuple[float, int]]]:
    """Angle, rad, and component of the points that are excited, and of those that respond."""
    return [
        [(radians(angle), TREAD_DIRECTIONS.index(way)) for angle, way in response[which]]
        for which in ("excite", "respond")
    ]


def _must(holds: object, key: str, value: Any, right: str) -> None:
    if not holds:
        raise Refused(f"{key} is {json.dumps(value):.60}, {right}" if key else right)


def _whole(least: int, most: int | None = None) -> Callable[[str, Any], None]:
    """Checks for a whole number."""
    right = f"must be a whole number from {least}" + ("" if most is None else f" to {most}")

    def check(key: str, value: Any) -> None:
        whole = type(value) is int and value >= least
        _must(whole and (most is None or value <= most), key, value, right)

    return check


def _harmonics(key: str, value: Any) -> None:
    right = "must be a list of harmonics, as in [0, 1, 2], or null"
    _must(isinstance(value, list) and value, key, value, right)
    for i, n in enumerate(value):
        _whole(0, MAX_HARMONIC)(f"{key}[{i}]", n)
        _must(n not in value[:i], f"{key}[{i}]", n, "must be there once")


def _sensitivities(key: str, value: Any) -> None:
    _object(key, value)
    for variable, rows in value.items():
        place = f"{key}.{variable}"
        _must(isinstance(rows, list), place, rows, "must be a list of rows")
        for i, row in enumerate(rows):
            if _plainly_right(row):
                continue
            right = "must be a row [job, line, field, d number / d variable]"
            _must(isinstance(row, list) and len(row) == 4, f"{place}[{i}]", row, right)
            for j, check in enumerate((_text, _whole(1), _whole(0), _finite)):
                check(f"{place}[{i}][{j}]", row[j])


def _plainly_right(row: Any) -> bool:
    """Whether the rows are as every program writes them; nodes that move have thousands."""
    if not (isinstance(row, list) and [type(each) for each in row] == [str, int, int, float]):
        return False
    job, line, place, slope = row
    return bool(job and line >= 1 and place >= 0 and abs(slope) <= 1e300)


def _own_frequency(key: str, value: Any) -> None:
    _must(isinstance(value, bool), key, value, "must be true or false")


def _cavity(key: str, value: Any) -> None:
    _object(key, value, ["material", "surfaces"], all_of_them=True)
    _text(f"{key}.material", value["material"])
    surfaces, right = value["surfaces"], "must be a list of surfaces' names"
    _must(isinstance(surfaces, list) and surfaces, f"{key}.surfaces", surfaces, right)
    for i, name in enumerate(surfaces):
        _text(f"{key}.surfaces[{i}]", name)


def _sector(key: str, value: Any) -> None:
    _object(key, value, ["job", "width_deg"], all_of_them=True)
    job, width = value["job"], value["width_deg"]
    _text(f"{key}.job", job)
    _must(Path(job).name == job, f"{key}.job", job, "must be a job in the same folder")
    _finite(f"{key}.width_deg", width)
    _must(0 < width <= 360, f"{key}.width_deg", width, "must be above 0 and at most 360")


def _response(key: str, value: Any) -> None:
    points = "excite", "respond"
    limits = {"lowest_Hz": (0, 1e4), "highest_Hz": (1, 1e4), "patch_m": (1e-3, 0.5)}
    _object(key, value)
    if "modes" in value:
        _whole(1, MAX_MODES)(f"{key}.modes", value["modes"])
    rest = {name: each for name, each in value.items() if name != "modes"}
    _object(key, rest, [*limits, "lines", *points], all_of_them=True)
    for name, (least, most) in limits.items():
        _finite(f"{key}.{name}", value[name])
        right = f"must be from {least:g} to {most:g}"
        _must(least <= value[name] <= most, f"{key}.{name}", value[name], right)
    lowest, highest = value["lowest_Hz"], value["highest_Hz"]
    _must(lowest < highest, f"{key}.highest_Hz", highest, "must be above lowest_Hz")
    _whole(2, MAX_RESPONSE_LINES)(f"{key}.lines", value["lines"])
    for name in points:
        rows, right = value[name], 'must be a list of points, as in [[0, "radial"]]'
        _must(isinstance(rows, list) and rows, f"{key}.{name}", rows, right)
        for i, row in enumerate(rows):
            place = f"{key}.{name}[{i}]"
            _must(isinstance(row, list) and len(row) == 2, place, row, "must be [angle, direction]")
            _finite(f"{place}[0]", row[0])
            right = f"must be one of {', '.join(TREAD_DIRECTIONS)}"
            _must(row[1] in TREAD_DIRECTIONS, f"{place}[1]", row[1], right)


def _object(key: str, value: Any, names: Sequence[str] = (), all_of_them: bool = False) -> None:
    """Checks for an object, where there are ``names`` with no others."""
    contents = f" with {' and '.join(names)}" if all_of_them else ""
    fits = isinstance(value, dict) and (not all_of_them or set(value) == set(names))
    _must(fits, key, value, f"must be an object{contents}")
    for name in value:
        right = f"no such key; there are {', '.join(names)}"
        _must(not names or name in names, name, value[name], right)


def _text(key: str, value: Any) -> None:
    _must(isinstance(value, str) and value, key, value, "must be a name")


def _finite(key: str, value: Any) -> None:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    fits = number and abs(value) <= 1e300 and isfinite(value)
    _must(fits, key, value, "must be a finite number")


_CHECKS: dict[str, Callable[[str, Any], None]] = {
    "harmonics": _harmonics,
    "modes_per_harmonic": _whole(1, MAX_MODES),
    "sensitivities": _sensitivities,
    "own_frequency": _own_frequency,
    "cavity": _cavity,
    "sector": _sector,
    "response": _response,
}
