"""Options that the commands share, and how a command is made of them.

1. A command is a module of this package with ``command``, named in ``main.COMMANDS``; heavy imports
   stand inside the function, so that --help and completion stay quick.
2. ``@options.with_terminal`` gives every command --json, --quiet and --verbose as ``terminal``
   (`Terminal`): say and show for people, result for programs, detail for --verbose, warn, error.
3. ``@options.study``, in its place, gives what evaluates designs --jobs, --mesh, --solver,
   --output, --store, --no-store and --report too, as ``study`` (`Study`): load, evaluator,
   run, finish. ``study`` has the shared options above it too, such as --set. `packed` makes an
   argument of other options that belong together.
4. Its docstring says what it does and writes, and ends with examples after a line ``\\b``.
5. Long work runs in ``with terminal.progress("what") as bar``: ``bar.at(done, of)`` shows the time
   left. Ctrl-C says how to go on: ``run`` knows; others call `terminal.resume`.
6. Wrong input raises click.UsageError, or an error that ``main`` knows; codes: ``main.EXIT_CODES``.
7. What a shell can complete has ``shell_complete``, from `complete`.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ..files import PICTURE_FORMATS
from . import arguments, complete
from .parameters import FileOrFolder, Number, OneOf, WholeNumber, option
from .terminal import SOLVERS, Terminal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..simulate.evaluate.evaluator import Evaluator
    from ..simulate.evaluate.failure import EvaluationFailed
    from ..studies.result import Result
    from ..studies.run_plan import RunPlan
    from ..tyre.case import LoadedCase
    from .output import Run

case_argument = click.argument("case", type=FileOrFolder(), shell_complete=complete.cases)
case_or_last = click.argument(
    "case", type=FileOrFolder(), required=False, shell_complete=complete.cases
)
solver = option(
    "--solver",
    default="",
    metavar="NAME",
    help="Solver, such as bundled (default: from your settings, else the case).",
    shell_complete=complete.solvers,
)
solver_command = option(
    "--solver-command",
    callback=lambda ctx, param, value: _words(value),
    metavar="COMMAND",
    help="Program that the solver starts (default: from TYRECAL_SOLVER_COMMAND, your settings file"
    " or the solver; see tyrecal solvers).",
)
output = option(
    "--output",
    type=FileOrFolder(),
    metavar="DIR",
    help="Folder for the results (default: named after the case, here or in the output of your"
    " settings).",
)
mesh = option(
    "--mesh",
    default="",
    metavar="LEVEL",
    help="Mesh level of the case, e.g. coarse or refined (default: the case's).",
    shell_complete=complete.levels,
)
as_json = option(
    "--json",
    "as_json",
    is_flag=True,
    help="Result as JSON on standard output, all else on standard error.",
)
quiet = option("--quiet", is_flag=True, help="Print errors only.")
verbose = option("--verbose", is_flag=True, help="Print more, and keep run folders.")
jobs = option(
    "--jobs",
    type=WholeNumber(1, 256),
    default=1,
    metavar="N",
    show_default=True,
    help="Number of designs evaluated at a time.",
)
store = option(
    "--store",
    type=FileOrFolder(file=False),
    envvar="TYRECAL_STORE",
    metavar="DIR",
    help="Evaluation store: finished evaluations are read from it (default: the folder 'record' of"
    " the results, or TYRECAL_STORE).",
)
no_store = option(
    "--no-store", is_flag=True, help="No evaluation store: evaluate every design, and keep none."
)
allow_unusual = option(
    "--allow-unusual", is_flag=True, help="Accept numbers outside their usual ranges."
)
assignments = option(
    "--set",
    "assignments",
    multiple=True,
    metavar="NAME=VALUE",
    help="Value of a variable or of any key of the case: a number, true, false, null, or a word"
    " that the key allows; repeatable. Example: rim.holds=bead_surface.",
    shell_complete=complete.assignments,
)
pressure = option(
    "--pressure-kPa",
    "pressure_kPa",
    type=Number(),
    metavar="P",
    help="Inflation pressure, kPa (default: the case's). Example: 200.",
)
loads = option(
    "--loads-N",
    "loads",
    metavar="F1,F2,...",
    help="Vertical loads on the road, N, rising (default of footprint: road.loads_N of the case,"
    " and the loads of its targets).",
)
one_load = option(
    "--load-N",
    "load_N",
    type=Number(),
    metavar="F",
    help="Vertical load on a flat road, N: vibrations about the deflected state (default: none).",
)
sweep_load = option(
    "--sweep-load",
    "sweep",
    metavar="F1,F2,...",
    help="Several vertical loads, N, rising; 0: the unloaded tyre. Example: 0,2000,4000.",
)


wheel = option(
    "--wheel",
    type=OneOf(["held", "free-along-load"]),
    help="Wheel under a load: its centre is held, or free along the load with the rim's mass"
    " (default: road.wheel of the case).",
)


_from = option(
    "--from-kPa",
    "low",
    type=Number(),
    metavar="A",
    help="Lowest pressure of a sweep, kPa (default: 5/12 times the case's, 100 for 240 kPa).",
)
_to = option(
    "--to-kPa",
    "high",
    type=Number(),
    metavar="B",
    help="Highest pressure of a sweep, kPa (default: 4/3 times the case's, 320 for 240 kPa).",
)
_steps = option(
    "--steps",
    type=WholeNumber(2, 10000),
    default=12,
    metavar="N",
    show_default=True,
    help="Number of pressures of a sweep, both ends included.",
)
scheduler = option(
    "--scheduler",
    default="",
    metavar="ADDRESS|FILE",
    help="Dask scheduler that distributes the evaluations: its address, or a settings file (.yaml)"
    " for jobs of SLURM or PBS. Needs Dask: run pip install '.[cluster]' in a clone of"
    " tyrecal.",
)


def every(*options: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Apply several options in the order given."""

    def apply(function: Any) -> Any:
        for each in reversed(options):
            function = each(function)
        return function

    return apply


