"""Design variables: names for numbers of the case, and where these stand."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import replace
from math import isfinite

from ...errors import InputError
from ...units import read_number
from .checks import at, find
from .loaded import LoadedCase
from .parts import Setting, as_written

CONSTANTS = {"true": True, "false": False, "null": None}  # as a case file writes them
WORD = re.compile(r"[A-Za-z]\w*")


def start_values(loaded: LoadedCase) -> dict[str, float]:
    """The start value of every variable by name, in the unit of the numbers it sets: the value that
    the user gave for this run, else that of the case file."""
    variables = loaded.case.variables
    given = {name: x for name, x in loaded.overrides.items() if isinstance(x, int | float)}
    return {name: given.get(name, v.start) for name, v in variables.items()}


def overruled(loaded: LoadedCase, given: Collection[str] = ()) -> list[str]:
    """A sentence for every number in the case file that differs from the start of its variable: the
    start counts, so editing that number alone changes nothing. Variables in ``given``, names whose
    values the user gave, are left out."""
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


def parse_assignment(
    text: str, unit_of: Callable[[str], str] = lambda name: ""
) -> tuple[str, float]:
    """``NAME=VALUE`` as name and number. Raises InputError."""
    name, value = parse_setting(text, unit_of)
    if value is None or isinstance(value, str):
        raise InputError(f"{name} is '{as_written(value)}', must be a number")
    return name, value


def parse_setting(
    text: str, unit_of: Callable[[str], str] = lambda name: ""
) -> tuple[str, Setting]:
    """``NAME=VALUE`` as name and number, true, false, null or a word; unit_of: the unit of a name's
    number, which may be written with another. Raises InputError."""
    name, equals, value = text.partition("=")
    name = name.strip()
    if not equals or not name:
        raise InputError(f"'{text}' must be NAME=VALUE, as in C10=1.2e6")
    if value.strip() in CONSTANTS:
        return name, CONSTANTS[value.strip()]
    try:
        number = float(value)
    except ValueError:
        if WORD.fullmatch(value.strip()):
            return name, value.strip()
        try:
            number = read_number(value, unit_of(name))
        except InputError as error:
            raise InputError(f"{name} is '{value.strip()}': {error}") from None
    if not isfinite(number):
        raise InputError(f"{name} is '{value.strip()}', must be a finite number")
    return name, number


def with_level(loaded: LoadedCase, level: str) -> LoadedCase:
    """The case at another of its mesh levels. Raises InputError where it has none of this name."""
    mesh = loaded.case.mesh
    if level not in mesh.levels:
        raise InputError(f"mesh level '{level}' is not one of the case's: {', '.join(mesh.levels)}")
    case = loaded.case.model_copy(update={"mesh": mesh.model_copy(update={"level": level})})
    # `as_read`: the case before any number was set, or None
    read = loaded.as_read and with_level(loaded.as_read, level)
    return replace(loaded, case=case, as_read=read)


def number_at(loaded: LoadedCase, path: str) -> float:
    """The number at a dotted path of the case. Raises InputError."""
    try:
        keys = find(loaded.case, path)
    except KeyError as error:
        raise InputError(f"{path}: {error.args[0]}") from None
    value = at(loaded.case, keys)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{path} is not a number")
    return value
