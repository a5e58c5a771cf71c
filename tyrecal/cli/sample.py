"""tyrecal sample"""

from __future__ import annotations

from pathlib import Path

import click

from . import arguments, options
from .parameters import FileOrFolder, Number, WholeNumber, option


@click.command()
@options.every(options.case_argument, options.assignments, options.pressure)
@option(
    "--measured",
    type=FileOrFolder(exists=True, folder=False),
    metavar="FILE",
    help="Measurements (CSV) in place of the case's targets, at any pressures and on any rims.",
)
@option(
    "--draws",
    type=WholeNumber(1000, 10_000_000),
    default=100_000,
    metavar="N",
    show_default=True,
    help="Number of draws; up to 20 times as many are made, until the chains are 20"
    " autocorrelation times long.",
)
@options.seed("the draws", 2**32 - 1)
@option(
    "--at-kPa",
    "at_kPa",
    type=Number(),
    multiple=True,
    metavar="P",
    help="Pressure at which frequencies are predicted, kPa; repeatable (default: a fifth below and"
    " above the case's).",
)
@option("--pictures/--no-pictures", default=True, help="Draw the corner picture.")
@options.figure_format
@options.study
def command(
    case: Path,
    measured: Path | None,
    draws: int,
    seed: int,
    at_kPa: tuple[float, ...],
    study: options.Study,
) -> int:
    """Sample the variables of CASE that fit the measurements, and predict frequencies with 90 %
    intervals. Sigmas and the case's uncertainties are the assumptions.

    Writes sample.json, sample.csv (frequencies), sample_draws.csv and a corner picture. An
    emulator, usually of 60 to 100 evaluations, replaces the model; its error is reported. With a
    solver without exact sensitivities there are several times as many, which is printed first.
    Needs the package emcee: run pip install '.[sample]' in a clone of tyrecal.

    \b
    tyrecal sample cases/p235_75r17.yaml --measured cases/p235_75r17_wheeler.csv
    tyrecal sample my.yaml --measured measured.csv --at-kPa 180 --at-kPa 260 --jobs 2
    """
    from ..report.table import shown
    from ..studies.result import StudyInput
    from ..studies.sample.result import result
    from ..studies.sample.study import (
        SAMPLE_STAGES,
        check,
        measured_readings,
        modal,
        planned,
        run,
        states_sampled,
    )
    from .main import EXIT_FIT

    terminal = study.terminal
    loaded, _ = study.load(case)
    for pressure in at_kPa:
        arguments.refuse_unusual(
            loaded, f"--at-kPa {pressure:g}", "pressure_kPa", pressure, study.allow_unusual
        )
    measured = measured or loaded.measured
    readings = measured_readings(loaded, measured)
    evaluator = study.evaluator(loaded)
    check(loaded, readings)
    files = [measured] if measured else []
    states = states_sampled(loaded, readings)
    plan = planned(loaded, evaluator, readings, study.jobs) if study.dry_run else None
    output = study.run(loaded, "sample", evaluator, measured=files, plan=plan, **states)
    with terminal.progress("sample", SAMPLE_STAGES) as bar:
        evaluator.on_progress = bar.at
        given = StudyInput(loaded, evaluator, {}, jobs=study.jobs)
        sample = run(given, readings, draws, seed, at_kPa, bar.begin, terminal.note)
    summary = output.write(result(sample, seed))
    if study.pictures:
        from ..report.sample import figures

        output.write_figures(figures(summary))
    output.finish()
    terminal.result(summary.content())
    for table in summary.tables():
        terminal.show(shown(table))
    terminal.say("\n".join(summary.sentences()))
    # of readings only frequencies without a load are used
    if left_out := len(readings or ()) - len(modal(readings or ())):
        terminal.note(f"{measured}: {left_out} values are no frequencies of the unloaded tyre")
    doubts = summary.doubts()
    for doubt in doubts:
        terminal.warn(doubt)
    study.finish(output)
    return EXIT_FIT if doubts else 0
