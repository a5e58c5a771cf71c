"""Options that the commands share, and how a command is made of them.

1. A command is a module of this package with ``command``, named in ``main.COMMANDS``; heavy imports
   stand inside the function, so that --help and completion stay quick.
2. ``@options.talking`` gives every command --json, --quiet and --verbose as ``talk`` (`Talk`): say
   and show for people, result for programs, detail for --verbose, warn and error.
3. ``@options.study``, in its place, gives what evaluates designs --jobs, --mesh, --solver,
   --output, --store, --no-store and --report too, as ``study`` (`Study`): load, door, run, finish.
4. Its docstring says what it does and writes, and ends with examples after a line ``\\b``.
5. Long work runs in ``with talk.progress("what") as bar``: ``bar.at(done, of)`` shows the time
   left. Ctrl-C says how to go on: ``run`` knows; others call `talk.resume`.
6. Wrong input raises click.UsageError, or an error that ``main`` knows; codes: ``main.EXIT_CODES``.
7. What a shell can complete has ``shell_complete``, from `complete`.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from . import complete
from .talk import SOLVERS, Talk

if TYPE_CHECKING:
    from ..evaluate.door import Door
    from .output import Run

case_argument = click.argument(
    "case", type=click.Path(path_type=Path), shell_complete=complete.cases
)
solver = click.option(
    "--solver",
    default="",
    metavar="NAME",
    help="Solver (default: the case's).",
    shell_complete=complete.solvers,
)
output = click.option(
    "--output",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder for the results (default: ./NAME-of-case).",
)
mesh = click.option(
    "--mesh",
    default="",
    metavar="LEVEL",
    help="Mesh level of the case, e.g. coarse or refined (default: the case's).",
    shell_complete=complete.levels,
)
as_json = click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Result as JSON on standard output, all else on standard error.",
)
quiet = click.option("--quiet", is_flag=True, help="Print nothing but errors.")
verbose = click.option("--verbose", is_flag=True, help="Say more; keep run folders.")
jobs = click.option(
    "--jobs",
    type=click.IntRange(1, 256),
    default=1,
    metavar="N",
    show_default=True,
    help="Designs evaluated at a time.",
)
store = click.option(
    "--store",
    type=click.Path(path_type=Path, file_okay=False),
    envvar="TYRECAL_STORE",
    metavar="DIR",
    help="Record of evaluations, which answers what was asked before (default: the folder 'record'"
    " of the results; also from TYRECAL_STORE).",
)
no_store = click.option("--no-store", is_flag=True, help="Neither ask nor keep a record.")
assignments = click.option(
    "--set",
    "assignments",
    multiple=True,
    metavar="NAME=VALUE",
    help="Set a variable or any number of the case; repeatable.",
    shell_complete=complete.assignments,
)
pressure = click.option(
    "--pressure-kPa",
    "pressure_kPa",
    type=float,
    metavar="P",
    help="Inflation pressure (default: the case's).",
)
loads = click.option(
    "--loads-N",
    "loads",
    metavar="F1,F2,...",
    help="Vertical loads on the road, rising (footprint's default: road.loads_N of the case, and"
    " the loads of its targets).",
)
one_load = click.option(
    "--load-N",
    "load_N",
    type=float,
    metavar="F",
    help="Modes of the tyre on a flat road under this vertical load, about its deflected state.",
)
sweep_load = click.option(
    "--sweep-load",
    "sweep",
    metavar="F1,F2,...",
    help="The same at several loads, rising; 0: the unloaded tyre.",
)


_from = click.option("--from-kPa", "from_kPa", type=float, default=100.0, metavar="A",
                     show_default=True, help="Lowest pressure of a sweep.")  # fmt: skip
_to = click.option("--to-kPa", "to_kPa", type=float, default=320.0, metavar="B", show_default=True,
                   help="Highest pressure of a sweep.")  # fmt: skip
_steps = click.option("--steps", type=click.IntRange(2, 10000), default=12, metavar="N",
                      show_default=True, help="Pressures of a sweep, both ends among them."
                      )  # fmt: skip
scheduler = click.option(
    "--scheduler",
    default="",
    metavar="ADDRESS|FILE",
    help="Have the workers of a Dask scheduler do it: its address, or a settings file (.yaml) for"
    " jobs of SLURM or PBS. Needs the extra tyrecal[cluster].",
)


def every(*options: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Apply several options in the order given."""

    def apply(function: Any) -> Any:
        for option in reversed(options):
            function = option(function)
        return function

    return apply


