"""tyrecal stiffness"""

from __future__ import annotations

from pathlib import Path

import click

from . import arguments, options
from .default_case import default_case
from .main import EXIT_SOLVER
from .parameters import option


@click.command()
@options.every(options.case_or_last, options.assignments, options.loads)
@option(
    "--pressure-kPa",
    "pressures",
    metavar="P1,P2,...",
    help="Inflation pressures, kPa (default: the case's). Example: 200,240.",
)
@options.fitted(" and the initial one")
@option("--pictures/--no-pictures", default=True, help="Draw the stiffnesses over the load.")
@options.figure_format
@options.study
def command(
    case: Path | None, loads: str | None, pressures: str | None, study: options.Study
) -> int:
    """Find the vertical, lateral, longitudinal and torsional stiffness of the tyre of CASE on a
    flat road, over load and pressure.

    Writes stiffness.json, .csv and .png, with radii, deflection, length and width of the patch.
    Each is the sensitivity of a force at the rim to its motion while the patch is held. All but the
    vertical one are at constant load: the axle's height follows. --set NAME=VALUE on a variable
    changes the initial design, on any other number both designs. Without CASE, the case is that of
    the last fit here, or the only one here.

    \b
    tyrecal stiffness cases/205_60r15.yaml --loads-N 2000,4000,6000
    tyrecal stiffness cases/205_60r15.yaml --loads-N 4000 --pressure-kPa 200,220,240 --jobs 2
    tyrecal stiffness cases/p235_75r17.yaml --fitted p235_75r17 --dry-run
    """
    from ..studies.run_plan import PlannedState, plan_runs
    from ..studies.stiffness import run

    terminal = study.terminal
    case, study = default_case(case, study)
    if loads is not None:
        arguments.refuse_set(study.assignments, "road.loads_N", "--loads-N")
    if pressures is not None:
        arguments.refuse_set(study.assignments, "pressure_kPa", "--pressure-kPa")
    loaded, values = study.load(case)
    loads_N = loaded.case.loads_N
    if loads is not None:
        loads_N = arguments.parse_loads(loads)
        arguments.refuse_unusual_loads(loaded, "--loads-N", loads_N, study.allow_unusual)
    kPa = [loaded.case.pressure_kPa]
    if pressures is not None:
        kPa = arguments.parse_pressure_list(
            "--pressure-kPa", loaded, pressures, study.allow_unusual
        )
    evaluator = study.evaluator(loaded)
    evaluator.needs_road(rim_stiffness=True)
    designs = {"initial": values, **study.fitted_values(loaded)}
    pressed_to = [PlannedState(len(loads_N), rim_stiffness=True) for _ in kPa]
    plan = plan_runs(loaded, evaluator, pressed_to, len(designs), study.jobs)
    state = {"load_N": loads_N, "pressure_kPa": kPa}
    output = study.run(loaded, "stiffness", evaluator, plan=plan, **state)
    with terminal.progress("stiffness") as bar:
        evaluator.on_progress = bar.at
        result = run(loaded, evaluator, designs, loads_N, kPa, plan.at_once, study.notify)
    if not result.rows:
        return EXIT_SOLVER
    figures = {}
    if study.pictures:
        from ..report.footprint import stiffness_figures as drawn

        figures = drawn(result)
    return study.present(output, result, figures)
