"""tyrecal modes"""

from __future__ import annotations

from pathlib import Path

import click

from . import arguments, options
from .loaded_modes import at_load, over_loads, wanted_loads


@click.command()
@options.every(
    options.case_argument,
    options.assignments,
    options.pressure,
    options.one_load,
    options.sweep_load,
    options.fitted("With --sweep-load: the design that 'tyrecal fit' found for this case, too."),
)
@click.option(
    "--pictures/--no-pictures",
    default=None,
    help="Draw the section and each mode (default: no); with --sweep-load the frequencies"
    " over the load (default: yes).",
)
@options.study
def command(
    case: Path,
    assignments: tuple[str, ...],
    pressure_kPa: float | None,
    load_N: float | None,
    sweep: str | None,
    fitted: Path | None,
    pictures: bool | None,
    study: options.Study,
) -> int:
    """Evaluate one design of CASE: frequencies with their labels, in modes.json.

    With --load-N the tyre stands on a flat road, and vibrates about its deflected state while the
    patch is held: doublets split in a member symmetric about the patch and an antisymmetric one.
    --sweep-load follows them over the load: load_sweep.json, .csv and .png.

    \b
    tyrecal modes cases/p235_75r17.yaml --set A_belt=3e-7 --pressure-kPa 200
    tyrecal modes cases/p235_75r17.yaml --set rebar_layers.belt_1.angle_deg=68 --json
    tyrecal modes cases/p235_75r17.yaml --load-N 4000
    tyrecal modes cases/p235_75r17.yaml --sweep-load 0,1000,2000,4000 --fitted p235_75r17/fit.json
    """
    from ..report.shape_data import tyre_data
    from ..simulate.evaluate.evaluator import Question
    from ..studies.modes import modes_result

    loads = wanted_loads(load_N, sweep)
    if fitted and sweep is None:
        raise click.UsageError("--fitted goes with --sweep-load")
    if pictures and load_N is not None:
        raise click.UsageError("--pictures goes with --sweep-load, or without a load")
    terminal = study.terminal
    if not fitted:
        why = "one design is evaluated alone; --sweep-load with --fitted has two"
        options.say_idle(terminal, study.jobs, why)
    loaded, values = study.load(case, assignments, pressure_kPa)
    evaluator = study.evaluator(loaded)
    designs = {"initial": values}
    option = "--load-N" if sweep is None else "--sweep-load"
    arguments.refuse_unusual_loads(loaded, option, loads, study.allow_unusual)
    if loads:
        evaluator.needs_road(modes=True)
    if fitted:
        designs["fitted"] = arguments.fitted_values(fitted, loaded, terminal)
    if sweep is not None:
        run = study.run(loaded, "modes", evaluator, "sweep-load", load_N=loads)
        draw = pictures is not False
        return over_loads(loaded, evaluator, run, designs, loads, study, draw)
    run = study.run(loaded, "modes", evaluator, load_N=loads[0] if loads else 0.0)
    if loads:
        return at_load(loaded, evaluator, run, values, loads[0], study)
    evaluation = evaluator.evaluate(Question(values))
    result, modes = modes_result(loaded, values, evaluation)
    result = run.write(result)
    run.write_json("modes_shapes.json", tyre_data(loaded, evaluation, modes))
    if pictures:
        from ..report.pictures import draw_evaluation

        draw_evaluation(run.new, "modes", loaded, evaluation, modes)
    run.finish()
    from ..report.table import shown
    from ..report.words import tyre_doubts

    terminal.result(result.content())
    terminal.show(shown(*result.tables()))
    for doubt in tyre_doubts(result.content()):
        terminal.warn(doubt)
    study.page(run)
    return 0
