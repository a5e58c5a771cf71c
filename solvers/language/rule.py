"""Records of the keywords, by ABAQUS' manual, and the notation of their tables.

A record has its keywords, levels, notes and parameters, then lines that begin with a word:

    *NAME, OTHER NAME (model part, once a job, under A; B, in CalculiX it has no sets)
        NSET!=+nset; GENERATE; LINE=C|P
      lines 0-2: label 6*number? / node...   number of data lines (1+: one or more), their fields
      if GENERATE, LINE=P: 2*integer         fields with one of these parameters
      names LINE=C: _node, area:area, nu=0   names, units and defaults of the fields; without a
                                             parameter also behind ``as`` in the line of the fields
      deck|section: GENERATE; ~LINE          options that are honoured there, see `PLACES`

Levels: ``model``, ``step``, and ``part``: a part, an instance, the assembly, or a model without
parts. Parameters: ``NAME`` takes no value, ``NAME=ONE|TWO`` these (an empty one: none),
``NAME=kind`` a kind such as a number or node, ``NAME=+kind`` defines a name of that kind, and
``NAME!`` must be given. Fields: kinds, ``3*number`` three of them, ``number?`` may be blank,
``node...`` none or more; behind ``/`` those of the next line, the last for all that follow. A field
whose name begins with _ is no number that may be set. `KeywordRule` explains the other words.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

MANY = 10**9
NEEDED = "!"  # behind a parameter that must be given
QUIET = "~"  # before an option that is honoured as it changes no answer, as a step's name
# where blocks are, with words for messages: in a user's section (deck), or in a section job, a
# revolve job, or a step of either
PLACES = {
    "deck": "the model",
    "section": "the model",
    "revolve": "the model",
    "deck step": "a step",
    "step": "a step",
}
FIRST_LINE = re.compile(r"\*(.+?) \((.+?)\) ?(.*)")
Fields = tuple[str, ...]  # of the first lines, the last for all that follow; () for no lines


class Field(NamedTuple):
    """A data field: its name, the kind of its unit (`fields.DIMENSIONS`, "" for none), its
    default, None without one."""

    name: str
    unit: str = ""
    default: float | None = None


@dataclass(frozen=True)
class KeywordRule:
    """The record of one keyword: the manual's rule, and which jobs honour what of it."""

    level: str
    options: str  # its parameters
    fields: Fields
    rows: tuple[int, int]  # how few and how many data lines
    variants: Mapping[str, str]  # fields by a parameter that changes them
    names: Mapping[str, str]  # of the fields that are honoured, by parameter ("": any or none)
    honoured: Mapping[str, str]  # options by places; a value after = is the only one
    needs: Fields  # groups of parameters, split at |: one must be given
    alone: Fields  # parameters that exclude each other
    under: Fields  # keywords of which it is an option
    after: Fields  # one of these is before it, or in the job that it goes on from
    within: Fields  # procedures of the steps that it belongs to
    once: str  # in the ``job``, the ``step`` or its ``parent``
    is_output: bool  # requests output or sets how to iterate, so that it changes no answer
    is_contact: bool  # about contact, left out of a user's section if the bead is held
    is_judged: bool  # False if its parameters and data are not checked
    instead: str  # what a user may do if it is not honoured
    calculix: str  # why CalculiX has nothing for it

    @cached_property
    def parameters(self) -> dict[str, str]:
        """Permitted values of each parameter: words in capitals, split at |, or a kind."""
        pairs = (option.partition("=") for option in self.options.split("; ") if option)
        return {name.removesuffix(NEEDED): value for name, _, value in pairs}

    @cached_property
    def needed(self) -> Fields:
        """Parameters of which one must be given, in groups that are split at |."""
        names = (option.partition("=")[0] for option in self.options.split("; "))
        return (*(n.removesuffix(NEEDED) for n in names if n.endswith(NEEDED)), *self.needs)

    @cached_property
    def options_at(self) -> dict[str, dict[str, Fields | None]]:
        """Options that are honoured by place, and the values of each, None for any."""
        return {
            place: {
                name.removeprefix(QUIET): tuple(values.split("|")) if equals else self._words(name)
                for name, equals, values in (o.partition("=") for o in text.split("; ") if o)
            }
            for places, text in self.honoured.items()
            for place in places.split("|")
        }

    def _words(self, name: str) -> Fields | None:
        words = self.parameters[name.removeprefix(QUIET)]
        return None if words.islower() else tuple(words.split("|"))

    def forms(self, parameters: Mapping[str, str]) -> Fields:
        """The form of the data lines with these parameters."""
        variant = _variant(self.variants, parameters)
        return self.fields if variant is None else _split(variant, " / ")

    def fields_of(self, parameters: Mapping[str, str]) -> list[Field]:
        """The named data fields with these parameters."""
        return _named_fields(_variant(self.names, parameters) or "")


def read_rules(text: str) -> dict[str, KeywordRule]:
    """The records of a table by keyword."""
    joined = re.sub(r"\n {4,}", " ", text.strip()).replace("| ", "|")
    rules = {}
    for record in re.split(r"\n(?=\*)", joined):
        names, notes, options = FIRST_LINE.findall(record)[0]
        level, *others = notes.split(", ")
        rule = _rule(level, others, options, dict(re.findall(r"\n +(.*?): ?(.*)", record)))
        rules.update(dict.fromkeys(names.split(", "), rule))
    return rules


def _rule(level: str, notes: list[str], options: str, lines: dict[str, str]) -> KeywordRule:
    """A record of its first line and of the others by their words."""

    def given(word: str) -> dict[str, str]:
        """Lines that begin with a word, by what is behind it."""
        own = {key: text for key, text in lines.items() if key.split()[0] == word}
        return {each: own[key] for key in own for each in key[len(word) + 1 :].split(", ")}

    rows, fields = next(iter(given("lines").items()), ("1+", ""))
    fields, _, names = fields.partition(" as ")
    most = MANY if rows.endswith("+") else int(rows[-1])
    noted = lambda word: "".join(n.removeprefix(word) for n in notes if n.startswith(word))
    return KeywordRule(
        level,
        options,
        _split(fields, " / "),
        (int(rows[0]), most),
        given("if"),
        {**given("names"), "": names} if names else given("names"),
        {key: text for key, text in lines.items() if {*key.split("|")} <= PLACES.keys()},
        needs=_split(lines.get("needs", ""), "; "),
        alone=_split(lines.get("alone", ""), "; "),
        under=_split(noted("under "), "; "),
        after=_split(noted("after "), "; "),
        within=_split(noted("within "), "; "),
        once=noted("once a "),
        is_output="output" in notes,
        is_contact="contact" in notes,
        is_judged="not judged" not in notes,
        instead=lines.get("instead", ""),
        calculix=noted("in CalculiX "),
    )


def _split(text: str, at: str) -> Fields:
    return tuple(text.split(at)) if text else ()


def _variant(variants: Mapping[str, str], parameters: Mapping[str, str]) -> str | None:
    """The first variant whose parameter, or parameter=value, is given; "" is given always."""
    given = {"", *parameters, *(f"{key}={value}" for key, value in parameters.items())}
    return next((text for key, text in variants.items() if key in given), None)


@cache
def _named_fields(text: str) -> list[Field]:
    fields = []
    for each in _split(text, ", "):
        name, equals, default = each.partition("=")
        name, _, unit = name.partition(":")
        fields.append(Field(name, unit, float(default) if equals else None))
    return fields
