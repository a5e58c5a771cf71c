"""What ABAQUS' manual says of a keyword, and how that is written.

Of each: the level it belongs to, its parameters, what it must stand under, come after or have, how
often it may stand, and its data lines.

Levels: ``part`` is a part, an instance, the assembly, or a model that has no parts. Parameters:
``NAME`` takes no value, ``NAME=ONE|TWO`` these (an empty one: none), ``NAME=kind`` a kind, and
``NAME=+kind`` gives a name of it. Fields of a data line: kinds, ``3*number`` three of them,
``number?`` may be blank, ``node...`` none or more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

MANY = 10**9
NO_ROWS, ONE_ROW, ANY_ROWS = (0, 0), (1, 1), (0, MANY)
Fields = str | tuple[str, ...]  # of every line, or of the first lines and then of all others


@dataclass(frozen=True)
class Rule:
    """Of one keyword.

    options: its parameters; needs: of each, split at |, one must be given; alone: those that
    exclude each other; under: keywords of which it is an option; after: of which one must stand
    before it, or in the job that it goes on from; within: procedures of the steps that it belongs
    to; once: in the ``job``, the ``step`` or its ``parent``; rows: how few and how many data lines;
    variants: their fields where a parameter is given that changes them.
    """

    level: str
    options: str = ""
    fields: Fields = ""
    rows: tuple[int, int] = (1, 10**9)
    needs: tuple[str, ...] = ()
    alone: tuple[str, ...] = ()
    under: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    within: tuple[str, ...] = ()
    once: str = ""
    variants: Mapping[str, Fields] = field(default_factory=dict)

    @cached_property
    def parameters(self) -> dict[str, str]:
        """What each may be: words in capitals, split at |, or a kind."""
        pairs = (option.partition("=") for option in self.options.split("; ") if option)
        return {name: value for name, _, value in pairs}
