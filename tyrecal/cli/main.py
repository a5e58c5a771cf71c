"""Entry point: finds the command, and turns every failure into one sentence and an exit code."""

from __future__ import annotations

import os
import re
import signal
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

import click

from ..errors import InputError, TyrecalError
from ..files import CHANGED, os_words
from ..interrupt import SIGNALS, exit_code, pending_interrupt, remember_interrupts
from ..studies import STUDIES
from ..version import BUILD_SITE, SITE
from .terminal import RESUME, coloured, error, say

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

# One BLAS thread: the tyre's matrices are small, and cores are better spent on other designs.
# Has to be set before NumPy is imported.
for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

COMMANDS = {  # name: one line of help, so that the overview imports no command
    "init": "Write the case of a radial tyre, from its size code or its section.",
    "validate": "Check a case file and report every mistake.",
    "deck": "Write the decks of a case, to read or to run elsewhere.",
    **{name: entry.help for name, entry in STUDIES.items() if entry.help},
    "measured": "Turn modal tables, mode shapes and response functions into measurements.",
    "blind": "Test the diagnosis on synthetic data with a hidden effect.",
    "export": "Write the calibrated tyre as files: its case, or its decks.",
    "report": "Show the results of one or several folders on one HTML page.",
    "batch": "Study many cases at once, compare with a baseline, report to CI.",
    "solvers": "List the installed solvers and what they can do.",
    "store": "List, check or prune an evaluation store.",
    "doctor": "Check the installation: packages, solvers, machine, a known tyre.",
    "completion": "Print a script for shell completion of commands, cases and names.",
}
# messages of the system if a library cannot be loaded for lack of memory
NOT_LOADED = "failed to map segment|cannot allocate memory|Cannot allocate memory"
NO_MEMORY = "there is not enough memory: use fewer --jobs, a coarser --mesh or another machine"
EXIT_INPUT, EXIT_SOLVER, EXIT_FIT, EXIT_BATCH = 2, 3, 4, 5
EXIT_CODES = {
    0: "done",
    EXIT_INPUT: "the input is wrong, or a file cannot be read or written",
    EXIT_SOLVER: "the solver failed",
    EXIT_FIT: "the fit did not converge or did not move, or a sample is in doubt",
    EXIT_BATCH: "some cases of a batch failed or drifted",
    130: "interrupted (Ctrl-C)",
    143: "terminated (SIGTERM)",
    129: "hung up (SIGHUP)",
}


class Interrupted(TyrecalError):
    """A signal ended the command; the text states which, and how to continue."""

    def __init__(self, how_to_go_on: str = ""):
        number = pending_interrupt() or signal.SIGINT
        super().__init__(": ".join(filter(None, (SIGNALS[number], how_to_go_on))))
        self.exit_code = exit_code(number)


def _outside() -> dict[str, EntryPoint]:
    """Commands of installed packages other than tyrecal: see `tyrecal.studies`."""
    from importlib.metadata import entry_points

    return {entry.name: entry for entry in entry_points(group="tyrecal.commands")}


def _load(entry: EntryPoint) -> click.Command:
    """The command of an installed package. Raises InputError."""
    from ..tyre.plugins import load_plugin

    command: click.Command = load_plugin(entry, "command")
    return command


def _outside_commands() -> dict[str, click.Command]:
    """The commands of installed packages. One that cannot be loaded is reported and left out."""
    commands = {}
    for name, entry in _outside().items():
        try:
            commands[name] = _load(entry)
        except InputError as broken:
            error(str(broken))
    return commands


