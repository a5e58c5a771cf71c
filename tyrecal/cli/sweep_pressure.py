"""tyrecal sweep-pressure"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..errors import InputError
from ..studies.pressure_range import PressureRange
from . import arguments, options
from .default_case import default_case
from .main import EXIT_SOLVER
from .parameters import option


@click.command()
@options.every(options.case_or_last, options.assignments)
@options.pressures
@options.packed("pressures", PressureRange)
@options.fitted(" and the initial one")
@option("--pictures/--no-pictures", default=True, help="Draw frequencies over pressure.")
@options.scheduler
@options.figure_format
@options.study
def command(case: Path | None, pressures: PressureRange, study: options.Study) -> int:
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
    from ..studies.pressure_result import run
    from ..studies.run_plan import plan_evaluations
    from ..tyre.state import pressure_name, rim_of

    terminal = study.terminal
    study.refuse_two_machines()
    case, study = default_case(case, study)
    loaded, values = study.load(case)
    kPa = _pressures(loaded, pressures, study)
    evaluator = study.evaluator(loaded)
    designs = {"initial": values, **study.fitted_values(loaded)}
    fit = read_responses(study.fitted) if study.fitted else None
    name = pressure_name(loaded)
    states = [{**each, name: p} for each in designs.values() for p in kPa]
    plan = plan_evaluations(loaded, evaluator, states, int(evaluator.has_gradients), study.jobs)
    output = study.run(loaded, "sweep-pressure", evaluator, plan=plan, pressure_kPa=kPa)
    with terminal.progress("sweep") as bar, reached(study.scheduler) as evaluator.scheduler:
        evaluator.on_progress = bar.at
        result = run(loaded, evaluator, designs, kPa, study.jobs, study.notify, fit)
    if not result.rows:
        return EXIT_SOLVER
    if result.standard_errors_unknown:
        terminal.warn(f"no intervals of the fitted design: {result.standard_errors_unknown}")
    figures = {}
    if study.pictures:
        from ..report.frequencies import draw_pressure_sweep

        measured = [(each, each.state.with_defaults(loaded)) for each in read_targets(loaded)]
        rim = rim_of(loaded)
        targets = [
            (each.label, state.pressure_kPa or 0.0, each.frequency_Hz)
            for each, state in measured
            if state.rim == rim
        ]
        figures["pressure_sweep"] = draw_pressure_sweep(result.rows, targets)
    return study.present(output, result, figures)


def _pressures(loaded: Any, pressures: PressureRange, study: options.Study) -> list[float]:
    """The pressures of the sweep, kPa. Raises click.UsageError."""
    from ..tyre.state import pressure_name
    from ..tyre.values import with_values

    name = pressure_name(loaded)
    arguments.refuse_set(study.assignments, name, "--from-kPa and --to-kPa")
    kPa = arguments.checked_pressures(pressures, study.allow_unusual).on(loaded)
    for end, value in (("--from-kPa", kPa[0]), ("--to-kPa", kPa[-1])):
        try:
            with_values(loaded, {name: value})
        except InputError as error:
            raise click.UsageError(f"{end} {value:g}: {error}") from None
    return kPa
