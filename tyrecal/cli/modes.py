"""tyrecal modes; with --load-N or --sweep-load on the road"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import arguments, options
from .arguments import checked_loads, parse_loads
from .main import EXIT_SOLVER
from .options import Study
from .parameters import FileOrFolder, option

if TYPE_CHECKING:
    from ..tyre.case import LoadedCase


@click.command()
@options.every(
    options.case_argument,
    options.assignments,
    options.pressure,
    options.one_load,
    options.sweep_load,
    options.wheel,
    options.fitted("; with --sweep-load the initial one too"),
)
@option(
    "--measured",
    type=FileOrFolder(exists=True, folder=False),
    metavar="FILE",
    help="Measurements (CSV) to compare with, at the pressure of the modes, without a load.",
)
@option(
    "--pictures/--no-pictures",
    default=None,
    help="Draw the section and the modes (default: no); with --sweep-load the frequencies"
    " over the load (default: yes).",
)
@options.figure_format
@options.study
def command(
    case: Path,
    load_N: float | None,
    sweep: str | None,
    wheel: str | None,
    measured: Path | None,
    study: options.Study,
) -> int:
    """Evaluate one design of CASE: frequencies with their labels, in modes.json.

    With --load-N the tyre is on a flat road, and vibrates about its deflected state. The contact
    patch sticks to the road. Pairs split into a member symmetric about the patch and an
    antisymmetric one. sliding_Hz is the frequency if nothing holds the patch along the road.
    grip_mm is the largest motion of the crown before the patch slides. --sweep-load follows the
    modes over the load: load_sweep.json, .csv and .png. --measured compares a design with data to
    which it was not fitted.

    \b
    tyrecal modes cases/p235_75r17.yaml --set A_belt=3e-7 --pressure-kPa 200
    tyrecal modes cases/p235_75r17.yaml --set rebar_layers.belt_1.angle_deg=68 --json
    tyrecal modes my.yaml --fitted my --pressure-kPa 300 --measured at_300.csv
    tyrecal modes cases/p235_75r17.yaml --fitted p235_75r17 --load-N 4000
    tyrecal modes cases/p235_75r17.yaml --sweep-load 0,1000,2000,4000 --fitted p235_75r17/fit.json
    """
    from ..report.shape_data import tyre_data
    from ..studies import modes as studies
    from ..studies.run_plan import PlannedState, plan_evaluations, plan_runs
    from ..tyre.effects.edit import changed, with_part

    loads = requested_loads(load_N, sweep)
    if wheel and not loads:
        raise click.UsageError("--wheel goes with --load-N or --sweep-load")
    if study.pictures and load_N is not None:
        raise click.UsageError("--pictures goes with --sweep-load, or without a load")
    if measured and loads:
        raise click.UsageError("--measured goes without a load")
    terminal = study.terminal
    if not (study.fitted and sweep):
        study.say_idle("only one design is evaluated; --sweep-load with --fitted evaluates two")
    loaded, values = study.load(case)
    if sweep is None:
        loaded, values = study.one_design(loaded)
    if measured:
        from ..measured.targets import with_measured

        loaded, _ = with_measured(loaded, measured)
    if wheel:
        road = with_part(loaded.case.road, wheel=wheel.replace("-", "_"))
        loaded = changed(loaded, road=road)
    evaluator = study.evaluator(loaded)
    designs = {"initial": values}
    option = "--load-N" if sweep is None else "--sweep-load"
    arguments.refuse_unusual_loads(loaded, option, loads, study.allow_unusual)
    if loads:
        evaluator.needs_road(modes=True)
    if sweep is not None:
        designs |= study.fitted_values(loaded)
    plan = plan_evaluations(loaded, evaluator, [values])
    if loads:
        pressed_to = [PlannedState(sum(load > 0 for load in loads), modes=True)]
        plan = plan_runs(loaded, evaluator, pressed_to, len(designs), study.jobs)
    if sweep is not None:
        run = study.run(loaded, "modes", evaluator, "sweep-load", plan=plan, load_N=loads)
        planned = replace(study, jobs=plan.at_once)
        return write_load_sweep(loaded, evaluator, run, designs, loads, planned)
    files, load = [measured] if measured else [], loads[0] if loads else 0.0
    run = study.run(loaded, "modes", evaluator, measured=files, plan=plan, load_N=load)
    if loads:
        return write_modes_at_load(loaded, evaluator, run, values, loads[0], study)
    result, evaluation, modes = studies.run(loaded, evaluator, values)
    if measured:
        result = result.compared(loaded)
    lossy = any(getattr(m, "loss_factor", None) for m in loaded.case.materials.values())
    if lossy and all(mode.damping_ratio is None for mode in result.modes):
        name = evaluator.solver.name
        terminal.note(f"solver '{name}' computes no damping: loss factors have no effect")
    result = run.write(result)
    run.write_json("modes_shapes.json", tyre_data(loaded, evaluation, modes))
    if study.pictures:
        from ..report.pictures import draw_evaluation

        draw_evaluation(run.new, "modes", loaded, evaluation, modes, run.figure_format)
    run.finish()
    from ..report.table import nearness, shown, tyre_doubts

    terminal.result(result.content())
    terminal.show(shown(*result.tables()))
    if compared := [mode.model_dump() for mode in result.modes if mode.measured_Hz]:
        terminal.say(f"{nearness(compared)}.")
    for doubt in tyre_doubts(result.content()):
        terminal.warn(doubt)
    study.page(run)
    return 0


def requested_loads(load_N: float | None, sweep: str | None) -> list[float]:
    """The requested loads, N; empty: only the unloaded tyre. Raises click.UsageError."""
    if load_N is not None and sweep is not None:
        raise click.UsageError("give --load-N or --sweep-load, not both")
    if sweep is not None:
        loads = parse_loads(sweep, "--sweep-load", zero=True)
        if loads == [0.0]:
            raise click.UsageError("--sweep-load needs a load above 0")
        return loads
    return [] if load_N is None else checked_loads([load_N], "--load-N")


def write_modes_at_load(
    loaded: LoadedCase,
    evaluator: Any,
    run: Any,
    values: Mapping[str, float],
    load_N: float,
    study: Study,
) -> int:
    """Write the modes under one load to modes.json, and their shapes to modes_shapes.json. Raises
    EvaluationFailed."""
    from ..report.shape_data import loaded_data
    from ..report.table import shown
    from ..studies.loaded import LoadedTyre, load_tyres
    from ..studies.loaded_result import loaded_modes_result

    terminal = study.terminal
    with terminal.progress(f"modes at {load_N:g} N") as bar:
        evaluator.on_progress = bar.at
        outcome = load_tyres(loaded, evaluator, {"initial": values}, [load_N])["initial"]
    if not isinstance(outcome, LoadedTyre):
        raise outcome
    result = run.write(loaded_modes_result(values, outcome))
    run.write_json("modes_shapes.json", loaded_data(outcome, loaded))
    run.finish()
    terminal.result(result.content())
    terminal.show(shown(*result.tables()))
    for sentence in result.sentences():
        terminal.say(sentence)
    study.page(run)
    return 0


def write_load_sweep(
    loaded: LoadedCase,
    evaluator: Any,
    output: Any,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    study: Study,
) -> int:
    """Write the modes over the load to load_sweep.json, .csv and .png."""
    from ..studies.loaded_result import run

    with study.terminal.progress("modes on the road") as bar:
        evaluator.on_progress = bar.at
        result = run(loaded, evaluator, designs, loads_N, study.jobs, study.notify)
    if not result.rows:
        return EXIT_SOLVER
    figures = {}
    if study.pictures is not False:
        from ..report.frequencies import draw_load_sweep

        figures["load_sweep"] = draw_load_sweep(result.rows)
    return study.present(output, result, figures)
