"""The calibrated tyre as files: its case, or its decks, at the values that a fit found.

`tyrecal export` calls this. A case keeps its user's text, and decks of a user keep theirs: only
numbers change.
`add` writes a new case with effects in it.
"""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..errors import InputError
from ..files import read_bytes, write_text
from ..simulate.deck.decks import Decks
from ..simulate.deck.decks_design import design_of
from ..simulate.evaluate.evaluator import Evaluator
from ..simulate.evaluate.failure import DeckRefused
from ..tyre.case import LoadedCase, as_written, start_values
from ..tyre.case.checks import at, find
from ..tyre.case.edit_text import is_stated, set_in_text
from ..tyre.case.editor import SCHEMA_FILE, case_schema, with_editor_line
from ..tyre.case.identity import is_of_tyre
from ..tyre.case.mistakes import Keys
from ..tyre.load import load_case
from ..tyre.resolve import resolved
from ..tyre.values import with_values

Files = dict[str, bytes]  # content by path relative to the folder of the export


def case_files(case: LoadedCase) -> Files:
    """A case file with the values of a case `as_fitted`, and the files that it names.

    The numbers that variables set and settings of the tyre are written; the state, targets and
    everything else is as in the user's file. Raises InputError, OSError.
    """
    text = _text_of(read_bytes(case.path))[0]
    fitted = with_editor_line(set_in_text(text, _values(case, text)))
    files = {f"{case.path.stem}_fitted{case.path.suffix}": fitted, SCHEMA_FILE: case_schema()}
    named = [*case.files, *case.template_files]
    copies = {path.relative_to(case.folder).as_posix(): read_bytes(path) for path in named}
    return {**copies, **{name: text.encode() for name, text in files.items()}}


def settings_left_out(case: LoadedCase) -> list[str]:
    """Settings (`--set`) of a case `as_fitted` that `case_files` does not write, as they are given:
    those of the state."""
    return [
        f"{name}={as_written(value)}"
        for name, value in case.overrides.items()
        if name not in case.case.variables and not is_of_tyre(name)
    ]


def parts_left_out(case: LoadedCase) -> list[str]:
    """Parts of a tyre that the user's own decks, as `deck_files` has them, do not contain."""
    tyre = resolved(case)
    if not tyre.written.kind.own_texts(tyre):
        return []
    return [words for need, words in tyre.needs.items() if need not in tyre.written.kind.needs]


def deck_files(case: LoadedCase, solver: str = "") -> Files:
    """The decks of a case `as_fitted`: the user's own with numbers changed, or else those that
    tyrecal writes for a solver, by default the case's. Raises InputError, DeckRefused, OSError."""
    tyre = resolved(case)
    own = tyre.written.kind.own_texts(tyre)
    if own:
        (first, *_) = tyre.written.kind.files(case.case, case.folder)
        return {name: _as_before(first.parent / name, text) for name, text in own.items()}
    design = design_of(case, start_values(case))
    evaluator = Evaluator(design, solver)
    evaluator.refuse_lacking(design)
    with TemporaryDirectory() as folder:
        try:
            paths = evaluator.solver.write(Decks(design), Path(folder))
        except evaluator.solver.refusals as error:
            raise DeckRefused(str(error)) from None
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def _values(case: LoadedCase, text: str) -> dict[Keys, Any]:
    """Values by their keys in the file ``text`` of the case."""
    values: dict[Keys, Any] = {}
    for name, start in start_values(case).items():
        values["variables", name, "start"] = start
        for path in case.case.variables[name].sets:
            keys = find(case.case, path)
            if is_stated(text, keys):
                values[keys] = at(case.case, keys)
    for name in case.overrides:
        if name in case.case.variables or not is_of_tyre(name):
            continue
        keys = find(case.case, name)
        if not is_stated(text, keys):  # an entry of a list that is left out needs the whole list
            place = next((i for i, key in enumerate(keys) if isinstance(key, int)), len(keys))
            keys = keys[:place]
        values[keys] = at(case.case, keys)
    level: Keys = ("mesh", "level")
    if is_stated(text, level) and at(case.file_data, level) != case.case.mesh.level:
        values[level] = case.case.mesh.level
    return values


def _as_before(path: Path, text: str) -> bytes:
    """A text in the encoding of the file at ``path``. Raises OSError."""
    _, encoding = _text_of(read_bytes(path))
    return text.encode(encoding)


def _text_of(content: bytes) -> tuple[str, str]:
    """The text of a file and its encoding, as cases and decks are read."""
    encoding = "utf-8-sig" if content.startswith(BOM_UTF8) else "utf-8"
    try:
        return content.decode(encoding), encoding
    except UnicodeDecodeError:
        return content.decode("latin-1"), "latin-1"


def add(path: Path, effects: Mapping[str, float], folder: Path | None = None) -> Path:
    """Write CASE_EFFECTS.yaml next to the case at ``path`` with the effects' parameters, by id.

    Its section and templates are named relative to the case, so it goes beside it, or into
    ``folder`` where that is the same. Raises InputError; ValueError for an unknown effect or a
    parameter that cannot be, OSError.
    """
    loaded = load_case(path, allow_unusual=True)  # of the old case its user was told
    with_values(loaded, {f"effects.{id}": value for id, value in effects.items()})
    target = path.with_name(f"{'_'.join((path.stem, *effects))}{path.suffix}")
    if folder is not None and folder.resolve() != path.parent.resolve():
        raise InputError(
            f"the new case must be next to the old one, in '{target}', not to '{folder}'"
        )
    if target.exists():
        raise InputError(f"'{target}' exists already; move it away first")
    values: dict[Keys, float] = {("effects", id): value for id, value in effects.items()}
    text = with_editor_line(set_in_text(path.read_text(encoding="utf-8-sig"), values))
    write_text(target, text)
    write_text(target.with_name(SCHEMA_FILE), case_schema())
    load_case(target, allow_unusual=True)
    return target
