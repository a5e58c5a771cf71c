"""tyrecal report"""

from __future__ import annotations

from pathlib import Path

import click

from . import options
from .parameters import FileOrFolder, option
from .terminal import Terminal


@click.command()
@click.argument("folders", metavar="DIR...", nargs=-1, required=True, type=FileOrFolder())
@option(
    "--output",
    type=FileOrFolder(),
    metavar="FILE",
    help="HTML file to write (default: report.html in DIR; for several DIRs, in the current"
    " folder).",
)
@option("--title", default="", metavar="WORDS", help="Title (default: names of the cases).")
@option("--author", default="", metavar="NAME", help="Name above the title (default: none).")
@options.with_terminal
def command(
    folders: tuple[Path, ...], output: Path | None, title: str, author: str, terminal: Terminal
) -> int:
    """Show the results in DIR (of fit, modes, sweep-pressure, footprint, sensitivities, effects,
    sample, diagnose) on one HTML page.

    The page is one file that needs no network: key figures, plots, mode shapes that turn and
    vibrate, and tables, each with its numbers as a CSV file inside. It prints on A4 and works on
    a phone. Fits and diagnoses of several folders are shown side by side. Every study also writes
    it with --report.

    \b
    tyrecal report p235_75r17
    tyrecal report narrow_rim wide_rim --output rims.html --author "A. Engineer"
    """
    from ..report.html.page import write_page

    path = output or (folders[0] / "report.html" if len(folders) == 1 else Path("report.html"))
    written = write_page(path, folders, author, title)
    terminal.result({"page": str(path), "bytes": written.size, "found": written.found})
    for folder, studies in written.found.items():
        terminal.say(f"{folder}: {', '.join(studies)}")
    terminal.say(f"report in {path}")
    return 0
