"""User decks in the common keyword language; what is refused in them is a mistake of the input."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # mypy knows the folder by its own name
    from solvers.language import element_types, fields, honour, spelling, table
    from solvers.language import text as language
else:
    from tyrecal_solvers.language import element_types, fields, honour, spelling, table
    from tyrecal_solvers.language import text as language

from ...errors import InputError

__all__ = ["element_types", "fields", "language", "table"]
Block = language.Block
Place = language.Place
Row = language.Row
is_label, names_of, number_from = language.is_label, language.names_of, language.number_from
check_honoured, split_steps = honour.check_honoured, honour.split_steps
named = spelling.named  # a name as ABAQUS compares it: in capitals
MAX_OWN_BYTES = 50_000_000  # of a deck and all that it includes


class OwnPlace(Place):
    """A line (from 1) of a file, by its name relative to the deck's folder."""

    __slots__ = ()

    def error(self, message: str) -> OwnDeckError:
        """The error to raise for what stands here."""
        return OwnDeckError(self, message)


class OwnDeckError(InputError):
    """A deck that is refused: the sentence begins with file, line and keyword."""

    def __init__(self, place: Place, message: str):
        super().__init__(f"{place}: {message}")
        self.place, self.message = place, message

    def __reduce__(self) -> tuple[type[OwnDeckError], tuple[Place, str]]:
        """For another process."""
        return OwnDeckError, (self.place, self.message)


def read_blocks(path: Path) -> tuple[list[Block], dict[str, str]]:
    """The blocks of a deck, and the texts of its files by name. Raises OwnDeckError, OSError."""
    reader = language.Reader(path.parent, OwnPlace, MAX_OWN_BYTES).read(path.name)
    return reader.blocks, reader.texts
