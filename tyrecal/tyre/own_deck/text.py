"""User decks in the common keyword language; what is refused in them is a mistake of the input."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # mypy knows the folder by its own name
    from solvers.language.element_types import NODES_AND_SECTION
    from solvers.language.fields import DIMENSIONS, fields_of, placed_fields
    from solvers.language.honour import check_honoured
    from solvers.language.spelling import named
    from solvers.language.table import CONTACT_KEYWORDS, MATERIAL_OPTIONS, OUTPUT_KEYWORDS, RULES
    from solvers.language.text import (
        MAX_LABEL,
        Block,
        Place,
        Reader,
        Row,
        is_label,
        names_of,
        number_from,
    )
else:
    from tyrecal_solvers.language.element_types import NODES_AND_SECTION
    from tyrecal_solvers.language.fields import DIMENSIONS, fields_of, placed_fields
    from tyrecal_solvers.language.honour import check_honoured
    from tyrecal_solvers.language.spelling import named
    from tyrecal_solvers.language.table import (
        CONTACT_KEYWORDS,
        MATERIAL_OPTIONS,
        OUTPUT_KEYWORDS,
        RULES,
    )
    from tyrecal_solvers.language.text import (
        MAX_LABEL,
        Block,
        Place,
        Reader,
        Row,
        is_label,
        names_of,
        number_from,
    )

from ...errors import InputError

__all__ = [
    "CONTACT_KEYWORDS",
    "DIMENSIONS",
    "MATERIAL_OPTIONS",
    "MAX_LABEL",
    "NODES_AND_SECTION",
    "OUTPUT_KEYWORDS",
    "RULES",
    "Block",
    "OwnDeckError",
    "Place",
    "Row",
    "check_honoured",
    "fields_of",
    "is_label",
    "named",
    "names_of",
    "number_from",
    "placed_fields",
    "read_blocks",
]
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
    reader = Reader(path.parent, OwnPlace, MAX_OWN_BYTES).read(path.name)
    return reader.blocks, reader.texts
