"""tyrecal frf"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from . import arguments, options
from .parameters import FileOrFolder, Number, OneOf, option

if TYPE_CHECKING:
    from ..studies.response import ResponseForm


@dataclass(frozen=True)
class Functions:
    """The response functions to compute, by the options of `FrfResult.run`."""

    excite: str  # points of the force; "": default
    respond: str  # points of the response; "": default
    from_Hz: float
    to_Hz: float
    step_Hz: float
    patch_mm: float
    form: ResponseForm


@click.command()
@options.every(options.case_argument, options.assignments, options.pressure, options.one_load)
@option(
    "--excite",
    default="",
    metavar="POINT,...",
    help="Points of the tread where a force of 1 N acts: tread:ANGLEdeg:DIRECTION, radial,"
    " tangential or lateral (default: tread:0deg:radial, at a load tread:180deg:radial, or those"
    " of --measured).",
)
@option(
    "--respond",
    default="",
    metavar="POINT,...",
    help="Points of the response: of the tread, or of the hub fx, fy, fz, mx, my, mz; of one that"
    " moves x, y, z, rx, ry, rz (default: hub:fz or hub:z and the default of --excite, or those of"
    " --measured).",
)
@option(
    "--from-Hz",
    "from_Hz",
    type=Number(),
    default=0.0,
    metavar="A",
    help="Lowest frequency, Hz (default: 0; of a free wheel the step).",
)
@option(
    "--to-Hz",
    "to_Hz",
    type=Number(),
    default=300.0,
    metavar="B",
    help="Highest frequency, Hz (default: 300).",
)
@option(
    "--step-Hz",
    "step_Hz",
    type=Number(),
    default=0.5,
    metavar="D",
    help="Step of the frequency, Hz (default: 0.5).",
)
@option(
    "--patch-mm",
    "patch_mm",
    type=Number(),
    default=20.0,
    metavar="L",
    help="Side of the square patch that the force acts on, and that a motion is the mean of, mm"
    " (default: 20).",
)
@option(
    "--form",
    type=OneOf(("receptance", "accelerance")),
    default="receptance",
    show_default=True,
    help="Motion of the tread per force: displacement or acceleration.",
)
@option(
    "--measured",
    type=FileOrFolder(exists=True, folder=False),
    metavar="FILE",
    help="Measured functions to compare with: a universal file (data set 58, axes as below, origin"
    " at the wheel's centre), or a CSV with the columns of frf.csv. Its frequencies are used.",
)
@options.fitted()
@option("--pictures/--no-pictures", default=True, help="Draw magnitude and phase.")
@options.figure_format
@options.packed("functions", Functions)
@options.study
def command(
    case: Path,
    load_N: float | None,
    functions: Functions,
    measured: Path | None,
    study: options.Study,
) -> int:
    """Compute response functions of the tyre of CASE, unloaded on its rim, or on the road.

    Writes frf.json, .csv, .uff (universal file, data set 58) and .png: forces of the tyre on the
    hub, and motions of the tread, per newton on its tread. Hub: x forward, y left, z up. The angle
    0 is below the hub, 90 behind it. Losses are the compounds' loss_factor. If the wheel is free
    (rim.free) or on springs (rim.spindle), the hub moves instead, with rim.mass_kg. With --load-N
    the rim is held, and the contact patch sticks to the road, which bears its part of a force.

    \b
    tyrecal frf cases/p235_75r17.yaml --excite tread:0deg:radial --respond hub:fz,hub:fx
    tyrecal frf cases/p235_75r17.yaml --respond tread:0deg:radial,tread:90deg:radial --to-Hz 200
    tyrecal frf cases/p235_75r17.yaml --load-N 4000 --excite tread:90deg:radial
    tyrecal frf cases/p235_75r17.yaml --set rim.free=true --respond hub:z --form accelerance
    tyrecal frf my.yaml --measured hammer.uff --to-Hz 250
    """
    from ..studies.measured_response import read_measured_responses
    from ..studies.response import FrfResult, default_points, response_request, rim_moves
    from ..studies.result import StudyInput
    from ..studies.run_plan import PlannedState, plan_evaluations, plan_runs

    study.say_idle("only one design is evaluated")
    if measured and "--step-Hz" in options.given():
        raise click.UsageError("--step-Hz: the frequencies are those of --measured")
    band = functions.from_Hz, functions.to_Hz
    if measured:
        read_measured_responses(measured, functions.form, *band)
    loaded, _ = study.load(case)
    loaded, values = study.one_design(loaded)
    load = arguments.one_load(loaded, load_N, study.allow_unusual)
    evaluator = study.evaluator(loaded)
    evaluator.needs_response(rim_held=bool(load))
    moves = rim_moves(evaluator)
    points = default_points(load, moves)
    excited, seen = functions.excite or points["excite"], functions.respond or points["respond"]
    response_request(excited, seen, *band, functions.step_Hz, functions.patch_mm, moves)
    if load:
        evaluator.needs_road(modes=True)
    designs = {"fitted" if study.fitted else "initial": values}
    plan = plan_evaluations(loaded, evaluator, [values])
    if load:
        plan = plan_runs(loaded, evaluator, [PlannedState(1, modes=True)])
    files = [measured] if measured else []
    output = study.run(loaded, "frf", evaluator, measured=files, plan=plan, load_N=load)
    given = StudyInput(loaded, evaluator, designs)
    result = FrfResult.run(given, **vars(functions), measured=measured, load_N=load)
    figures = {}
    if study.pictures:
        from ..report.response import draw_responses

        figures = draw_responses(result)
    return study.present(output, result, figures)