dry_run = option(
    "--dry-run",
    is_flag=True,
    help="Print the problem size, the number of runs, their approximate time and memory; run and"
    " write nothing.",
)
pressures = every(_from, _to, _steps)
report = option(
    "--report", is_flag=True, help="Write report.html, a page with all results in the folder."
)
figure_format = option(
    "--figure-format",
    type=OneOf(PICTURE_FORMATS),
    default="png",
    show_default=True,
    help="Format of the pictures.",
)
OUTPUT_OPTIONS = (as_json, quiet, verbose)
SERIAL_OPTIONS = (mesh, solver, solver_command, output, store, no_store, allow_unusual, dry_run)
STUDY = (jobs, *SERIAL_OPTIONS, report)


def packed(name: str, kind: type[Any]) -> Callable[[Any], Any]:
    """The options named as the fields of a dataclass ``kind``, as one argument ``name``."""

    def apply(function: Callable[..., int]) -> Callable[..., int]:
        @wraps(function)
        def command(*args: Any, **values: Any) -> int:
            own = {key: values.pop(key) for key in kind.__dataclass_fields__ if key in values}
            return function(*args, **{**values, name: kind(**own)})

        return command

    return apply


def with_terminal(function: Callable[..., int]) -> Callable[..., int]:
    """--json, --quiet and --verbose, as the argument ``terminal``."""

    @wraps(function)
    def command(*args: Any, **values: Any) -> int:
        return function(*args, terminal=_terminal_of(values), **values)

    result: Callable[..., int] = every(*OUTPUT_OPTIONS)(command)
    return result


def with_study(function: Callable[..., int]) -> Callable[..., int]:
    """The options above it that `Study` has, and --json, --quiet and --verbose, as ``study``."""
    return with_terminal(packed("study", Study)(function))


def study(function: Callable[..., int]) -> Callable[..., int]:
    """All that a command has which evaluates designs, as the argument ``study``."""
    result: Callable[..., int] = every(*STUDY)(with_study(function))
    return result


def study_one_by_one(function: Callable[..., int]) -> Callable[..., int]:
    """The options of `study` without --jobs and --report."""
    result: Callable[..., int] = every(*SERIAL_OPTIONS)(with_study(function))
    return result


