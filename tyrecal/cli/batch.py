"""tyrecal batch"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from ..files import Json, json_text, make_folder, refuse_link, write_text
from ..studies import STUDIES, runnable
from ..studies.pressure_range import PressureRange
from . import arguments, options
from .main import EXIT_BATCH
from .parameters import FileOrFolder, WholeNumber, option
from .terminal import Terminal

STUDY_NAMES = [name for name, entry in STUDIES.items() if entry.runs_by_name]
FILE_PATH = FileOrFolder(folder=False)


@dataclass(frozen=True)
class Baseline:
    """The numbers of an earlier batch, to compare with or to write."""

    file: Path | None
    write_baseline: bool

    def check(self) -> None:
        """Raises click.UsageError if there is no file to write."""
        if self.write_baseline and not self.file:
            raise click.UsageError("--write-baseline needs --baseline FILE")

    def read(self) -> Json | None:
        """The content of the file; None: there is none. Raises InputError."""
        from ..batch.drift import read_baseline

        if self.file and (self.file.exists() or not self.write_baseline):
            return read_baseline(self.file)
        return None

    def drift(self, reports: Sequence[Json], before: Json | None) -> Json | None:
        """Differences of a batch from the numbers before, unless they are written."""
        from ..batch.drift import compare

        return compare(reports, before) if before and not self.write_baseline else None

    def write(self, reports: Sequence[Json], before: Json | None) -> None:
        """Write the numbers of a batch where that is requested; tolerances are kept."""
        from ..batch.drift import baseline_of

        if self.write_baseline and self.file:
            _write(self.file, json_text(baseline_of(reports, before)))


@click.command()
@click.argument("cases", nargs=-1, required=True, type=FileOrFolder(exists=True, folder=False))
@option(
    "--studies",
    default="fit",
    metavar="S1,S2,...",
    show_default=True,
    help=f"Studies to run, of {', '.join(STUDY_NAMES)}. After a fit, sweeps, footprint,"
    " stiffness, sensitivities and frf study the fitted design.",
)
@option(
    "--junit",
    type=FILE_PATH,
    metavar="FILE",
    help="JUnit XML file for a CI server, such as junit.xml.",
)
@option(
    "--baseline",
    "file",
    type=FILE_PATH,
    metavar="FILE",
    help="Baseline file: numbers to compare with, and their tolerances.",
)
@option(
    "--write-baseline",
    is_flag=True,
    help="Write the numbers to --baseline instead of comparing; its tolerances are kept.",
)
@options.packed("baseline", Baseline)
@options.loads
@options.pressures
@options.packed("pressures", PressureRange)
@option(
    "--jobs",
    type=WholeNumber(1, 256),
    default=1,
    metavar="N",
    show_default=True,
    help="Number of cases at a time, on this machine.",
)
@options.scheduler
@options.every(
    options.mesh,
    options.solver,
    options.solver_command,
    option(
        "--output",
        type=FileOrFolder(),
        metavar="DIR",
        help="Folder for the results, with one folder for each case (default: batch).",
    ),
    options.store,
    options.no_store,
    options.allow_unusual,
)
@options.with_study
def command(
    cases: tuple[Path, ...],
    studies: str,
    junit: Path | None,
    baseline: Baseline,
    loads: str | None,
    pressures: PressureRange,
    study: options.Study,
) -> int:
    """Study many CASES. If one fails, the others are still studied.

    Writes DIR/batch.json, and the results of each case to a folder of its name in DIR. Run the same
    command again to resume: finished cases are read from their folders.

    \b
    tyrecal batch cases/*.yaml --jobs 2
    tyrecal batch cases/*.yaml --studies fit,modes,sweep-pressure --junit junit.xml
    tyrecal batch cases/*.yaml --baseline baseline.json --write-baseline
    tyrecal batch cases/*.yaml --baseline baseline.json
    tyrecal batch cases/*.yaml --scheduler tcp://10.0.0.1:8786

    Exit codes: 0 all cases good; 2 the input is wrong; 3 no scheduler answers; 5 some failed or
    drifted; 130, 143, 129 interrupted, terminated, hung up.
    """
    from ..simulate.evaluate.pool import warm_up

    terminal, scheduler = study.terminal, study.scheduler
    if study.jobs > 1 and len(cases) > 1 and not scheduler:
        warm_up()  # while we import
    from ..batch.case import Asked, CaseTask
    from ..batch.junit import junit as junit_xml
    from ..batch.run import names_of, run_batch, summary
    from ..simulate.evaluate.cluster import reached
    from ..simulate.settings import root
    from .output import Run
    from .progress import BatchProgress

    names = names_of(cases)
    wanted = _studies(studies)
    arguments.checked_pressures(pressures, study.allow_unusual)
    study_options = Asked(
        tuple(arguments.parse_loads(loads)) if loads is not None else None, pressures
    )
    baseline.check()
    study.refuse_two_machines()
    before = baseline.read()
    output = study.output or root() / "batch"
    run = Run(output, output, "batch")
    record = run.open_store(study.store, study.no_store)
    folder = output.resolve()
    tasks = [
        CaseTask(
            name,
            path.resolve(),
            folder / name,
            wanted,
            study_options,
            study.solver,
            study.mesh,
            record.folder if record else None,
            study.solver_command,
            study.allow_unusual,
        )
        for name, path in zip(names, cases, strict=True)
    ]
    _prepare(tasks, folder)
    started = run.started
    progress = BatchProgress(len(tasks), terminal.quiet, terminal.verbose)
    try:
        with progress, reached(scheduler) as address:
            reports = run_batch(tasks, study.jobs, address, progress.notify)
    except BaseException:
        if not scheduler:  # workers of a scheduler still finish their cases
            _drop_run_folders(tasks)
        raise
    _drop_run_folders(tasks)
    reports.sort(key=lambda report: str(report["name"]))
    drift = baseline.drift(reports, before)
    result = summary(wanted, reports, drift)
    result = run.write_json("batch.json", result)
    if junit:
        _write(junit, junit_xml(reports, drift, started))
    baseline.write(reports, before)
    run.finish(cases={report["name"]: report["facts"] for report in reports}, scheduler=address)
    terminal.result(result)
    _print_summary(result, terminal)
    if baseline.write_baseline:
        terminal.say(f"baseline written to {baseline.file}")
    terminal.say(f"results in {run.folder}")
    return 0 if result["counts"]["good"] == len(reports) else EXIT_BATCH


def _studies(text: str) -> tuple[str, ...]:
    """The requested studies, in the order of their runs. Raises click.UsageError."""
    names, known = [word.strip() for word in text.split(",")], runnable()
    for word in names:
        arguments.refuse_unknown("--studies", word, known, "study")
    return tuple(name for name in known if name in names)


def _prepare(tasks: Sequence[Any], folder: Path) -> None:
    """Prepare the cases' folders in ``folder``. Raises InputError if one holds results of another
    case; OSError if one is a link."""
    from .output import refuse_other

    for task in tasks:
        inside = task.folder.relative_to(folder)
        for part in (inside, *inside.parents):
            if part != Path():
                refuse_link(folder / part)
        refuse_other(task.folder, task.path)
    _drop_run_folders(tasks)


def _drop_run_folders(tasks: Sequence[Any]) -> None:
    """Remove the solver's run folders that ended processes have left."""
    from contextlib import suppress

    from ..simulate.evaluate.folders import drop_unfinished

    for task in tasks:
        drop_unfinished(task.folder / "runs")
        with suppress(OSError):  # it holds failures, or was never made
            (task.folder / "runs").rmdir()


def _print_summary(result: Mapping[str, Any], terminal: Terminal) -> None:
    """Print verdicts, failures, drift from the baseline, and the number of cases by outcome."""
    from ..report.batch import drift_table, failures_table

    for case in result["cases"]:
        for entry in case["studies"].values():
            if "verdict" in entry:
                terminal.say(f"{case['name']}: {entry['verdict']}: {entry['words']}")
    failures = failures_table(result)
    if failures:
        terminal.show(failures, beside_json=True)
    drift = result["baseline"]
    if drift:
        drifted = drift_table(drift)
        if drifted:
            terminal.show(drifted, beside_json=True)
        words = f"{len(drift['drifted'])} of {drift['compared']} numbers drifted"
        words += f", {drift['new']} are new" if drift["new"] else ""
        terminal.say(f"{words}; see the baseline's tolerances")
        for key, what in (
            ("missing_cases", "in the baseline, but not in this batch"),
            ("new_cases", "not in the baseline, so not compared"),
            ("missing_studies", "in the baseline, but not studied"),
            ("new_studies", "not in the baseline, so not compared"),
        ):
            if drift[key]:
                terminal.say(f"{what}: {_listed(drift[key])}")
    counts = dict(result["counts"])
    total = counts.pop("cases")
    parts = ", ".join(f"{number} {what}" for what, number in counts.items() if number)
    terminal.say(f"{total} case{'s' * (total > 1)}: {parts}")


def _listed(names: Sequence[str], most: int = 10) -> str:
    """Up to ``most`` names, and the number of the others."""
    rest = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + rest


def _write(path: Path, text: str) -> None:
    make_folder(path.parent)
    write_text(path, text)
