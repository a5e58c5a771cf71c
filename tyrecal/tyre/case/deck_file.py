"""The deck that a case names: it must lie in its folder, and be read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..own_deck.numbers import as_known, marked_numbers
from ..own_deck.own_deck import OwnDeck, read_own_deck
from ..own_deck.own_decks import OwnDecks, read_own_decks
from ..own_deck.text import OwnDeckError
from .document import Document
from .mistakes import Mistake, suggestion
from .parts import DeckSource
from .shape import entries, table
from .stations import inside

if TYPE_CHECKING:
    from ..section.section import Section


def read_deck_of(
    document: Document, data: dict[str, Any], folder: Path
) -> OwnDeck | OwnDecks | None:
    """The deck, or the decks in three dimensions, that the case names, all their numbers put into
    ``data``; None, with the mistakes recorded, where they are wrong or there are none."""
    source = table(data, "deck")
    names = entries(source, "decks") or [source.get("file")]
    key = "decks" if entries(source, "decks") else "file"
    if not all(isinstance(name, str) for name in names) or source.get("units") not in ("m", "mm"):
        return None
    try:
        paths = [inside(folder, name) for name in names]
        if missing := [path.name for path in paths if not path.is_file()]:
            named = f"'{missing[0]}' " * (key == "decks")
            raise ValueError(f"{named}must be a file, there is none of this name")
        deck = _read(paths, source) if key == "decks" else read_own_deck(paths[0], source["units"])
        given = {k: v for k, v in table(source, "numbers").items() if isinstance(v, int | float)}
        for name in given:
            if name not in deck.marks and name not in deck.numbers:
                hint = suggestion(name, [*deck.marks, *deck.numbers], "")
                message = f"is no mark and no number of the deck{hint}"
                document.add(("deck", "numbers", name), message)
                return None
        for variable in table(data, "variables").values():  # a mark's value may be its start
            given |= marked_numbers(deck.marks, given, variable)
        if isinstance(deck, OwnDeck):
            deck.flat(given)
        elif deck.crown.rpartition(".")[2] not in deck.node_sets:  # INSTANCE.SET
            hint = suggestion(deck.crown, deck.node_sets)
            document.add(("deck", "crown"), f"is no node set of the decks{hint}")
            return None
        else:
            deck.check(given)
    except OwnDeckError as error:
        place = error.place
        file = str(paths[0].parent / place.file)
        document.mistakes.append(Mistake(file, place.line, "", "", error.message))
    except ValueError as error:
        document.add(("deck", key), str(error))
    except OSError as error:
        document.add(("deck", key), f"cannot be read: {error.strerror}")
    else:
        source["numbers"] = {**deck.numbers, **given}
        for entry in (*table(data, "variables").values(), *table(data, "uncertainties").values()):
            if isinstance(sets := entry.get("sets") if isinstance(entry, dict) else None, list):
                entry["sets"] = [as_known(path, source["numbers"]) for path in sets]
        if isinstance(deck, OwnDecks):  # which say how the rim is held, and what is computed
            data.setdefault("rim", {"reference_point_m": {"r": 0.0, "z": 0.0}})
            data.setdefault("analysis", {})
        return deck
    return None


def _read(paths: Sequence[Path], source: dict[str, Any]) -> OwnDecks:
    crown = source.get("crown", DeckSource.model_fields["crown"].default)
    return read_own_decks(paths, source["units"], crown if isinstance(crown, str) else "")


def section_of(deck: OwnDeck, data: dict[str, Any]) -> Section:
    """The section that a deck draws."""
    from ..own_deck.section_mesh import section

    return section(deck.flat(data["deck"]["numbers"]))