@dataclass(frozen=True)
class Study:
    """Designs to evaluate, and where the results go: the options that commands share, each at its
    default where a command does not have it."""

    terminal: Terminal
    mesh: str = ""
    assignments: tuple[str, ...] = ()  # of --set
    pressure_kPa: float | None = None
    fitted: Path | None = None  # fit.json or its folder
    solver: str = ""
    solver_command: tuple[str, ...] = ()  # words of --solver-command; (): the solver's own
    output: Path | None = None
    store: Path | None = None
    no_store: bool = False
    allow_unusual: bool = False
    dry_run: bool = False
    jobs: int = 1  # designs evaluated at a time
    scheduler: str = ""
    report: bool = False
    pictures: bool | None = True  # None: the command decides
    figure_format: str = "png"

    def load(self, path: Path) -> Any:
        """`arguments.load`, with the requested mesh level, numbers and pressure."""
        return arguments.load(
            path, self.mesh, self.assignments, self.pressure_kPa, self.terminal, self.allow_unusual
        )

    def one_design(self, loaded: Any) -> tuple[Any, dict[str, float]]:
        """`arguments.one_design`, of --fitted or the start."""
        return arguments.one_design(self.fitted, loaded, self.assignments, self.terminal)

    def fitted_values(self, loaded: Any) -> dict[str, dict[str, float]]:
        """The values of --fitted by the name of their design; empty without --fitted."""
        if self.fitted is None:
            return {}
        return {"fitted": arguments.fitted_values(self.fitted, loaded, self.terminal)}

    def evaluator(self, loaded: Any) -> Evaluator:
        """The evaluator with the requested solver. Raises InputError."""
        from ..simulate.deck.decks_design import design_of
        from ..simulate.evaluate.evaluator import Evaluator

        evaluator = Evaluator(design_of(loaded), self.solver, command=self.solver_command)
        evaluator.solver  # noqa: B018  a solver that is not there is refused before anything is written
        for remark in evaluator.design.remarks(evaluator):
            self.terminal.note(remark)
        return evaluator

    def run(
        self,
        loaded: LoadedCase,
        command: str,
        evaluator: Evaluator,
        study: str = "",
        measured: Sequence[Path] = (),
        plan: RunPlan | None = None,
        **state: Any,
    ) -> Run:
        """The command's run, with the record behind ``evaluator``; ``study``: where it is not
        ``command``; measured, state: of the results' `provenance`; plan: of its evaluations, by
        default of one. A dry run ends here, before anything is written. Raises InputError,
        OSError."""
        from ..simulate.provenance import provenance
        from ..studies.run_plan import plan_evaluations
        from ..tyre.case import start_values
        from .output import Run

        if self.dry_run:
            plan = plan or plan_evaluations(loaded, evaluator, [start_values(loaded)])
            self.terminal.result(plan.content())
            self.terminal.say(str(plan))
            raise click.exceptions.Exit(0)
        if plan and plan.on_road:
            self.terminal.note(str(plan))
        block = provenance(loaded, evaluator.solver, measured, **state)
        run = Run(loaded.path, self.output, command, evaluator.solver, study, block, loaded)
        run.figure_format, run.measured = self.figure_format, measured
        evaluator.folder, evaluator.keep = run.runs, self.terminal.verbose
        evaluator.store = run.open_store(self.store, self.no_store)
        run.counts = counts = evaluator.counts
        words = "{0.runs} runs of the solver, {0.recorded} results from the evaluation store"
        context = click.get_current_context()
        context.call_on_close(lambda: self.terminal.detail(words.format(counts)))
        context.call_on_close(lambda: self._say_earlier(run))
        return run

    def _say_earlier(self, run: Run) -> None:
        """Report whose results are in the folder after a run that failed."""
        if run.has_earlier:
            self.terminal.note(
                f"results of '{run.study}' in '{run.folder}' are those of an earlier run"
            )

    def say_idle(self, why: str) -> None:
        """Note that --jobs has no effect here, no error: scripts may give it everywhere."""
        if self.jobs > 1 and not _by_settings("jobs"):
            self.terminal.note(f"--jobs has no effect here: {why}")

    def refuse_two_machines(self) -> None:
        """Raises click.UsageError where this machine and a scheduler's are both requested."""
        if self.scheduler and self.jobs > 1 and not _by_settings("jobs"):
            raise click.UsageError(
                "--jobs applies to this machine only; with --scheduler, its number of workers"
                " applies"
            )

    def notify(self, words: str, failure: EvaluationFailed | None) -> None:
        """How a study goes: a place that was reached, or why it was not."""
        if failure:
            self.terminal.error(f"{words}: {failure}")
        else:
            self.terminal.detail(words)

    def present(self, run: Run, result: Result, figures: Mapping[str, Figure]) -> int:
        """Write a result with its figures by name, print its findings, and return the exit code."""
        from ..report.table import shown
        from .main import EXIT_SOLVER

        result = run.write(result, figures)
        run.finish()
        self.terminal.result(result.content())
        for table in result.tables():
            self.terminal.show(shown(table))
        for sentence in result.sentences():
            self.terminal.say(sentence)
        if lost := result.doubts():
            count = len(lost) + len(getattr(result, "rows", ()))
            self.terminal.error(f"{len(lost)} of {count} evaluations failed; the others are kept")
        self.finish(run)
        return EXIT_SOLVER if lost else 0

    def finish(self, run: Run) -> None:
        """Print where the results are; see `page`."""
        self.terminal.say(f"results in {run.placed}")
        self.page(run)

    def page(self, run: Run) -> None:
        """Where it is wanted, write report.html of all that the folder holds. Raises InputError."""
        if self.report:
            from ..report.html.page import write_page

            path = run.placed / "report.html"
            write_page(path, [run.placed])
            self.terminal.say(f"report in {path}")


