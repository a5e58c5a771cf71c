"""tyrecal footprint"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from . import arguments, options
from .default_case import default_case
from .main import EXIT_SOLVER
from .parameters import option

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
def command(case: Path | None, loads: str | None, compare: str | None, study: options.Study) -> int:
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
    case, study = default_case(case, study)
    if loads is not None:
        arguments.refuse_set(study.assignments, "road.loads_N", "--loads-N")
    loaded, values = study.load(case)
    loads_N = loaded.case.loads_N
    if loads is not None:
        loads_N = arguments.parse_loads(loads)
        arguments.refuse_unusual_loads(loaded, "--loads-N", loads_N, study.allow_unusual)
    evaluator = study.evaluator(loaded)
    evaluator.needs_road()
    study = _with_fit_compared(compare, study, (study.output or Path(case.stem)) / "fit.json")
    designs = _designs(compare, values, study, loaded)
    if len(designs) == 1:
        study.say_idle("one design is pressed alone; --fitted adds another")
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
    if study.pictures:
        from ..report.footprint import draw_footprint
        from ..report.vtu import write_pressed

        figures = draw_footprint(result.rows, patches.patches)
        write_pressed(output.new, pressed, meshes)
    return study.present(output, result, figures)


def _with_fit_compared(compare: str | None, study: options.Study, own: Path) -> options.Study:
    """The study with the fit to press: as given, else the one in the results folder where it is
    requested. Raises click.UsageError."""
    if study.fitted or "fitted" not in (compare or "").split(","):
        return study
    if not own.exists():
        raise click.UsageError(f"--compare fitted needs --fitted fit.json: there is no '{own}'")
    return replace(study, fitted=own)


def _designs(
    compare: str | None, values: dict[str, float], study: options.Study, loaded: Any
) -> dict[str, dict[str, float]]:
    """Values of the variables by design. Raises click.UsageError."""
    names = DESIGNS[: 2 if study.fitted else 1] if compare is None else tuple(compare.split(","))
    for name in names:
        arguments.refuse_unknown("--compare", name, DESIGNS, "design")
    if len(set(names)) < len(names):
        raise click.UsageError("--compare: a design is named twice")
    designs = {"initial": values}
    if "fitted" in names:
        designs |= study.fitted_values(loaded)
    return {name: designs[name] for name in names}
