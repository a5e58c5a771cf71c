"""tyrecal solvers"""

from __future__ import annotations

from pathlib import Path

import click

from ..files import Json
from . import options
from .parameters import FileOrFolder, OneOf, option
from .terminal import Terminal


@click.command()
@option(
    "--selftest",
    type=OneOf(["abaqus"]),
    help="Solver for which decks with expected frequencies are written, to be run where the"
    " program is installed.",
)
@option("--output", type=FileOrFolder(file=False), help="Folder of the selftest.")
@options.with_terminal
def command(selftest: str | None, output: Path | None, terminal: Terminal) -> int:
    """List the installed solvers: version, abilities, problems, program that each starts, and the
    settings file.

    \b
    tyrecal solvers
    tyrecal fit cases/p235_75r17.yaml --solver bundled
    tyrecal solvers --selftest abaqus --output for_a_colleague
    """
    if selftest:
        from ..simulate.doctor.self_check import write_selftest

        paths = write_selftest(output or Path(f"{selftest}_selftest"))
        terminal.result([str(path) for path in paths])
        terminal.say("\n".join(map(str, paths)) + f"\nrun the commands in '{paths[0]}'")
        return 0
    from ..report.table import shown, solvers_table
    from ..simulate.evaluate.solver import installed

    solvers = installed()
    terminal.result(solvers)
    terminal.show(shown(solvers_table(solvers)))
    if not terminal.as_json:
        for solver in solvers:
            if solver["command"]:
                terminal.say(f"{solver['name']} {command_words(solver)}")
        terminal.say(f"settings: {settings_words(settings_file())}")
    return 0


def settings_file() -> Json:
    """``file`` of the user's settings, or None; ``there``: whether it is; ``problem``, or None."""
    from ..errors import InputError
    from ..simulate.settings import place, settings

    path, problem = place(), None
    try:
        settings()
    except InputError as error:
        problem = str(error)
    there = path is not None and path.exists()
    return {"file": str(path) if path else None, "there": there, "problem": problem}


def settings_words(entry: Json) -> str:
    """The settings file, and its problem if it has one, in words."""
    if entry["file"] is None:
        return "none (TYRECAL_SETTINGS is empty)"
    return entry["problem"] or entry["file"] + ("" if entry["there"] else " (not there)")


def command_words(solver: Json) -> str:
    """The program that a solver of `installed` starts, and where it was set."""
    from ..simulate.program import join_command

    if not solver["command"]:
        return ""
    origin = solver["command_from"]
    whose = "its default" if origin == "default" else f"from {origin}"
    return f"starts '{join_command(solver['command'])}', {whose}"
