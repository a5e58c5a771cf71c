"""tyrecal report"""

from __future__ import annotations

from pathlib import Path

import click

from . import options
from .parameters import Place, option
from .terminal import Terminal


@click.command()
@click.argument("folders", metavar="DIR...", nargs=-1, required=True, type=Place())
@option(
    "--output",
    type=Place(),
    metavar="FILE",
    help="The page (default: report.html in DIR, of several in the present folder).",
)
@option("--author", default="", metavar="NAME", help="Name under the title (default: none).")
@options.with_terminal
def command(folders: tuple[Path, ...], output: Path | None, author: str, terminal: Terminal) -> int:
    """Tell the results in DIR (of fit, modes, sweep-pressure, footprint, diagnose: whatever is
    found) on one HTML page.

    The page is one file that needs no network: summary, tables, plots, and mode shapes that turn
    and vibrate; it prints, and reads on a telephone. Fits and diagnoses of several folders stand
    side by side. Every study writes it too, with --report.

    \b
    tyrecal report p235_75r17
    tyrecal report narrow_rim wide_rim --output rims.html --author "A. Engineer"
    """
    from ..report.html.page import write_page

    path = output or (folders[0] / "report.html" if len(folders) == 1 else Path("report.html"))
    written = write_page(path, folders, author)
    terminal.result({"page": str(path), "bytes": written.size, "found": written.found})
    for folder, studies in written.found.items():
        terminal.say(f"{folder}: {', '.join(studies)}")
    terminal.say(f"report in {path}")
    return 0