pressures = every(_from, _to, _steps)
report = click.option(
    "--report",
    is_flag=True,
    help="Write report.html, a page of all that the folder of results holds.",
)
TALK = (as_json, quiet, verbose)
ONE_BY_ONE = (mesh, solver, output, store, no_store, *TALK)
STUDY = (jobs, *ONE_BY_ONE[:-3], report, *TALK)


def talking(function: Callable[..., int]) -> Callable[..., int]:
    """--json, --quiet and --verbose, as the argument ``talk``."""

    @wraps(function)
    def command(*args: Any, as_json: bool, quiet: bool, verbose: bool, **rest: Any) -> int:
        return function(*args, talk=_talk(as_json, quiet, verbose), **rest)

    result: Callable[..., int] = every(*TALK)(command)
    return result


def study(function: Callable[..., int]) -> Callable[..., int]:
    """All that a command has which evaluates designs, as the argument ``study``."""
    return _study(function, STUDY)


def study_one_by_one(function: Callable[..., int]) -> Callable[..., int]:
    """The same without --jobs and --report."""
    return _study(function, ONE_BY_ONE)


def _study(function: Callable[..., int], given: tuple[Any, ...]) -> Callable[..., int]:
    @wraps(function)
    def command(
        *args: Any,
        mesh: str,
        solver: str,
        output: Path | None,
        store: Path | None,
        no_store: bool,
        as_json: bool,
        quiet: bool,
        verbose: bool,
        jobs: int = 1,
        report: bool = False,
        **rest: Any,
    ) -> int:
        talk = _talk(as_json, quiet, verbose)
        asked = Study(jobs, mesh, solver, output, store, no_store, report, talk)
        return function(*args, study=asked, **rest)

    result: Callable[..., int] = every(*given)(command)
    return result


@dataclass(frozen=True)
class Study:
    """How designs are evaluated, and where the results go."""

    jobs: int
    mesh: str
    solver: str
    output: Path | None
    store: Path | None
    no_store: bool
    report: bool
    talk: Talk

    def load(
        self, path: Path, assigned: tuple[str, ...] = (), pressure_kPa: float | None = None
    ) -> Any:
        """As `load`, at the mesh level asked for."""
        return load(path, self.mesh, assigned, pressure_kPa, self.talk)

    def door(self, loaded: Any) -> Door:
        """The door to the solver asked for. Raises UnknownSolver."""
        from ..evaluate.door import Door

        door = Door(loaded, self.solver)
        door.solver  # noqa: B018  a solver that is not there is refused before anything is written
        return door

    def run(self, case: Path, command: str, door: Door, results: str = "") -> Run:
        """The command's run, with the record behind ``door``; ``results``: key of those that it
        renews, where it is not ``command``. Raises OutputRefused, Locked, OSError."""
        from .output import Run

        run = Run(case, self.output, command, door.solver)
        run.renew(results or command)
        door.folder, door.keep = run.runs, self.talk.verbose
        door.store = run.open_store(self.store, self.no_store)
        run.counts = counts = door.counts
        words = "{0.runs} runs of the solver, {0.recorded} answers from the record"
        context = click.get_current_context()
        context.call_on_close(lambda: self.talk.detail(words.format(counts)))
        return run

    def finish(self, run: Run) -> None:
        """Say where the results are; see `page`."""
        self.talk.say(f"results in {run.folder}")
        self.page(run)

    def page(self, run: Run) -> None:
        """Where it is wanted, write report.html of all that the folder holds. Raises BadResults."""
        if self.report:
            from ..report.html.page import write_page

            path = run.folder / "report.html"
            write_page(path, [run.folder])
            self.talk.say(f"report in {path}")


def _talk(as_json: bool, quiet: bool, verbose: bool) -> Talk:
    if quiet and verbose:
        raise click.UsageError("give --quiet or --verbose, not both")
    context, start = click.get_current_context(), time.monotonic()
    talk = Talk(as_json, quiet, verbose)
    if verbose:
        logging.basicConfig(format="%(name)s: %(message)s")
        for name in ("tyrecal", SOLVERS):
            logging.getLogger(name).setLevel(logging.INFO)
        path = context.command_path
        context.call_on_close(lambda: talk.detail(f"{path} took {time.monotonic() - start:.1f} s"))
    return talk


def fitted(text: str) -> Callable[[Any], Any]:
    """A finished fit whose design is studied too; ``text``: the option's help."""
    path = click.Path(path_type=Path, exists=True, dir_okay=False)
    return click.option("--fitted", type=path, metavar="fit.json", help=text)


