"""The case of a command that is given no CASE: the last fit of this folder, or its only case."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..files import read_runs

if TYPE_CHECKING:
    from .options import Study

FIT = "fit.json"
OF_A_CASE = {"size", "pressure_kPa", "solver"}  # keys that tell a case from other YAML


def default_case(
    case: Path | None, fitted: Path | None, study: Study
) -> tuple[Path, Path | None, Study]:
    """Case, fit.json to compare with and study: as given, else what lies in this folder, which is
    reported; results go to the fit's folder. Raises click.UsageError where nothing, or too much,
    does."""
    if case is not None:
        return case, fitted, study
    folder = fitted if fitted is None or fitted.is_dir() else fitted.parent
    fits = _fits([folder] if folder else [Path(), *_folders()])
    for _, folder, entry in sorted(fits, key=lambda fit: fit[:2], reverse=True):
        case = _case(entry, folder)
        if case:
            study.terminal.note(f"{case}, with the fit in '{folder}'; another CASE can be given")
            return case, fitted or folder / FIT, replace(study, output=study.output or folder)
        if not fitted:
            study.terminal.note(f"the fit in '{folder}' is left out: its case is not here")
    if fitted:
        raise click.UsageError(f"give the CASE too: the case of '{fitted}' is not here")
    cases = sorted(_cases([Path()]))
    if len(cases) > 1:
        raise click.UsageError(f"give a CASE: there are several here, {_listed(cases)}")
    if not cases:
        raise click.UsageError("give a CASE: this folder has neither a case nor a finished fit")
    study.terminal.note(f"{cases[0]}, the only case here")
    return cases[0], None, study


def _listed(cases: list[Path]) -> str:
    return ", ".join(map(str, cases[:10])) + (" ..." if len(cases) > 10 else "")


def _folders() -> Iterator[Path]:
    for path in Path().iterdir():
        if path.is_dir() and not path.is_symlink():
            yield path


def _fits(folders: list[Path]) -> Iterator[tuple[str, Path, dict[str, Any]]]:
    """Fits that converged: when they were started, their folder, and their entry in run.json."""
    from ..studies.fitted import has_good

    for folder in folders:
        entry = read_runs(folder).get("fit", {}) if (folder / FIT).is_file() else {}
        started = entry.get("started")
        if isinstance(started, str) and has_good(folder / FIT):
            yield started, folder, entry


def _case(entry: dict[str, Any], folder: Path) -> Path | None:
    """The case of a fit: the file that its entry names, else one near by with the fit's tyre, None
    if there is none. Raises click.UsageError where there are several."""
    from ..simulate.case_folder import cases_with_tyre, named_case

    named = named_case(entry, folder)
    if named is None:
        return None
    if named.is_file():
        return _from_here(named)
    places = {each.resolve(): each for each in (named.parent, folder.parent, folder, Path())}
    cases = sorted(cases_with_tyre(entry, _cases(places.values())))
    if len(cases) > 1:
        raise click.UsageError(
            f"give a CASE: several have the tyre of the fit in '{folder}', {_listed(cases)}"
        )
    return _from_here(cases[0]) if cases else None


def _from_here(path: Path) -> Path:
    """``path`` as one would type it in this folder."""
    path = path.absolute()
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def _cases(folders: Iterable[Path]) -> Iterator[Path]:
    """Case files of some folders."""
    from ..tyre.case.document import read_document

    for path in (path for folder in folders if folder.is_dir() for path in folder.iterdir()):
        if path.suffix in (".yaml", ".yml") and path.is_file():
            data = read_document(path).data
            if data and data.keys() >= OF_A_CASE:
                yield path
