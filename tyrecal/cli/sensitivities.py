"""tyrecal sensitivities"""

from __future__ import annotations

from pathlib import Path

import click

from . import arguments, complete, options
from .parameters import FileOrFolder, names_option, option


@click.command()
@options.every(options.case_argument, options.assignments, options.pressure)
@names_option(
    "--by",
    metavar="NAME|PATH",
    shell_complete=complete.numbers,
    help="Variable, or path of a number of the case; several with commas, or repeatable (default:"
    " all that are not 0). Example: C10,rebar_layers.belt_1.angle_deg.",
)
@names_option(
    "--of",
    "kinds",
    metavar="QUANTITY",
    help="frequency (default), mass, contact_area, contact_length, contact_width or"
    " vertical_stiffness; repeatable.",
)
@option(
    "--loads-N",
    "loads",
    metavar="F1,F2,...",
    help="Loads of quantities on the road, N, rising (default: those of the case's targets, or the"
    " middle one of road.loads_N).",
)
@option(
    "--measured",
    type=FileOrFolder(exists=True, folder=False),
    metavar="FILE",
    help="Measurements (CSV), to select the numbers worth freeing in a fit (default: the file of"
    " the case's targets).",
)
@options.fitted()
@option("--pictures/--no-pictures", default=True, help="Draw the heat map.")
@options.figure_format
@options.study
def command(
    case: Path,
    by: tuple[str, ...],
    kinds: tuple[str, ...],
    loads: str | None,
    measured: Path | None,
    study: options.Study,
) -> int:
    """State how each number of CASE moves the frequencies: d ln f / d ln x, exact, from one
    evaluation. Angles and numbers that are 0: d ln f / d x, per degree or unit.

    Writes sensitivities.json, .csv and .png. With measurements it selects the uncertain numbers
    that, freed in a fit within what is known of them, reduce the deviations most, and stops where
    the next gain is no better than chance. Free them with: tyrecal fit --free.

    \b
    tyrecal sensitivities cases/p235_75r17.yaml
    tyrecal sensitivities cases/p235_75r17.yaml --by pressure_kPa --by C10 --of vertical_stiffness
    tyrecal sensitivities cases/205_60r15.yaml --measured cases/205_60r15_mf_swift.csv
    """
    from ..studies.result import StudyInput
    from ..studies.sensitivities.deviations import measured_values
    from ..studies.sensitivities.result import SensitivitiesResult, loads_on_road, planned
    from ..studies.sensitivities.table import kinds_of, needs_gradients, numbers_of

    loaded, values = study.load(case)
    kinds_of(kinds), numbers_of(loaded, by)
    loads_N = None
    if loads is not None:
        loads_N = arguments.parse_loads(loads)
        arguments.refuse_unusual_loads(loaded, "--loads-N", loads_N, study.allow_unusual)
        if not loads_on_road(loaded, kinds, loads_N):
            raise click.UsageError(f"--loads-N {loads}: give --of a quantity on the road too")
    evaluator = study.evaluator(loaded)
    needs_gradients(evaluator)
    # numbers are selected about the initial design: a fitted one contains the data already
    designs = {"initial": values, **study.fitted_values(loaded)}
    file = measured or loaded.measured
    if measured:
        measured_values(loaded, measured)
    on_road = loads_on_road(loaded, kinds, loads_N)
    files = [file] if file else []
    given = StudyInput(loaded, evaluator, designs, jobs=study.jobs)
    plan = planned(given, numbers_of(loaded, by), on_road, file) if study.dry_run else None
    load = on_road or 0.0
    output = study.run(loaded, "sensitivities", evaluator, measured=files, plan=plan, load_N=load)
    with study.terminal.progress("sensitivities") as bar:
        evaluator.on_progress = bar.at
        result = SensitivitiesResult.run(given, by=by, of=kinds, loads_N=loads_N, measured=measured)
    figures = {}
    if study.pictures:
        from ..report.sensitivities import figures as drawn

        figures = drawn(result)
    return study.present(output, result, figures)
