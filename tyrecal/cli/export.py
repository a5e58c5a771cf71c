"""tyrecal export"""

from __future__ import annotations

from pathlib import Path

import click

from ..errors import InputError
from . import complete, options
from .parameters import FileOrFolder, OneOf, option
from .terminal import Terminal


@click.command()
@click.argument("folder", metavar="DIR", type=FileOrFolder(exists=True))
@option(
    "--format",
    "form",
    type=OneOf(["case", "deck"]),
    default="case",
    show_default=True,
    help="Files to write: the case file with what it names, or the decks.",
)
@option(
    "--case",
    "case",
    type=FileOrFolder(),
    metavar="CASE",
    shell_complete=complete.cases,
    help="Case of the fit (default: the one in run.json of DIR).",
)
@option("--force", is_flag=True, help="Write over files that exist.")
@option(
    "--output",
    type=FileOrFolder(),
    metavar="FOLDER",
    help="Folder for the files (default: export in DIR).",
)
@options.solver
@options.with_terminal
def command(
    folder: Path,
    form: str,
    case: Path | None,
    force: bool,
    solver: str,
    output: Path | None,
    terminal: Terminal,
) -> int:
    """Write the tyre that the fit in DIR found, to DIR/export or --output.

    A case is written as CASE_fitted.yaml: your text with the fitted values, and the files that it
    names. Decks are those of the case's solver. If the case has your own deck, that is written:
    your text, units and numbering, only the numbers changed. DIR is a folder of results or a
    fit.json.

    \b
    tyrecal export p235_75r17
    tyrecal export p235_75r17 --format deck --solver calculix --output decks
    tyrecal modes p235_75r17/export/p235_75r17_fitted.yaml
    """
    if form == "case" and "--solver" in options.given():
        raise click.UsageError("--solver goes with --format deck")
    from ..files import atomic_write, private_dir, read_json
    from ..measured.load import load_case
    from ..studies.export import case_files, deck_files, parts_left_out, settings_left_out
    from ..studies.fitted import as_fitted, is_good
    from .output import Run

    fit = folder / "fit.json" if folder.is_dir() else folder
    if not fit.is_file():
        raise click.UsageError(f"there is no fit.json in the folder '{folder}'")
    case = case or _case_of(fit)
    loaded = as_fitted(fit, load_case(case, allow_unusual=True))  # its user knows it from the fit
    if not is_good(read_json(fit)):
        terminal.warn(f"the fit in '{fit}' did not converge: its values are not calibrated")
    files = case_files(loaded) if form == "case" else deck_files(loaded, solver)
    target = output or fit.parent / "export"
    for name, content in files.items():
        place = target / name
        if place.exists() and not force and place.read_bytes() != content:
            raise InputError(f"'{place}' exists already; give --force to write over it")
    run = Run(case, target, "export", loaded=loaded)
    paths = []
    for name, content in files.items():
        place = run.folder / name
        for above in reversed(place.relative_to(run.folder).parents[:-1]):
            private_dir(run.folder / above)
        paths.append(str(place))
        with atomic_write(place) as partial:
            partial.write_bytes(content)
    run.finish()
    terminal.result(paths)
    if not terminal.as_json:
        terminal.say("\n".join(paths))
    if form == "case" and (left := settings_left_out(loaded)):
        terminal.note(f"settings of the state are not in the case: {', '.join(left)}")
    if form == "deck" and (left := parts_left_out(loaded)):
        terminal.warn(f"your deck does not contain {' and '.join(left)}: the case adds that")
    return 0


def _case_of(fit: Path) -> Path:
    """The case that run.json next to a fit names. Raises click.UsageError."""
    from ..files import read_runs
    from ..simulate.case_folder import named_case

    path = named_case(read_runs(fit.parent).get("fit", {}), fit.parent)
    if path is None or not path.is_file():
        raise click.UsageError(f"the case of '{fit}' is not at its place: give it by --case CASE")
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
