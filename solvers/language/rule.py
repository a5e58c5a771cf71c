"""Rules of ABAQUS' manual for a keyword, and the notation of the rule tables.

Of each: the level it belongs to, its parameters, what it must stand under, come after or have, how
often it may stand, and its data lines.

Levels: ``model``, ``step``, and ``part``: a part, an instance, the assembly, or a model without
parts. Kinds are number, integer, name, node and their like (`fields`). Parameters:
``NAME`` takes no value, ``NAME=ONE|TWO`` these (an empty one: none), ``NAME=kind`` a kind,
``NAME=+kind`` defines a name of that kind, and ``NAME!`` must be given. Fields of a data line:
kinds, ``3*number`` three of them, ``number?`` may be blank, ``node...`` none or more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import NamedTuple, TypeVar

MANY = 10**9
Choice = TypeVar("Choice")
NEEDED = "!"  # behind a parameter that must be given
QUIET = "~"  # before an option that is honoured as it changes no answer, as a step's name
ONE_ROW, ANY_ROWS = (1, 1), (0, MANY)
Fields = str | tuple[str, ...]  # of every line, or of the first lines and then of all others


class Field(NamedTuple):
    """A data field: its name, the kind of its unit ("" for none), its default."""

    name: str
    unit: str = ""
    default: float | None = None


@dataclass(frozen=True)
class KeywordRule:
    """The record of one keyword: the manual's rule, and which jobs honour what of it."""

    level: str
    options: str = ""  # its parameters
    fields: Fields = ""  # of its data lines; it takes none without them
    rows: tuple[int, int] = (1, MANY)  # how few and how many data lines
    needs: tuple[str, ...] = ()  # groups of parameters, split at |: one must be given
    alone: tuple[str, ...] = ()  # parameters that exclude each other
    under: tuple[str, ...] = ()  # keywords of which it is an option
    # of which one must stand before it, or in the job that it goes on from
    after: tuple[str, ...] = ()
    within: tuple[str, ...] = ()  # procedures of the steps that it belongs to
    once: str = ""  # in the ``job``, the ``step`` or its ``parent``
    # fields where a parameter is given that changes them ("": any or none)
    variants: Mapping[str, Fields] = field(default_factory=dict)
    # by place ("deck", "deck step": a user's section; "section", "revolve", "step": the bundled
    # solver's jobs), the options that are honoured there; a value after = is the only one
    honoured: Mapping[str, str] = field(default_factory=dict)
    # names of the data fields that are honoured, as "E:stress, nu=0", by parameter if they differ;
    # one that begins with _ is no number that may be set
    data: str | Mapping[str, str] = ""
    is_output: bool = False  # requests output or sets how to iterate, so that it changes no answer
    is_contact: bool = False  # about contact, left out of a user's section if the bead is held
    is_judged: bool = True  # False if its parameters and data are not checked
    instead: str = ""  # what a user may do if it is not honoured
    calculix: str = ""  # why CalculiX has nothing for it

    @cached_property
    def parameters(self) -> dict[str, str]:
        """Permitted values of each parameter: words in capitals, split at |, or a kind."""
        pairs = (option.partition("=") for option in self.options.split("; ") if option)
        return {name.removesuffix(NEEDED): value for name, _, value in pairs}

    @cached_property
    def needed(self) -> tuple[str, ...]:
        """Parameters of which one must be given, in groups that are split at |."""
        names = (option.partition("=")[0] for option in self.options.split("; "))
        return (*(n.removesuffix(NEEDED) for n in names if n.endswith(NEEDED)), *self.needs)

    @cached_property
    def options_at(self) -> dict[str, dict[str, tuple[str, ...] | None]]:
        """Options that are honoured by place, and the values of each, None for any."""
        return {
            place: {
                name.removeprefix(QUIET): tuple(values.split("|")) if equals else self._words(name)
                for name, equals, values in (o.partition("=") for o in text.split("; ") if o)
            }
            for places, text in self.honoured.items()
            for place in places.split("|")
        }

    def _words(self, name: str) -> tuple[str, ...] | None:
        words = self.parameters[name.removeprefix(QUIET)]
        return None if words.islower() else tuple(words.split("|"))

    def forms(self, parameters: Mapping[str, str]) -> Fields:
        """The form of the data lines with these parameters."""
        return _variant(self.variants, parameters, self.fields)

    def fields_of(self, parameters: Mapping[str, str]) -> list[Field]:
        """The named data fields with these parameters."""
        if isinstance(self.data, str):
            return _fields(self.data)
        return _fields(_variant(self.data, parameters, ""))


def _variant(
    variants: Mapping[str, Choice], parameters: Mapping[str, str], default: Choice
) -> Choice:
    """The first variant whose parameter, or parameter=value, is given; "" is given always."""
    given = {"", *parameters, *(f"{key}={value}" for key, value in parameters.items())}
    return next((each for key, each in variants.items() if key in given), default)


@cache
def _fields(text: str) -> list[Field]:
    fields = []
    for each in text.split(", ") if text else ():
        name, equals, default = each.partition("=")
        name, _, unit = name.partition(":")
        fields.append(Field(name, unit, float(default) if equals else None))
    return fields
