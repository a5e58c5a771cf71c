"""What a command takes that is given no CASE: the last fit of this folder, or its only case."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..files import read_runs

if TYPE_CHECKING:
    from .options import Study

FIT = "fit.json"
OF_A_CASE = {"section", "materials", "rim"}  # keys that tell a case from other YAML


def taken(case: Path | None, fitted: Path | None, study: Study) -> tuple[Path, Path | None, Study]:
    """Case, fit.json to compare with and study: as given, else what lies in this folder, which is
    said; results go to the fit's folder. Raises click.UsageError where nothing, or too much, does.
    """
    if case is not None:
        return case, fitted, study
    folder = fitted if fitted is None or fitted.is_dir() else fitted.parent
    fits = sorted(_fits([folder] if folder else [Path(), *_folders()]))
    if fits:
        _, case, folder = fits[-1]
        study.terminal.note(f"{case}, with the fit in '{folder}'; another CASE can be given")
        return case, fitted or folder / FIT, replace(study, output=study.output or folder)
    if fitted:
        raise click.UsageError(f"give the CASE too: nothing beside '{fitted}' says what it is of")
    cases = sorted(_cases())
    if len(cases) > 1:
        listed = ", ".join(map(str, cases[:10])) + (" ..." if len(cases) > 10 else "")
        raise click.UsageError(f"give a CASE: there are several here, {listed}")
    if not cases:
        raise click.UsageError("give a CASE: there is neither one here nor a finished fit of one")
    study.terminal.note(f"{cases[0]}, the only case here")
    return cases[0], None, study


def _folders() -> Iterator[Path]:
    for path in Path().iterdir():
        if path.is_dir() and not path.is_symlink():
            yield path


def _fits(folders: list[Path]) -> Iterator[tuple[str, Path, Path]]:
    """Fits that converged: when they were started, their case, and their folder."""
    from ..studies.fitted import has_good

    for folder in folders:
        run = read_runs(folder).get("fit", {}) if (folder / FIT).is_file() else {}
        case, started = run.get("case"), run.get("started")
        if not (isinstance(case, str) and isinstance(started, str)):
            continue
        path = Path(case)
        if path.is_file() and has_good(folder / FIT):
            near = path.is_relative_to(Path.cwd())
            yield started, path.relative_to(Path.cwd()) if near else path, folder


def _cases() -> Iterator[Path]:
    """Case files of this folder."""
    from ..tyre.case.document import read_document

    for path in Path().iterdir():
        if path.suffix in (".yaml", ".yml") and path.is_file():
            data = read_document(path).data
            if data and data.keys() >= OF_A_CASE:
                yield path
