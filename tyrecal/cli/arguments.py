"""What the words of a command line mean: the case with what was set in it, loads, a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from .terminal import Terminal


def load(
    path: Path,
    mesh_level: str,
    assigned: tuple[str, ...],
    pressure_kPa: float | None,
    terminal: Terminal,
    allow_unusual: bool = False,
) -> Any:
    """The case with its start values, mesh level, assignments and pressure applied.

    Says which numbers of the file do not count. Returns (case, values of the variables). Raises
    CaseError, click.UsageError; both for numbers that no tyre has, too, unless they are allowed.
    """
    from ..tyre.case import as_written, overruled, parse_assignment, start_values, with_level
    from ..tyre.load import CaseError, load_case
    from ..tyre.own_deck.numbers import as_known
    from ..tyre.values import overridden, with_values

    case = load_case(path, allow_unusual)
    try:
        if mesh_level:
            case = with_level(case, mesh_level)
        names = set(case.case.variables)
        pairs = [parse_assignment(text) for text in assigned]
        given = _once(
            [(as_known(name, case.deck_numbers), value) for name, value in pairs], pressure_kPa
        )
        for name, variable in case.case.variables.items():
            for number in set(variable.sets) & set(given):
                raise click.UsageError(
                    f"{number} is set by the variable '{name}'; give --set {name}=VALUE instead"
                )
        for sentence in overruled(case, given):
            terminal.note(sentence)
        case = overridden(case, given)
        values = {**start_values(case), **{k: v for k, v in given.items() if k in names}}
        case = with_values(case, values)
        for name, value in given.items():
            option = f"--set {name}={as_written(value)}"
            if name == "pressure_kPa" and value == pressure_kPa:
                option = f"--pressure-kPa {value:g}"
            refuse_unusual(case, option, name, value, allow_unusual)
        return case, values
    except CaseError:
        raise
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def refuse_unusual(loaded: Any, option: str, name: str, value: float, allowed: bool) -> None:
    """Raises click.UsageError where nobody states such a value of the variable, or number by its
    path, ``name``, unless it is ``allowed``. option: where it is stated."""
    from ..tyre.values import unusual_value

    if not allowed and (message := unusual_value(loaded, name, value)):
        raise click.UsageError(f"{option}: {message}")


def parse_loads(text: str, option: str = "--loads-N", zero: bool = False) -> list[float]:
    """Loads in N; ``zero``: 0 may be the first. Raises click.UsageError."""
    from itertools import pairwise

    from ..tyre.case.schema import LARGEST_LOAD_N, LEAST_LOAD_N

    loads: list[float] = []
    for word in text.split(","):
        try:
            loads.append(float(word))
        except ValueError:
            raise click.UsageError(f"{option}: '{word.strip()}' is not a number") from None
        if not (LEAST_LOAD_N <= loads[-1] <= LARGEST_LOAD_N or (zero and loads == [0.0])):
            raise click.UsageError(
                f"{option} {loads[-1]:g}: must be a finite load above 0, of {LEAST_LOAD_N:g} to"
                f" {LARGEST_LOAD_N:g} N"
            )
    for before, after in pairwise(loads):
        if after <= before:
            raise click.UsageError(f"{option}: {after:g} after {before:g}, loads must rise")
    return loads


def refuse_unusual_loads(loaded: Any, option: str, loads: Sequence[float], allowed: bool) -> None:
    """`refuse_unusual` of loads, N, by the tyre's size and pressure; 0 is no load."""
    for load in loads:
        if load:
            refuse_unusual(loaded, f"{option} {load:g}", "road.loads_N.0", load, allowed)


def parse_pressures(low: float, high: float, steps: int, allowed: bool) -> tuple[float, ...]:
    """Equidistant pressures in kPa, both ends among them; ``allowed``: unusual ones too. Raises
    click.UsageError."""
    from math import isfinite

    from ..tyre.usual import ALL_THE_SAME, USUAL

    for option, value in (("--from-kPa", low), ("--to-kPa", high)):
        if not (isfinite(value) and value > 0):
            raise click.UsageError(f"{option} {value:g}: must be a finite pressure above 0")
        if not allowed and (message := USUAL["pressure_kPa"].refusal(value)):
            raise click.UsageError(f"{option} {value:g}: {message}{ALL_THE_SAME}")
    if low >= high:
        raise click.UsageError(f"--from-kPa {low:g} must be less than --to-kPa {high:g}")
    return tuple(round(low + (high - low) * i / (steps - 1), 9) for i in range(steps))


def fitted_values(path: Path, loaded: Any, terminal: Terminal) -> dict[str, float]:
    """The design of a fit.json, or of the one in a results folder; says how the fit was made
    otherwise. Raises click.UsageError where it is not this case's."""
    from ..errors import InputError
    from ..studies.fitted import read_fitted

    if path.is_dir():
        folder, path = path, path / "fit.json"
        if not path.is_file():
            raise click.UsageError(f"--fitted: there is no fit.json in the folder '{folder}'")
    try:
        values, otherwise = read_fitted(path, loaded)
    except InputError as error:
        raise click.UsageError(f"--fitted: {error}") from None
    for sentence in otherwise:
        terminal.note(f"--fitted: {sentence}")
    return values


def _once(pairs: list[tuple[str, float]], pressure_kPa: float | None) -> dict[str, float]:
    """Assignments by name, none of them twice."""
    if pressure_kPa is not None:
        pairs = [*pairs, ("pressure_kPa", pressure_kPa)]
    given = dict(pairs)
    if len(given) < len(pairs):
        twice = next(name for name in given if sum(n == name for n, _ in pairs) > 1)
        raise click.UsageError(f"{twice} is set twice")
    return given


def starting_at(loaded: Any, values: Mapping[str, float]) -> Any:
    """The case with its variables' start values replaced. Raises click.UsageError."""
    from dataclasses import replace

    variables = {
        name: variable.model_copy(update={"start": values[name]})
        for name, variable in loaded.case.variables.items()
    }
    for name, variable in variables.items():
        if not variable.lower <= variable.start <= variable.upper:
            raise click.UsageError(
                f"--set {name}={variable.start:g}: a fit must start within the bounds"
                f" {variable.lower:g} to {variable.upper:g}"
            )
    return replace(loaded, case=loaded.case.model_copy(update={"variables": variables}))
