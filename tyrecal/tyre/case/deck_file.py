"""The deck that a case names: it must lie in its folder, and be read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..own_deck.numbers import as_known, marked_numbers
from ..own_deck.own_deck import OwnDeck, read_own_deck
from ..own_deck.text import OwnDeckError
from .document import Document
from .mistakes import Mistake, suggestion
from .shape import table
from .stations import inside

if TYPE_CHECKING:
    from ..section.section import Section


def read_deck_of(document: Document, data: dict[str, Any], folder: Path) -> OwnDeck | None:
    """The deck that the case names, all its numbers put into ``data``; None, with the mistakes
    recorded, where it is wrong or there is none."""
    source = table(data, "deck")
    name, units = source.get("file"), source.get("units")
    if not isinstance(name, str) or units not in ("m", "mm"):
        return None
    try:
        path = inside(folder, name)
        if not path.is_file():
            raise ValueError("must be a file, there is none of this name")
        deck = read_own_deck(path, units)
        given = {k: v for k, v in table(source, "numbers").items() if isinstance(v, int | float)}
        for key in given:
            if key not in deck.marks and key not in deck.numbers:
                hint = suggestion(key, [*deck.marks, *deck.numbers], "")
                message = f"is no mark and no number of the deck{hint}"
                document.add(("deck", "numbers", key), message)
                return None
        for variable in table(data, "variables").values():  # a mark's value may be its start
            given |= marked_numbers(deck.marks, given, variable)
        deck.flat(given)
    except OwnDeckError as error:
        place = error.place
        file = str((folder / name).parent / place.file)
        document.mistakes.append(Mistake(file, place.line, "", "", error.message))
    except ValueError as error:
        document.add(("deck", "file"), str(error))
    except OSError as error:
        document.add(("deck", "file"), f"cannot be read: {error.strerror}")
    else:
        source["numbers"] = {**deck.numbers, **given}
        for entry in (*table(data, "variables").values(), *table(data, "uncertainties").values()):
            if isinstance(paths := entry.get("sets") if isinstance(entry, dict) else None, list):
                entry["sets"] = [as_known(path, source["numbers"]) for path in paths]
        return deck
    return None


def section_of(deck: OwnDeck, data: dict[str, Any]) -> Section:
    """The section that a deck draws."""
    from ..own_deck.section_mesh import section

    return section(deck.flat(data["deck"]["numbers"]))