def _terminal_of(values: dict[str, Any]) -> Terminal:
    """Takes the options of `OUTPUT_OPTIONS` out of a command's values."""
    terminal = Terminal(*(values.pop(name) for name in ("as_json", "quiet", "verbose")))
    if terminal.quiet and terminal.verbose:
        raise click.UsageError("give --quiet or --verbose, not both")
    if {"--store", "--no-store"} <= {*given()}:
        raise click.UsageError("give --store or --no-store, not both")
    context, start = click.get_current_context(), time.monotonic()
    if terminal.verbose:
        logging.basicConfig(format="%(name)s: %(message)s")
        logging.getLogger("tyrecal").setLevel(logging.INFO)
        logging.getLogger(SOLVERS).setLevel(logging.DEBUG)
        path = context.command_path
        context.call_on_close(
            lambda: terminal.detail(f"{path} took {time.monotonic() - start:.1f} s")
        )
    return terminal


def seed(of: str, highest: int | None = None) -> Callable[[Any], Any]:
    """The option of a study that draws by chance; ``of``: its draws in words."""
    return option(
        "--seed",
        type=WholeNumber(0, highest),
        default=0,
        metavar="S",
        show_default=True,
        help=f"Seed of {of}.",
    )


def fitted(compares: str = "") -> Callable[[Any], Any]:
    """A finished fit, whose design is studied; ``compares``: the words that the initial one is
    studied too."""
    path = FileOrFolder(exists=True)
    text = f"Fit of the case, fit.json or its folder: take the fitted design{compares}."
    return option("--fitted", type=path, metavar="fit.json|DIR", help=text)


def given(*without: str) -> list[str]:
    """The options on the command line, ``without`` some and those of `OUTPUT_OPTIONS`; none that
    only the environment or the settings give."""
    context = click.get_current_context()
    names = [
        [*([] if context.params[each.name] else each.secondary_opts), *each.opts][0]
        for each in context.command.params
        if isinstance(each, click.Option)
        and context.get_parameter_source(str(each.name)) is ParameterSource.COMMANDLINE
    ]
    return [name for name in names if name not in (*without, "--json", "--quiet", "--verbose")]


def _by_settings(option: str) -> bool:
    """Whether an option was set by the user's settings alone."""
    source = click.get_current_context().get_parameter_source(option)
    return source is ParameterSource.DEFAULT_MAP


def _words(command: str | None) -> tuple[str, ...]:
    """The words of --solver-command. Raises InputError."""
    if command is None:
        return ()
    from ..simulate.settings import words

    return tuple(words(command, "--solver-command"))
