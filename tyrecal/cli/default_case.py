"""The case of a command without CASE: that of the last fit in this folder, or its only case."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..files import read_runs

if TYPE_CHECKING:
    from .options import Study

CASE_KEYS = {"size", "pressure_kPa", "solver"}  # by which a case differs from other YAML


def default_case(case: Path | None, study: Study) -> tuple[Path, Study]:
    """Case and study: as given if there is a case.

    Else those of the last fit in a folder here that converged and whose case file exists: its
    design is studied, and results go to its folder. Else the only case here. Raises
    click.UsageError."""
    from ..simulate.case_folder import named_case
    from ..studies.fitted import has_good
    from ..tyre.case.document import read_document

    if case is not None:
        return case, study
    fitted = study.fitted
    given = fitted if fitted is None or fitted.is_dir() else fitted.parent
    fits = []
    for folder in [given] if given else [path for path in Path().iterdir() if path.is_dir()]:
        entry = read_runs(folder).get("fit", {}) if has_good(folder / "fit.json") else {}
        file = named_case(entry, folder)
        if file and file.is_file():
            fits.append((str(entry.get("started")), folder, file))
    if fits:
        _, folder, file = max(fits)
        case = file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file
        study.terminal.note(f"{case}, with the fit in '{folder}'; another CASE can be given")
        fitted, output = fitted or folder / "fit.json", study.output or folder
        return case, replace(study, fitted=fitted, output=output)
    if fitted:
        raise click.UsageError(f"give the CASE too: the case of '{fitted}' is not at its place")
    files = [path for path in sorted(Path().glob("*.y*ml")) if path.is_file()]
    cases = [path for path in files if (read_document(path).data or {}).keys() >= CASE_KEYS]
    if len(cases) != 1:
        listed = f"several here: {', '.join(map(str, cases[:10]))}" if cases else "no case here"
        raise click.UsageError(f"give a CASE: there is no fit and {listed}")
    study.terminal.note(f"{cases[0]}, the only case here")
    return cases[0], study
