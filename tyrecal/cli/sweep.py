"""tyrecal sweep"""

from __future__ import annotations

from pathlib import Path

import click

from . import arguments, complete, options
from .parameters import WholeNumber, option


@click.command()
@options.case_argument
@click.argument("ranges", nargs=-1, metavar="[NAME=A:B:N]...", shell_complete=complete.assignments)
@options.every(options.assignments, options.pressure)
@option(
    "--latin-hypercube",
    type=WholeNumber(2, 10_000),
    metavar="N",
    help="Number of points of a Latin hypercube within ranges NAME=A:B (default: a grid; without"
    " ranges 10 points for each variable).",
)
@options.seed("the Latin hypercube", 2**32 - 1)
@options.fitted()
@option("--pictures/--no-pictures", default=True, help="Draw frequencies over each number.")
@options.scheduler
@options.figure_format
@options.study
def command(
    case: Path,
    ranges: tuple[str, ...],
    latin_hypercube: int | None,
    seed: int,
    study: options.Study,
) -> int:
    """Evaluate CASE over ranges of its numbers: all combinations of N values from A to B of each,
    or a Latin hypercube. NAME is a variable or the path of a number; values are in its unit.

    Writes sweep.json, .csv (a line for each point and mode), _modes.csv and .png. Without ranges it
    samples all variables within 10 % of their values. Run the same command again to resume: the
    evaluation store has all points that are done.

    \b
    tyrecal sweep cases/p235_75r17.yaml C10=8e5:1.2e6:5 pressure_kPa=180:280:3 --jobs 2
    tyrecal sweep cases/p235_75r17.yaml rebar_layers.belt_1.angle_deg=60:70:6
    tyrecal sweep my.yaml C10=8e5:1.2e6 A_belt=2e-7:4e-7 --latin-hypercube 200 --seed 1
    """
    from ..simulate.evaluate.cluster import reached
    from ..studies.result import StudyInput
    from ..studies.run_plan import plan_evaluations
    from ..studies.sweep import DEFAULT_POINTS, grid, read_ranges, swept_state
    from ..studies.sweep_result import run
    from ..tyre.state import pressure_name

    study.refuse_two_machines()
    if "--seed" in options.given() and ranges and not latin_hypercube:
        raise click.UsageError("--seed has no effect on a grid: give --latin-hypercube too")
    loaded, _ = study.load(case)
    sampled = bool(latin_hypercube) or not ranges
    swept = read_ranges(loaded, ranges, sampled, study.allow_unusual)
    for each in swept:
        arguments.refuse_set(study.assignments, each.name, "the ranges")
        if study.pressure_kPa is not None and each.name == pressure_name(loaded):
            raise click.UsageError(f"--pressure-kPa {study.pressure_kPa:g}: {each.name} is swept")
    loaded, values = study.one_design(loaded)
    evaluator = study.evaluator(loaded)
    designs = {"fitted" if study.fitted else "initial": values}
    given = StudyInput(loaded, evaluator, designs, jobs=study.jobs)
    count = latin_hypercube or DEFAULT_POINTS * len(swept)
    points = [{each.name: each.low for each in swept}] * count if sampled else grid(swept)
    states = [{**values, **point} for point in points]
    plan = plan_evaluations(loaded, evaluator, states, at_once=study.jobs)
    state = swept_state(loaded, swept)
    output = study.run(loaded, "sweep", evaluator, plan=plan, **state)
    with study.terminal.progress("sweep") as bar, reached(study.scheduler) as evaluator.scheduler:
        evaluator.on_progress = bar.at
        result = run(given, swept, sampled, latin_hypercube or 0, seed, study.notify)
    figures = {}
    if study.pictures:
        from ..report.sweep import figures as drawn

        figures = drawn(result)
    return study.present(output, result, figures)
