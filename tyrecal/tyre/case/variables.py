"""Design variables: names for numbers of the case, and where these stand."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from math import isfinite

from .checks import at, find
from .loaded import LoadedCase

SWITCHES = {"true": True, "false": False}  # as a case file writes them


def start_values(loaded: LoadedCase) -> dict[str, float]:
    """The start value of every variable by name, in the unit of the numbers it sets: its user's,
    else the case file's."""
    variables = loaded.case.variables
    return {name: loaded.overrides.get(name, v.start) for name, v in variables.items()}


def overruled(loaded: LoadedCase, given: Collection[str] = ()) -> list[str]:
    """A sentence for every number in the case file that its variable's start, which is what
    counts, differs from: who edits that number alone changes nothing. Variables whose values are
    ``given`` are left out."""
    sentences = []
    for name, variable in loaded.case.variables.items():
        for path in [] if name in given else variable.sets:
            try:
                written = at(loaded.file_data, find(loaded.file_data, path))
            except KeyError:  # left to its default
                continue
            if written is not None and written != variable.start:
                sentences.append(
                    f"{path} is {written:g} in the case, but does not count: its variable '{name}'"
                    f" starts at {variable.start:g}"
                )
    return sentences


def parse_assignment(text: str) -> tuple[str, float]:
    """``NAME=VALUE`` as name and number; true and false, too. Raises ValueError."""
    name, equals, value = text.partition("=")
    name = name.strip()
    if not equals or not name:
        raise ValueError(f"'{text}' must be NAME=VALUE, as in C10=1.2e6")
    if value.strip() in SWITCHES:
        return name, SWITCHES[value.strip()]
    try:
        number = float(value)
    except ValueError:
        raise ValueError(f"{name} is '{value.strip()}', must be a number") from None
    if not isfinite(number):
        raise ValueError(f"{name} is '{value.strip()}', must be a finite number")
    return name, number


def as_written(value: float | None) -> str:
    """A number, true, false or null, as a case file writes it."""
    if value is None:
        return "null"
    return str(value).lower() if isinstance(value, bool) else f"{value:g}"


def with_level(loaded: LoadedCase, level: str) -> LoadedCase:
    """The case at another of its mesh levels. Raises ValueError where it has none of this name."""
    mesh = loaded.case.mesh
    if level not in mesh.levels:
        raise ValueError(f"mesh level '{level}' is not one of the case's: {', '.join(mesh.levels)}")
    case = loaded.case.model_copy(update={"mesh": mesh.model_copy(update={"level": level})})
    read = loaded.as_read and with_level(loaded.as_read, level)
    return replace(loaded, case=case, as_read=read)


def number_at(loaded: LoadedCase, path: str) -> float:
    """The number at a dotted path of the case. Raises ValueError."""
    try:
        keys = find(loaded.case, path)
    except KeyError as error:
        raise ValueError(f"{path}: {error.args[0]}") from None
    value = at(loaded.case, keys)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{path} is not a number")
    return value
