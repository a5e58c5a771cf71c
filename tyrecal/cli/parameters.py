"""Options and types of all commands, with their messages about wrong and repeated values.

A command declares options by `option`, in place of click's, with the types of this module. Their
errors state a value that works.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ..errors import InputError

# of a number, by its unit, the end of its option or metavar: the unit in words and examples
ENDINGS = {
    "kPa": ("kPa", "240 or 2.4bar"),
    "N": ("N", "4000 or 4kN"),
    "mm": ("mm", "12 or 1.2cm"),
    "in": ("inches", "7.5 or 190mm"),
    "Hz": ("Hz", "250 or 0.25kHz"),
    "g": ("g", "5"),
    "MB": ("MB", "100"),
    "percent": ("percent", "0.3"),
}
UNIT = re.compile(rf"[-_]({'|'.join(ENDINGS)})$")


class Option(click.Option):
    """An option that may not be given twice with different values, unless it is ``multiple``.
    Values of the environment and the settings do not count."""

    def add_to_parser(self, parser: Any, ctx: click.Context) -> None:
        """Have the parser keep every value."""
        multiple, self.multiple = self.multiple, True
        super().add_to_parser(parser, ctx)
        self.multiple = multiple

    def consume_value(
        self, ctx: click.Context, opts: Mapping[str, Any]
    ) -> tuple[Any, ParameterSource]:
        """The value and its source. Raises click.UsageError."""
        values = opts.get(str(self.name))
        if isinstance(values, list) and not self.multiple:
            for other in [] if ctx.resilient_parsing else values[1:]:
                self._refuse_two(ctx, values[0], other)
            opts = {**opts, str(self.name): values[0]}
        return super().consume_value(ctx, opts)

    def _refuse_two(self, ctx: click.Context, one: Any, other: Any) -> None:
        first, second = (self.type_cast_value(ctx, value) for value in (one, other))
        if first == second:
            return
        name, *opposite = [*self.opts[:1], *self.secondary_opts[:1]]
        if opposite:
            raise click.UsageError(f"{name} and {opposite[0]} exclude each other", ctx)
        raise click.UsageError(f"{name} is given twice, as {one} and {other}", ctx)


def split_names(ctx: click.Context, param: click.Parameter, values: Any) -> tuple[str, ...]:
    """The names of a repeatable option; each value may be a list with commas."""
    return tuple(filter(None, (name.strip() for value in values for name in value.split(","))))


option = partial(click.option, cls=Option)
names_option = partial(option, multiple=True, callback=split_names)


class _Answering(click.ParamType):
    """A type whose error states what the value must be."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The value by its type; numbers must be finite. Raises click.UsageError."""
        try:
            converted = super().convert(self.read(value, param), param, ctx)
            if not isinstance(converted, float) or isfinite(converted):
                return converted
        except click.BadParameter:
            pass
        option = f"{param.opts[0]} " if isinstance(param, click.Option) else ""
        raise click.UsageError(f"{option}{value}: {self.answer(value, param)}", ctx)

    def read(self, value: Any, param: click.Parameter | None) -> Any:
        """The value as click's own type reads it."""
        return value

    def answer(self, value: Any, param: click.Parameter | None) -> str:
        """Words that state what to give in place of ``value``."""
        raise NotImplementedError


def unit_of(param: click.Parameter | None) -> str:
    """The unit that an option's name or metavar ends with; "": none."""
    names = [param.opts[0], param.metavar or ""] if param else []
    return next((match[1] for name in names if (match := UNIT.search(name))), "")


class _Number(_Answering):
    what = "a number"

    def read(self, value: Any, param: click.Parameter | None) -> Any:
        """The number in the option's unit, whichever unit it is given with."""
        from ..units import read_number

        if unit := unit_of(param):
            with suppress(InputError):
                return read_number(str(value), unit)
        return value

    def answer(self, value: Any, param: click.Parameter | None) -> str:
        """Unit and range of the answer, with an example."""
        default = param.default if param and type(param.default) in (int, float) else 2
        unit, example = "", f"{default:g}"
        if ending := unit_of(param):
            unit, example = ENDINGS[ending]
        words = self.what + (f" in {unit}" if unit else "")
        low, high = getattr(self, "min", None), getattr(self, "max", None)
        if low is not None:
            is_open = getattr(self, "min_open", False)
            words += f", above {low}" if is_open else f", {low}"
            words += f" to {high}" if high is not None else "" if is_open else " or more"
        return f"must be {words}, as in {example}"


class Number(_Number, click.types.FloatParamType):
    """A number in the unit that its option names; 2.4bar and 36psi for --pressure-kPa, too."""


class NumberWithin(_Number, click.FloatRange):
    """A number within a range."""


class WholeNumber(_Number, click.IntRange):
    """A whole number within a range, as 200000 or 2e5."""

    what = "a whole number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number. Raises click.UsageError."""
        with suppress(ValueError):
            value = int(float(value)) if float(value).is_integer() else value
        return super().convert(value, param, ctx)


class OneOf(_Answering, click.Choice):
    """One of several words."""

    def answer(self, value: Any, param: click.Parameter | None) -> str:
        """The words, and the one that was probably meant."""
        from ..tyre.case.mistakes import suggestion

        names = list(map(str, self.choices))
        words = " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))
        return f"must be {words}{suggestion(str(value), names, '')}"


class FileOrFolder(_Answering, click.Path):
    """A file or a folder; ``exists``: one that is there."""

    def __init__(self, exists: bool = False, file: bool = True, folder: bool = True):
        super().__init__(exists, file_okay=file, dir_okay=folder, path_type=Path)

    def answer(self, value: Any, param: click.Parameter | None) -> str:
        """Why the path is refused, with a similar path that exists."""
        path = Path(value)
        from ..tyre.case.mistakes import nearby

        if not path.exists():
            what = "file" if self.file_okay else "folder"
            return f"there is no such {what}{nearby(path, path.suffix)}"
        if path.is_dir() and not self.dir_okay:
            return "is a folder, must be a file"
        if not path.is_dir() and not self.file_okay:
            return "is a file, must be a folder"
        return "cannot be read"
