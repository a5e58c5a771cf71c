"""tyrecal modes"""

from __future__ import annotations

from pathlib import Path

import click

from . import options


@click.command()
@options.every(
    options.case_argument,
    options.assignments,
    options.pressure,
    options.mesh,
    options.solver,
    options.output,
    options.store,
    options.no_store,
    options.as_json,
    options.quiet,
    options.verbose,
)
@click.option("--pictures/--no-pictures", default=False, help="Draw the section and each mode.")
def command(
    case: Path,
    assignments: tuple[str, ...],
    pressure_kPa: float | None,
    mesh: str,
    solver: str,
    output: Path | None,
    store: Path | None,
    no_store: bool,
    as_json: bool,
    quiet: bool,
    verbose: bool,
    pictures: bool,
) -> int:
    """Evaluate one design of CASE: frequencies with their labels, in modes.json.

    \b
    tyrecal modes cases/p235_75r17.yaml --set A_belt=3e-7 --pressure-kPa 200
    tyrecal modes cases/p235_75r17.yaml --set rebar_layers.belt_1.angle_deg=68 --json
    """
    from ..evaluate.door import Door, Question
    from ..studies.modes import modes_result
    from .output import Run, print_json, show

    loaded, values = options.load(case, mesh, assignments, pressure_kPa)
    door = Door(loaded, solver)
    adapter = door.solver
    run = Run(case, output, "modes", adapter)
    door.folder, door.keep = run.runs, verbose
    door.store = run.open_store(store, no_store)
    evaluation = door.evaluate(Question(values))
    result, modes = modes_result(loaded, values, evaluation)
    run.write_json("modes.json", result)
    if pictures:
        from ..report.pictures import draw_evaluation

        draw_evaluation(run.folder, loaded, evaluation, modes)
    run.finish(solver_runs=door.counts.runs, answered_from_record=door.counts.recorded)
    if as_json:
        print_json(result)
    else:
        from ..report.table import modes_table

        show(modes_table(result), as_json, quiet)
    return 0
