"""A new case with effects in it, the old file's comments kept."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ...errors import InputError
from ...files import write_text
from ...tyre.case.edit_text import set_in_text
from ...tyre.case.editor import SCHEMA_FILE, case_schema, with_editor_line
from ...tyre.case.mistakes import Keys
from ...tyre.load import load_case
from ...tyre.values import with_values


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