class Commands(click.Group):
    """The commands, each imported when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [*COMMANDS, *_outside_commands()]

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            entry = _outside().get(name)
            return _load(entry) if entry else None
        command: click.Command = import_module(f"tyrecal.cli.{name.replace('-', '_')}").command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] == "help":  # `tyrecal help fit`, as `git help`, is `tyrecal fit --help`
            args = [*args[1:2], "--help"]
            if len(args) == 1:
                click.echo(ctx.get_help())
                ctx.exit()
        if args[0] not in COMMANDS and args[0][:1] != "-" and args[0] not in _outside():
            raise click.UsageError(f"no command '{args[0]}'{_meant(args[0])}", ctx)
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        CHANGED.clear()
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, Exception) as error:
            if isinstance(error, click.exceptions.Exit) or not (
                isinstance(error, KeyboardInterrupt) or pending_interrupt()
            ):
                raise
        # outside of "except", so that the error and what it holds are released, processes too
        changed = "no file is half written; run the same command again to write them all"
        raise Interrupted(
            ctx.meta.get(RESUME, changed if CHANGED.is_set() else "nothing was changed")
        )

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            outside = {
                name: each.get_short_help_str(90) for name, each in _outside_commands().items()
            }
            formatter.write_dl(list({**COMMANDS, **outside}.items()))

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Exit codes"):
            formatter.write_dl([(str(code), words) for code, words in EXIT_CODES.items()])
        with formatter.section("Documentation"):
            formatter.write_text(SITE or f"in a clone with pip install -e '.[docs]': {BUILD_SITE}")


def _meant(name: str) -> str:
    """Hint at the command that a misspelt name stands for; else the list of all."""
    from ..tyre.case.mistakes import suggestion

    begun = [command for command in COMMANDS if command.startswith(name.lower())]
    parts = [command for command in COMMANDS if name.lower() in command.split("-")]
    for likely in (begun, parts):
        if len(likely) == 1:
            return f"; did you mean '{likely[0]}'?"
    return suggestion(name.lower(), COMMANDS)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="tyrecal", prog_name="tyrecal")
@click.pass_context
def cli(ctx: click.Context) -> None:
    """Calibrate a tyre finite element model to measured modes.

    \b
    tyrecal validate cases/p235_75r17.yaml
    tyrecal modes cases/p235_75r17.yaml --pressure-kPa 200
    tyrecal fit cases/p235_75r17.yaml

    Every command has --help with examples, --json, --quiet and --verbose. Numbers may have a unit:
    --pressure-kPa 2.4bar, --loads-N 4kN, --set A_belt=0.26mm2. Studies have --dry-run.
    """
    ctx.color = coloured()
    ctx.default_map = _defaults(ctx.invoked_subcommand)


def _defaults(command: str | None) -> dict[str, Any]:
    """Defaults of options by the user's settings. Raises InputError, except for commands that check
    the installation."""
    from ..simulate.settings import settings

    try:
        chosen = settings()
    except InputError:
        if command in ("doctor", "solvers"):
            return {}
        raise
    given = {k: v for k in ("jobs", "solver") if (v := getattr(chosen, k)) is not None}
    parts = {part: given for part in ("make", "answer")}  # of blind
    return {name: {**given, **parts} for name in COMMANDS if name != "doctor"}


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; never returns."""
    try:
        with remember_interrupts():
            try:
                code = cli.main(
                    arguments, prog_name="tyrecal", standalone_mode=False, obj=arguments
                )
            except (KeyboardInterrupt, click.Abort):  # just before or after the command
                raise Interrupted from None
        sys.exit(code if isinstance(code, int) else 0)
    except click.exceptions.Exit as leave:
        sys.exit(leave.exit_code)
    except click.exceptions.NoArgsIsHelpError as overview:
        overview.show()
        sys.exit(EXIT_INPUT)
    except click.ClickException as wrong:
        context = getattr(wrong, "ctx", None)
        where = f" (see '{context.command_path} --help')" if context is not None else ""
        error(f"{_mistake(wrong)}{where}")
        sys.exit(EXIT_INPUT)
    except Interrupted as interrupted:
        say(f"\n{interrupted}", err=True)
        exec("")  # forgets an interrupt inside exec(), of which Python would die at its end
        sys.exit(interrupted.exit_code)
    except Exception as failure:
        code = _exit_code(failure)
        if code is None:
            raise
        words = os_words(failure) if isinstance(failure, OSError) else str(failure)
        if _lacks_memory(failure):
            words = NO_MEMORY
        for sentence in re.split(r"\n(?=[^*\n]*: )", words):  # lines to add to a deck have no ': '
            error(sentence)
        sys.exit(code)


def _mistake(wrong: click.ClickException) -> str:
    """Message for a wrong command line. Click's own message for an unknown option depends on its
    version."""
    if not isinstance(wrong, click.NoSuchOption):
        return wrong.format_message()
    from ..tyre.case.mistakes import suggestion

    return f"no option '{wrong.option_name}'" + suggestion(
        wrong.option_name, wrong.possibilities or (), otherwise=""
    )


def _exit_code(failure: Exception) -> int | None:
    """Exit code of a failure with a known cause; None for a bug of tyrecal."""
    if isinstance(failure, TyrecalError):
        return failure.exit_code
    return EXIT_INPUT if isinstance(failure, OSError) or _lacks_memory(failure) else None


def _lacks_memory(failure: Exception) -> bool:
    """Whether memory ran out, also while Python loaded a library."""
    unloaded = isinstance(failure, ImportError) and re.search(NOT_LOADED, str(failure))
    return isinstance(failure, MemoryError) or bool(unloaded)