def load(
    path: Path,
    mesh_level: str,
    assigned: tuple[str, ...],
    pressure_kPa: float | None,
    talk: Talk,
) -> Any:
    """The case with its start values, mesh level, assignments and pressure applied.

    Says which numbers of the file do not count. Returns (case, values of the variables). Raises
    CaseError, click.UsageError.
    """
    from ..case import (
        load_case,
        overruled,
        parse_assignment,
        start_values,
        with_level,
        with_values,
    )
    from ..case.load import CaseError

    case = load_case(path)
    try:
        if mesh_level:
            case = with_level(case, mesh_level)
        names = set(case.case.variables)
        given = _once([parse_assignment(text) for text in assigned], pressure_kPa)
        for name, variable in case.case.variables.items():
            for number in set(variable.sets) & set(given):
                raise click.UsageError(
                    f"{number} is set by the variable '{name}'; give --set {name}=VALUE instead"
                )
        for sentence in overruled(case, given):
            talk.note(sentence)
        case = with_values(case, {k: v for k, v in given.items() if k not in names})
        values = {**start_values(case), **{k: v for k, v in given.items() if k in names}}
        return with_values(case, values), values
    except CaseError:
        raise
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def given() -> list[str]:
    """The options that stand on the command line, not those of the environment."""
    context = click.get_current_context()
    return [
        [*([] if context.params[option.name] else option.secondary_opts), *option.opts][0]
        for option in context.command.params
        if isinstance(option, click.Option)
        and context.get_parameter_source(str(option.name)) is ParameterSource.COMMANDLINE
    ]


def say_idle(talk: Talk, jobs: int, why: str) -> None:
    """Says that --jobs asks for workers who have nothing to do: scripts may give it everywhere."""
    if jobs > 1:
        talk.note(f"--jobs changes nothing here: {why}")


def not_both(jobs: int, scheduler: str) -> None:
    """Raises click.UsageError where this machine and a scheduler's are asked for."""
    if scheduler and jobs > 1:
        raise click.UsageError("--jobs is for this machine; with --scheduler its workers count")


def parse_loads(text: str, option: str = "--loads-N", zero: bool = False) -> list[float]:
    """Loads in N; ``zero``: 0 may be the first. Raises click.UsageError."""
    from itertools import pairwise
    from math import isfinite

    loads: list[float] = []
    for word in text.split(","):
        try:
            loads.append(float(word))
        except ValueError:
            raise click.UsageError(f"{option}: '{word.strip()}' is not a number") from None
        allowed = loads[-1] > 0 or (zero and loads == [0.0])
        if not (isfinite(loads[-1]) and allowed):
            raise click.UsageError(f"{option} {loads[-1]:g}: must be a finite load above 0")
    for before, after in pairwise(loads):
        if after <= before:
            raise click.UsageError(f"{option}: {after:g} after {before:g}, loads must rise")
    return loads


def parse_pressures(low: float, high: float, steps: int) -> tuple[float, ...]:
    """Equidistant pressures in kPa, both ends among them. Raises click.UsageError."""
    from math import isfinite

    for option, value in (("--from-kPa", low), ("--to-kPa", high)):
        if not (isfinite(value) and value > 0):
            raise click.UsageError(f"{option} {value:g}: must be a finite pressure above 0")
    if low >= high:
        raise click.UsageError(f"--from-kPa {low:g} must be less than --to-kPa {high:g}")
    return tuple(round(low + (high - low) * i / (steps - 1), 9) for i in range(steps))


def fitted_values(path: Path, loaded: Any, solver: str) -> dict[str, float]:
    """The design of a fit.json. Raises click.UsageError where it is not this case's."""
    from ..studies.fitted import NotThisFit, read_fitted

    try:
        return read_fitted(path, loaded, solver)
    except NotThisFit as error:
        raise click.UsageError(f"--fitted: {error}") from None


def _once(pairs: list[tuple[str, float]], pressure_kPa: float | None) -> dict[str, float]:
    """Assignments by name, none of them twice."""
    if pressure_kPa is not None:
        pairs = [*pairs, ("pressure_kPa", pressure_kPa)]
    given = dict(pairs)
    if len(given) < len(pairs):
        twice = next(name for name in given if sum(n == name for n, _ in pairs) > 1)
        raise click.UsageError(f"{twice} is set twice")
    return given


def starting_at(loaded: Any, values: Mapping[str, float]) -> Any:
    """The case with its variables' start values replaced. Raises click.UsageError."""
    from dataclasses import replace

    variables = {
        name: variable.model_copy(update={"start": values[name]})
        for name, variable in loaded.case.variables.items()
    }
    for name, variable in variables.items():
        if not variable.lower <= variable.start <= variable.upper:
            raise click.UsageError(
                f"--set {name}={variable.start:g}: a fit must start within the bounds"
                f" {variable.lower:g} to {variable.upper:g}"
            )
    return replace(loaded, case=loaded.case.model_copy(update={"variables": variables}))
