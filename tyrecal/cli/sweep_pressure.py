"""tyrecal sweep-pressure"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from . import arguments, options
from .default_case import default_case
from .main import EXIT_SOLVER
from .parameters import option


@click.command()
@options.every(options.case_or_last, options.assignments)
@options.pressures
@options.fitted(" and the initial one")
@option("--pictures/--no-pictures", default=True, help="Draw frequencies over pressure.")
@options.scheduler
@options.figure_format
@options.study
def command(
    case: Path | None,
    assignments: tuple[str, ...],
    from_kPa: float | None,
    to_kPa: float | None,
    steps: int,
    fitted: Path | None,
    pictures: bool,
    scheduler: str,
    study: options.Study,
) -> int:
    """Follow every mode of CASE over the inflation pressure, by default from 5/12 to 4/3 times the
    case's.

    Writes pressure_sweep.json, .csv and .png: frequencies, their sensitivities d ln f / d ln p,
    findings in words, and the standard errors of a fitted design's frequencies. --set NAME=VALUE on
    a variable changes the initial design, on any other number both designs. Without CASE, the case
    is that of the last fit here, or the only one here. A fitted design is swept too.

    \b
    tyrecal sweep-pressure
    tyrecal sweep-pressure cases/p235_75r17.yaml
    tyrecal sweep-pressure cases/p235_75r17.yaml --fitted p235_75r17/fit.json --jobs 2
    tyrecal sweep-pressure cases/p235_75r17.yaml --from-kPa 180 --to-kPa 260 --steps 5 --json
    """
    from ..simulate.evaluate.cluster import reached
    from ..studies.fit.prediction import read_responses
    from ..studies.fit.targets import read_targets
    from ..studies.pressure_result import FITTED, run
    from ..studies.run_plan import plan_evaluations
    from ..tyre.state import pressure_name, rim_of

    terminal = study.terminal
    options.not_both(study.jobs, scheduler)
    case, fitted, study = default_case(case, fitted, study)
    loaded, values = study.load(case, assignments)
    pressures = _pressures(loaded, assignments, from_kPa, to_kPa, steps, study.allow_unusual)
    evaluator = study.evaluator(loaded)
    designs, fit = {"initial": values}, None
    if fitted:
        designs[FITTED] = arguments.fitted_values(fitted, loaded, terminal)
        fit = read_responses(fitted)
    name = pressure_name(loaded)
    states = [{**each, name: p} for each in designs.values() for p in pressures]
    plan = plan_evaluations(loaded, evaluator, states, int(evaluator.has_gradients), study.jobs)
    output = study.run(loaded, "sweep-pressure", evaluator, plan=plan, pressure_kPa=pressures)
    with terminal.progress("sweep") as bar, reached(scheduler) as evaluator.scheduler:
        evaluator.on_progress = bar.at
        result = run(loaded, evaluator, designs, pressures, study.jobs, study.notify, fit)
    if not result.rows:
        return EXIT_SOLVER
    if result.standard_errors_unknown:
        terminal.warn(f"no intervals of the fitted design: {result.standard_errors_unknown}")
    figures = {}
    if pictures:
        from ..report.pressure import draw_pressure_sweep

        measured = [(each, each.state.with_defaults(loaded)) for each in read_targets(loaded)]
        rim = rim_of(loaded)
        targets = [
            (each.label, state.pressure_kPa or 0.0, each.frequency_Hz)
            for each, state in measured
            if state.rim == rim
        ]
        figures["pressure_sweep"] = draw_pressure_sweep(result.rows, targets)
    return study.present(output, result, figures)


def _pressures(
    loaded: Any,
    assignments: tuple[str, ...],
    low: float | None,
    high: float | None,
    steps: int,
    allow_unusual: bool,
) -> list[float]:
    """The pressures of the sweep, kPa. Raises click.UsageError."""
    from ..tyre.state import pressure_name
    from ..tyre.values import with_values

    name = pressure_name(loaded)
    arguments.refuse_set(assignments, name, "--from-kPa and --to-kPa")
    pressures = arguments.parse_pressures(low, high, steps, allow_unusual).on(loaded)
    for end, value in (("--from-kPa", pressures[0]), ("--to-kPa", pressures[-1])):
        try:
            with_values(loaded, {name: value})
        except InputError as error:
            raise click.UsageError(f"{end} {value:g}: {error}") from None
    return pressures
