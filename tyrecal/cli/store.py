"""tyrecal store"""

from __future__ import annotations

from pathlib import Path

import click

from . import options
from .parameters import FileOrFolder, NumberWithin, option
from .terminal import Terminal, resume


@click.command()
@click.argument(
    "folder", metavar="DIR", type=FileOrFolder(exists=True, file=False), envvar="TYRECAL_STORE"
)
@option("--verify", is_flag=True, help="Check every checksum; set damaged evaluations aside.")
@option(
    "--prune",
    type=NumberWithin(0),
    metavar="SIZE_MB",
    help="Size to keep, MB: the least recently used evaluations are removed.",
)
@options.with_terminal
def command(folder: Path, verify: bool, prune: float | None, terminal: Terminal) -> int:
    """List the evaluation store in DIR, a results folder or a --store of several.

    Removed evaluations are computed again when they are needed.

    \b
    tyrecal store p235_75r17
    tyrecal store p235_75r17 --verify --prune 100
    """
    from ..files import refuse_link
    from ..simulate.evaluate.store import Store

    if verify or prune is not None:
        resume("removed evaluations are computed again when they are needed")
    own = folder / "record"
    refuse_link(own)
    if not own.is_dir() and not any(folder.glob("[0-9a-f][0-9a-f]")):
        below = next((path.parent for path in sorted(folder.glob("*/record"))), None)
        hint = f"; did you mean '{below}'?" if below else ""
        raise click.UsageError(f"'{folder}': there is no evaluation store here{hint}")
    # inf: none of the evaluations is in use by this command, so that all may be removed
    store = Store(own if own.is_dir() else folder, opened=float("inf"))
    removed = None if prune is None else store.prune(round(1e6 * prune))
    summary = store.summary(verify)
    if removed is not None:
        summary["removed"] = removed
    terminal.result(summary)
    if terminal.as_json:
        return 0
    size = summary["bytes"] / 1e6
    records = "1 evaluation" if summary["records"] == 1 else f"{summary['records']} evaluations"
    lines = [f"{summary['folder']}: {records}, {size:.1f} MB"]
    lines += [f"  {solver}: {count}" for solver, count in summary["solvers"].items()]
    if summary["failures"]:
        lines.append(f"  of them failed by their design: {summary['failures']}")
    if removed is not None:
        lines.append(f"  removed: {removed}")
    lines.append(f"  damaged: {summary['damaged']}" + ("" if verify else " (found so far)"))
    terminal.say("\n".join(lines))
    return 0
