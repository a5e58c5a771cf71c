"""How a case gives its tyre: by stations, or by decks that must be in its folder.

A mark is a name in braces, {{ NAME }}, in the place of a number of a deck. ``deck.numbers`` gives
the numbers of marks, and may give other values to numbers that the deck states itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from ...errors import InputError
from ..own_deck.numbers import as_known, marked_numbers
from ..own_deck.own_deck import Units, read_own_deck
from ..own_deck.own_decks import read_own_decks
from ..own_deck.text import OwnDeckError
from .document import Document
from .kinds.kind import TyreKind
from .kinds.section_deck import SectionDeck
from .kinds.stations import Stations
from .kinds.user_decks import DecksIn3D, UserDecks
from .mistakes import Mistake, suggestion
from .parts import DeckSource
from .shape import entries, table
from .stations import inside


def read_kind(
    document: Document, data: dict[str, Any], folder: Path
) -> tuple[TyreKind | None, bool]:
    """How the case gives its tyre, and whether paths to its numbers can be checked: those of its
    decks are put into ``data``. None, with the mistakes recorded, if a deck is wrong; False if none
    could be read."""
    source = table(data, "deck")
    if not source:
        return Stations(), True
    names = entries(source, "decks") or [source.get("file")]
    key = "decks" if entries(source, "decks") else "file"
    if not all(isinstance(name, str) for name in names):
        return None, True
    before = len(document.mistakes)
    kind: UserDecks | None = None
    units = source.get("units")
    try:
        paths = [inside(folder, name) for name in names]
        if missing := [path.name for path in paths if not path.is_file()]:
            named = f"'{missing[0]}' " * (key == "decks")
            raise InputError(f"{named}must be a file, there is none of this name")
        first = read_own_deck(paths[0], units if units in ("m", "mm") else None)
        source.setdefault("units", first.units)
        kind = SectionDeck(first) if key == "file" else _in_3d(paths, source, first.units)
        marks, known = kind.own.marks, kind.known_numbers
        numbers = table(source, "numbers")
        given = {k: v for k, v in numbers.items() if isinstance(v, int | float)}
        for name in given:
            if name not in marks and name not in known:
                hint = suggestion(name, [*marks, *known], "")
                message = kind.idle.get(name, f"is no mark and no number of the deck{hint}")
                document.add(("deck", "numbers", name), message)
        for variable in table(data, "variables").values():  # a mark's value may be its start
            given |= marked_numbers(marks, given, variable)
        source["numbers"] = {**known, **given}
        for entry in (*table(data, "variables").values(), *table(data, "uncertainties").values()):
            if isinstance(sets := entry.get("sets") if isinstance(entry, dict) else None, list):
                entry["sets"] = [as_known(path, source["numbers"]) for path in sets]
        lacking = [name for name in marks if name not in given]
        for name in lacking:
            file, line = marks[name].place
            message = f"the mark {name} has no number: give it in deck.numbers"
            mistake = Mistake(str(paths[0].parent / file), line, "", f"{{{{ {name} }}}}", message)
            document.mistakes.append(mistake)
        if not lacking:
            kind.check_case(document, given)
    except OwnDeckError as error:
        place = error.place
        file = str(paths[0].parent / place.file)
        document.mistakes.append(Mistake(file, place.line, "", "", error.message))
    except InputError as error:
        document.add(("deck", key), str(error))
    except OSError as error:
        document.add(("deck", key), f"cannot be read: {error.strerror}")
    return (None if len(document.mistakes) > before else kind), kind is not None


def completed(data: dict[str, Any], lines: Mapping[str, Any]) -> dict[str, Any]:
    """Put the keys of ``lines`` that ``data`` lacks into it. Returns what was put in."""
    lacking: dict[str, Any] = {}
    for key, value in lines.items():
        if key not in data:
            data[key] = deepcopy(value)
            lacking[key] = value
        elif isinstance(value, dict) and isinstance(data[key], dict):
            lacking[key] = {k: deepcopy(v) for k, v in value.items() if k not in data[key]}
            data[key].update(lacking[key])
    return {key: value for key, value in lacking.items() if value != {}}


def _in_3d(paths: Sequence[Path], source: dict[str, Any], units: Units) -> DecksIn3D:
    """Decks in three dimensions; ``deck.crown`` names the node set of the crown."""
    crown = source.get("crown", DeckSource.model_fields["crown"].default)
    return DecksIn3D(read_own_decks(paths, units, crown if isinstance(crown, str) else ""))
