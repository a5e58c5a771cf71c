"""Entry point: finds the command, and turns every failure into one sentence and an exit code."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

import click

# One BLAS thread: the tyre's matrices are small, and cores are better spent on other designs.
# Has to be set before NumPy is imported.
for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

COMMANDS = {  # name: one line of help, so that the overview imports no command
    "validate": "Check a case file and report every mistake.",
    "deck": "Write the decks of a case, to read or to run elsewhere.",
    "modes": "Evaluate one design, unloaded or on a road: frequencies with their labels.",
    "fit": "Calibrate the case's variables to its target frequencies.",
    "sweep-pressure": "Follow every mode over the inflation pressure.",
    "footprint": "Press the tyre on a road: contact area and pressure over load.",
    "effects": "List and explain what a plain model leaves out, and what it does.",
    "diagnose": "Say where model and measurements part, and which effect explains it.",
    "blind": "Try the diagnosis on data whose effect is withheld: make, answer, score.",
    "batch": "Study many cases at once, compare with a baseline, report to CI.",
    "solvers": "List the installed solvers and what they can do.",
    "store": "Look at a record of evaluations, check it, prune it.",
}
EXIT_INPUT, EXIT_SOLVER, EXIT_FIT, EXIT_BATCH, EXIT_INTERRUPTED = 2, 3, 4, 5, 130


class Commands(click.Group):
    """The commands, each imported when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        command: click.Command = import_module(f"tyrecal.cli.{name.replace('-', '_')}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="tyrecal")
def cli() -> None:
    """Calibrate a tyre finite element model to measured modes.

    \b
    tyrecal validate cases/p235_75r17.yaml
    tyrecal modes cases/p235_75r17.yaml --pressure-kPa 200
    tyrecal fit cases/p235_75r17.yaml

    Exit codes: 0 done; 2 the input is wrong; 3 the solver failed; 4 the fit did not converge or
    did not move; 5 some cases of a batch failed or drifted; 130 interrupted.
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; never returns."""
    try:
        code = cli.main(arguments, standalone_mode=False)
        sys.exit(code if isinstance(code, int) else 0)
    except click.exceptions.Exit as leave:
        sys.exit(leave.exit_code)
    except click.ClickException as error:
        error.show()
        sys.exit(EXIT_INPUT)
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted", err=True)
        sys.exit(EXIT_INTERRUPTED)
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)
    except Exception as error:
        code = _exit_code(error)
        if code is None:
            raise
        for line in str(error).splitlines():
            click.echo(f"error: {line}", err=True)
        sys.exit(code)


def _exit_code(error: Exception) -> int | None:
    """Exit code of a failure that is somebody's, None for a bug of ours."""
    kinds: list[tuple[str, str, int]] = [
        ("tyrecal.evaluate.failure", "EvaluationFailed", EXIT_SOLVER),
        ("tyrecal.evaluate.failure", "SolverUnavailable", EXIT_SOLVER),
        ("tyrecal.evaluate.failure", "DeckRefused", EXIT_INPUT),
        ("tyrecal.evaluate.solver", "UnknownSolver", EXIT_INPUT),
        ("tyrecal.deck.environment", "TemplateFailed", EXIT_INPUT),
        ("tyrecal.fit.calibrate", "NothingToFit", EXIT_INPUT),
        ("tyrecal.evaluate.queue", "BadSettings", EXIT_INPUT),
        ("tyrecal.batch.drift", "BadBaseline", EXIT_INPUT),
        ("tyrecal.diagnose.measurements", "BadMeasurements", EXIT_INPUT),
        ("tyrecal.diagnose.study", "BadChange", EXIT_INPUT),
        ("tyrecal.blind.protocol", "BadTrials", EXIT_INPUT),
        ("tyrecal.cli.output", "OutputRefused", EXIT_INPUT),
        ("tyrecal.cli.lock", "Locked", EXIT_INPUT),
        ("tyrecal.case", "CaseError", EXIT_INPUT),
    ]
    for module, name, code in kinds:
        loaded: Any = sys.modules.get(module)  # an error of a module never imported cannot occur
        if loaded is not None and isinstance(error, getattr(loaded, name)):
            return code
    return EXIT_INPUT if isinstance(error, OSError) else None
