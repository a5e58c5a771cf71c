"""A case file read and judged: everything that is wrong with it in one go.

Measurements are not read here: `measured.load` does so, for targets in a file.
"""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..errors import InputError
from .case.checks import problems
from .case.deck_file import completed, read_kind
from .case.document import Document, read_document
from .case.kinds.user_decks import lines_of_a_deck
from .case.loaded import LoadedCase
from .case.mistakes import CaseError, Keys, Mistake, dotted
from .case.schema import Case, cannot_fit
from .case.shape import disagreements, explain, table, without
from .case.stations import check_templates, measured_file
from .effects import EffectRefused
from .resolve import resolved
from .state import TyreState
from .usual import unusual

TYRE_KEYS = {"section", "deck", "materials"}  # keys, one of which every case has


def load_case(path: Path | str, allow_unusual: bool = False) -> LoadedCase:
    """Read a case file. Raises CaseError with every mistake in it, numbers among them that no tyre
    has, unless they are allowed."""
    loaded, mistakes = _read(Path(path), allow_unusual)
    if loaded is None:
        raise CaseError(mistakes)
    return loaded


def validate(path: Path | str, allow_unusual: bool = False) -> list[Mistake]:
    """Every mistake in a case file and the files it names, by line; empty when it is right.

    Targets that no fit can use are mistakes here, though other studies do without.
    """
    return judged(path, allow_unusual)[1]


def judged(
    path: Path | str, allow_unusual: bool = False
) -> tuple[LoadedCase | None, list[Mistake]]:
    """The case, None where it is wrong, and the mistakes that `validate` finds."""
    loaded, mistakes = _read(Path(path), allow_unusual)
    if loaded and not loaded.measured and (mistake := unfit_targets(loaded)):
        return None, [mistake]
    return loaded, mistakes


def unfit_targets(loaded: LoadedCase) -> Mistake | None:
    """Why no fit can use the targets of the case, as a mistake in its file; None where one can."""
    weights, variables = loaded.case.targets.weights, loaded.case.variables
    reason = cannot_fit(weights, len(variables)) if weights and variables else None
    if reason is None:
        return None
    document = read_document(loaded.path)
    document.add(("targets",), reason)
    return document.mistakes[0]


def _read(path: Path, allow_unusual: bool) -> tuple[LoadedCase | None, list[Mistake]]:
    """The case without its measurements, None if it is wrong, and its mistakes."""
    document = read_document(path)
    data = document.data
    if data is None:
        return None, document.mistakes
    if not TYRE_KEYS & data.keys():
        how = "'tyrecal init SIZE' or 'tyrecal init --deck FILE.inp'"
        document.refuse(1, f"holds no tyre: write a case with {how}")
        return None, document.mistakes[-1:]
    file_data = deepcopy(data)  # without the deck's numbers, which `read_kind` puts into data
    kind, is_known = read_kind(document, data, path.parent)
    source = table(data, "deck")
    lines = kind.usual_lines(source) if kind else lines_of_a_deck(source)
    completed(data, lines)
    assumed = completed(file_data, lines)
    case = _typed(document, data)
    _add(document, disagreements(data))
    section = kind.read_section(document, data, path.parent) if kind else None
    check_templates(document, data, path.parent)
    measured = measured_file(document, data, path.parent)
    if is_known:  # paths of numbers can be checked, see `read_kind`
        _add(document, problems(data, section))
    meshable = not any(m.key.startswith(("mesh", "section")) for m in document.mistakes)
    if kind and section and meshable and (message := kind.folds(data, section)):
        form = "outline" if data["section"].get("outline") else "stations"
        document.add(("section", form), message)
    if not allow_unusual:
        _add(document, unusual(data, section))
        stated = table(table(file_data, "deck"), "numbers")
        for slip in kind.slips(data) if kind else ():
            if slip.key in stated:
                document.add(("deck", "numbers", slip.key), slip.message)
            else:
                document.mistakes.append(slip)
    if case is None or kind is None or document.mistakes:
        return None, sorted(document.mistakes, key=lambda m: (m.file != str(path), m.line))
    loaded = LoadedCase(
        case, path, section, path.parent, file_data, kind=kind, measured=measured, assumed=assumed
    )
    try:
        resolved(loaded)
    except EffectRefused as error:
        document.add(("effects", error.id), error.reason)
        return None, document.mistakes
    for place, target in enumerate(case.targets.modes):
        try:
            TyreState(target.pressure_kPa, 0.0, target.rim).numbers(loaded)
        except InputError as error:
            document.add(("targets", "modes", place, "rim"), str(error))
    return (None, document.mistakes) if document.mistakes else (loaded, [])


def _typed(document: Document, data: dict[str, Any]) -> Case | None:
    """The case as the schema sees it; else None, its mistakes recorded, and WRONG in ``data``."""
    try:
        return Case.model_validate(data)
    except ValidationError as error:
        mistakes = list(explain(error))
        _add(document, mistakes)
        without(data, [keys for keys, _ in mistakes])
        return None


def _add(document: Document, mistakes: Iterable[tuple[Keys, str]]) -> None:
    """Record mistakes at keys that have none yet."""
    reported = {mistake.key for mistake in document.mistakes}
    for keys, message in mistakes:
        if dotted(keys) not in reported:
            document.add(keys, message)
