"""tyrecal footprint"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from . import arguments, options
from .default_case import default_case
from .main import EXIT_SOLVER
from .parameters import option
from .terminal import Terminal

DESIGNS = ("initial", "fitted")


@click.command()
@options.every(options.case_or_last, options.assignments, options.pressure, options.loads)
@options.fitted(" and the initial one")
@option(
    "--compare",
    metavar="initial,fitted",
    help="Designs to press (default: initial, and fitted with --fitted).",
)
@option("--pictures/--no-pictures", default=True, help="Draw the patches; write VTU.")
@options.figure_format
@options.study
def command(
    case: Path | None,
    assignments: tuple[str, ...],
    pressure_kPa: float | None,
    loads: str | None,
    fitted: Path | None,
    compare: str | None,
    pictures: bool,
    study: options.Study,
) -> int:
    """Press the tyre of CASE on a flat road, load after load.

    Writes footprint.json, .csv and .png: contact area, length, width, mean and peak pressure,
    deflection and vertical stiffness; the pressure in the patch as a picture, the deformed tyre as
    VTU. --set NAME=VALUE on a variable changes the initial design, on any other number both
    designs. Without CASE, the case is that of the last fit here, or the only one here. A fitted
    design is pressed too.

    \b
    tyrecal footprint
    tyrecal footprint cases/p235_75r17.yaml --dry-run
    tyrecal footprint cases/p235_75r17.yaml --fitted p235_75r17/fit.json --jobs 2
    tyrecal footprint cases/p235_75r17.yaml --loads-N 3000,5000 --set road.friction=0 --json
    """
    from ..report.shape_data import patches_data
    from ..studies.footprint import run
    from ..studies.run_plan import PlannedState, plan_runs

    terminal = study.terminal
    case, fitted, study = default_case(case, fitted, study)
    if loads is not None:
        arguments.refuse_set(assignments, "road.loads_N", "--loads-N")
    loaded, values = study.load(case, assignments, pressure_kPa)
    loads_N = loaded.case.loads_N
    if loads is not None:
        loads_N = arguments.parse_loads(loads)
        arguments.refuse_unusual_loads(loaded, "--loads-N", loads_N, study.allow_unusual)
    evaluator = study.evaluator(loaded)
    evaluator.needs_road()
    fitted = _fit_compared(compare, fitted, (study.output or Path(case.stem)) / "fit.json")
    designs = _designs(compare, values, fitted, loaded, terminal)
    if len(designs) == 1:
        options.say_idle(terminal, study.jobs, "one design is pressed alone; --fitted adds another")
    pressed_to = [PlannedState(len(loads_N))]
    plan = plan_runs(loaded, evaluator, pressed_to, len(designs), study.jobs)
    output = study.run(loaded, "footprint", evaluator, plan=plan, load_N=loads_N)
    with terminal.progress("footprint") as bar:
        evaluator.on_progress = bar.at
        result, pressed, meshes = run(
            loaded, evaluator, designs, loads_N, plan.at_once, study.notify
        )
    if not pressed:
        return EXIT_SOLVER
    patches = patches_data(loaded.case.name, pressed, meshes)
    output.write_json("footprint_patches.json", patches)
    figures = {}
    if pictures:
        from ..report.footprint import draw_footprint
        from ..report.vtu import write_pressed

        figures = draw_footprint(result.rows, patches.patches)
        write_pressed(output.new, pressed, meshes)
    return study.present(output, result, figures)


def _fit_compared(compare: str | None, fitted: Path | None, own: Path) -> Path | None:
    """The fit to press: as given, else the one in the results folder where it is requested. Raises
    click.UsageError."""
    if fitted or "fitted" not in (compare or "").split(","):
        return fitted
    if not own.exists():
        raise click.UsageError(f"--compare fitted needs --fitted fit.json: there is no '{own}'")
    return own


def _designs(
    compare: str | None,
    values: dict[str, float],
    fitted: Path | None,
    loaded: Any,
    terminal: Terminal,
) -> dict[str, dict[str, float]]:
    """Values of the variables by design. Raises click.UsageError."""
    names = DESIGNS[: 2 if fitted else 1] if compare is None else tuple(compare.split(","))
    for name in names:
        arguments.refuse_unknown("--compare", name, DESIGNS, "design")
    if len(set(names)) < len(names):
        raise click.UsageError("--compare: a design is named twice")
    designs = {"initial": values}
    if fitted and "fitted" in names:
        designs["fitted"] = arguments.fitted_values(fitted, loaded, terminal)
    return {name: designs[name] for name in names}
