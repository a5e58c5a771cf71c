"""Meaning of the words of a command line: the case with its settings, loads, a fit."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .terminal import Terminal

if TYPE_CHECKING:
    from ..studies.pressure_range import PressureRange
    from ..tyre.case.parts import Setting


def load(
    path: Path,
    mesh_level: str,
    assigned: tuple[str, ...],
    pressure_kPa: float | None,
    terminal: Terminal,
    allow_unusual: bool = False,
) -> Any:
    """The case with its start values, mesh level, assignments and pressure applied.

    Prints notes on numbers of the file that other values replace. Returns (case, values of the
    variables). Raises InputError, click.UsageError, also for unusual numbers that are not allowed.
    """
    from ..measured.load import load_case
    from ..tyre.case import as_written, overruled, start_values, with_level
    from ..tyre.values import overridden, with_values

    case = load_case(path, allow_unusual)
    if mesh_level:
        case = with_level(case, mesh_level)
    given = _given(case, assigned, pressure_kPa)
    for sentence in overruled(case, given):
        terminal.note(sentence)
    changed = overridden(case, given)
    replaced = _replaced(case, assigned)
    case = changed
    values = start_values(case)
    case = with_values(case, values)
    for name, value in given.items():
        option = f"--set {name}={as_written(value)}"
        if name == "pressure_kPa" and value == pressure_kPa:
            option = f"--pressure-kPa {value:g}"
        refuse_unusual(case, option, name, value, allow_unusual)
    for sentence in replaced:
        terminal.note(sentence)
    return case, values


def refuse_unusual(loaded: Any, option: str, name: str, value: Setting, allowed: bool) -> None:
    """Raises click.UsageError if the value of ``name``, a variable or path, is unusual and not
    ``allowed``. option: the option that gives it, for the message."""
    from ..tyre.values import unusual_value

    if not allowed and (message := unusual_value(loaded, name, value)):
        raise click.UsageError(f"{option}: {message}")


LIST_EXAMPLES = {"N": "3000,5000 or 3kN,5kN", "kPa": "160,240 or 1.6bar,2.4bar", "Hz": "20,200"}


def parse_numbers(option: str, text: str, unit: str = "", count: int = 0) -> list[float]:
    """Numbers in ``unit``, each of which may be written with another one, separated by commas; so
    many of them (0: any). Raises click.UsageError."""
    from ..errors import InputError
    from ..units import number_words, read_number

    words = text.split(",")
    try:
        if count in (0, len(words)):
            return [read_number(word, unit) for word in words]
    except InputError:
        pass
    right = number_words(unit)
    if count != 1:
        what = f"{count or ''} numbers in {unit}".removesuffix(" in ").strip()
        right = f"{what}, as in {LIST_EXAMPLES.get(unit, '0,0,0.1')}"
    raise click.UsageError(f"{option} {text}: must be {right}")


def parse_loads(text: str, option: str = "--loads-N", zero: bool = False) -> list[float]:
    """Rising loads, N. zero: the first may be 0. Raises click.UsageError."""
    return checked_loads(parse_numbers(option, text, "N"), option, zero)


def checked_loads(loads: list[float], option: str, zero: bool = False) -> list[float]:
    """The loads, N, if they rise and each is possible. Raises click.UsageError."""
    from itertools import pairwise

    from ..tyre.case.schema import MAX_CASE_LOAD_N, MIN_CASE_LOAD_N

    for place, load in enumerate(loads):
        if not (MIN_CASE_LOAD_N <= load <= MAX_CASE_LOAD_N or (zero and load == place == 0)):
            raise click.UsageError(
                f"{option} {load:g}: must be a load above 0, of {MIN_CASE_LOAD_N:g} to"
                f" {MAX_CASE_LOAD_N:g} N"
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


def one_load(loaded: Any, load_N: float | None, allowed: bool) -> float:
    """The load of --load-N, N; 0: none was given. Raises click.UsageError."""
    if load_N is None:
        return 0.0
    loads = checked_loads([load_N], "--load-N")
    refuse_unusual_loads(loaded, "--load-N", loads, allowed)
    return loads[0]


def checked_pressures(pressures: PressureRange, allowed: bool) -> PressureRange:
    """The range of a sweep; ``allowed``: unusual ends too. Raises click.UsageError."""
    from math import isfinite

    from ..tyre.usual import ALL_THE_SAME, USUAL

    low, high = pressures.low, pressures.high
    for option, value in (("--from-kPa", low), ("--to-kPa", high)):
        if value is None:
            continue
        if not (isfinite(value) and value > 0):
            raise click.UsageError(f"{option} {value:g}: must be a finite pressure above 0")
        if not allowed and (message := USUAL["pressure_kPa"].refusal(value)):
            raise click.UsageError(f"{option} {value:g}: {message}{ALL_THE_SAME}")
    if low is not None and high is not None and low >= high:
        raise click.UsageError(f"--from-kPa {low:g} must be less than --to-kPa {high:g}")
    return pressures


def parse_pressure_list(flag: str, loaded: Any, text: str, allowed: bool) -> list[float]:
    """The pressures of an option, kPa; ``allowed``: unusual ones too. Raises click.UsageError."""
    pressures = parse_numbers(flag, text, "kPa")
    for pressure in pressures:
        if not 0 < pressure < 2000 or pressures.count(pressure) > 1:
            raise click.UsageError(
                f"{flag} {pressure:g}: must be pressures between 0 and 2000, each once"
            )
        refuse_unusual(loaded, f"{flag} {pressure:g}", "pressure_kPa", pressure, allowed)
    return pressures


def fitted_values(path: Path, loaded: Any, terminal: Terminal) -> dict[str, float]:
    """Values by variable of the fit in ``path``, a fit.json or its folder. Prints a note if the fit
    had another mesh. Raises click.UsageError if the fit is of another tyre."""
    from ..errors import InputError
    from ..studies.fitted import read_fitted

    if path.is_dir():
        folder, path = path, path / "fit.json"
        if not path.is_file():
            raise click.UsageError(f"--fitted: there is no fit.json in the folder '{folder}'")
    try:
        values, differences = read_fitted(path, loaded)
    except InputError as error:
        raise click.UsageError(f"--fitted: {error}") from None
    for sentence in differences:
        terminal.note(f"--fitted: {sentence}")
    return values


def one_design(
    fitted: Path | None, loaded: Any, assigned: Sequence[str], terminal: Terminal
) -> tuple[Any, dict[str, float]]:
    """The case and the values of its variables for a command that evaluates one design: the fitted
    one if ``fitted`` is given, else the start. Raises click.UsageError if both ``fitted`` and --set
    give a variable."""
    from ..tyre.case import start_values
    from ..tyre.values import overridden

    if fitted is None:
        return loaded, start_values(loaded)
    for text in assigned:
        name = text.partition("=")[0].strip()
        if name in loaded.case.variables:
            raise click.UsageError(f"--set {name}: the design is that of --fitted")
    values = fitted_values(fitted, loaded, terminal)
    return overridden(loaded, values), values


def _given(loaded: Any, assigned: Sequence[str], pressure_kPa: float | None) -> dict[str, Setting]:
    """Values by variable or path that --set and --pressure-kPa give, each number once.

    Raises ValueError; click.UsageError if one number gets two values.
    """
    from ..tyre.case import parse_setting
    from ..tyre.own_deck.numbers import as_known
    from ..tyre.values import paths_of, unit_named

    for text in assigned:
        _refuse_text(loaded, text)
    options: list[tuple[str, str, Setting]] = []
    unit_of = partial(unit_named, loaded)
    options += [(f"--set {text}", *parse_setting(text, unit_of)) for text in assigned]
    if pressure_kPa is not None:
        options.append((f"--pressure-kPa {pressure_kPa:g}", "pressure_kPa", pressure_kPa))
    given: dict[str, Setting] = {}
    first: dict[str, tuple[str, Setting]] = {}  # option and value that set a path first
    for option, name, value in options:
        paths = paths_of(loaded, name)
        known = [first[path] for path in paths if path in first]
        for other, before in known:
            if before != value:
                raise click.UsageError(f"{other} and {option}: two values for one number")
        first |= dict.fromkeys(paths, (option, value))
        if name in loaded.case.variables:
            given = {n: x for n, x in given.items() if n not in paths} | {name: value}
        elif not known:
            given[as_known(name, loaded.deck_numbers)] = value
    return given


def _refuse_text(loaded: Any, text: str) -> None:
    """Raises click.UsageError if an assignment is to a text of the case, such as a file name."""
    from ..tyre.case.document import read_document
    from ..tyre.case.mistakes import dotted
    from ..tyre.values import is_choice, paths_of, value_at

    name = text.partition("=")[0].strip()
    for path in paths_of(loaded, name) if "." in name else ():
        word = value_at(loaded, path)
        if isinstance(word, str) and not is_choice(tuple(path.split("."))):
            places = {dotted(k): line for k, (line, _) in read_document(loaded.path).places.items()}
            line = f"line {places[path]} of " if path in places else ""
            raise click.UsageError(
                f"--set {text}: {path} is text, '{word}'; --set takes numbers, true, false, null"
                f" and words that the schema lists: edit {line}{loaded.path}"
            )


def _replaced(loaded: Any, assigned: Sequence[str]) -> list[str]:
    """A line for each number that --set replaces: its path, the case's value and the one used."""
    from ..tyre.case import as_written, parse_setting, start_values
    from ..tyre.values import paths_of, unit_named, value_at

    lines = []
    for text in assigned:
        name, value = parse_setting(text, partial(unit_named, loaded))
        paths = paths_of(loaded, name)
        if name in loaded.case.variables:
            before, what = start_values(loaded)[name], f"{name} ({', '.join(paths)})"
        else:
            before, what = value_at(loaded, paths[0]), paths[0]
        lines.append(f"--set: {what} is {as_written(before)} in the case, {as_written(value)} here")
    return list(dict.fromkeys(lines))


def refuse_set(assigned: Sequence[str], path: str, options: str) -> None:
    """Raises click.UsageError if --set gives the number, or a number of the list, at ``path``,
    which ``options`` give. path: or name of a variable."""
    for text in assigned:
        name = text.partition("=")[0].strip()
        if name == path or name.startswith(f"{path}."):
            raise click.UsageError(f"--set {text}: {options} give that here")


def refuse_unknown(option: str, name: str, known: Collection[str], what: str) -> None:
    """Raises click.UsageError, with the most similar name, if ``name`` is not in ``known``."""
    from ..tyre.case.mistakes import suggestion

    if name not in known:
        raise click.UsageError(f"{option} {name}: there is no such {what}{suggestion(name, known)}")
