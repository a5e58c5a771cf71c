"""tyrecal report"""

from __future__ import annotations

from pathlib import Path

import click

from . import options


@click.command()
@click.argument("folders", metavar="DIR...", nargs=-1, required=True,
                type=click.Path(path_type=Path))  # fmt: skip
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="The page (default: report.html in DIR, of several in the present folder).",
)
@options.every(options.as_json, options.quiet)
def command(folders: tuple[Path, ...], output: Path | None, as_json: bool, quiet: bool) -> int:
    """Tell the results in DIR (of fit, modes, sweep-pressure, footprint, diagnose: whatever is
    found) on one HTML page.

    The page is one file that needs no network: summary, tables, plots, and mode shapes that turn
    and vibrate; it prints, and reads on a telephone. Every study writes it too, with --report.

    \b
    tyrecal report p235_75r17
    tyrecal report narrow_rim wide_rim --output rims.html
    """
    from ..report.html.page import write_page
    from .output import print_json, say

    path = output or (folders[0] / "report.html" if len(folders) == 1 else Path("report.html"))
    written = write_page(path, folders)
    if as_json:
        print_json({"page": str(path), "bytes": written.size, "found": written.found})
    for folder, found in written.found.items():
        say(f"{folder}: {', '.join(found)}", as_json, quiet)
    say(f"report in {path}", as_json, quiet)
    return 0
