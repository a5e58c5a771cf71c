"""tyrecal plan"""

from __future__ import annotations

from pathlib import Path

import click

from . import options
from .parameters import NumberWithin, WholeNumber, option


@click.command()
@options.every(options.case_argument, options.assignments)
@option(
    "--hours",
    type=NumberWithin(0, min_open=True),
    metavar="H",
    help="Longest duration of the plan, h (default: until no measurement adds 1 % to the chance).",
)
@option(
    "--sensors",
    type=WholeNumber(1, 500),
    metavar="N",
    help="Number of triaxial sensors: places them, and counts only modes that they distinguish"
    " (default: every mode is labelled).",
)
@option(
    "--pressure-kPa",
    "pressures",
    type=NumberWithin(0, min_open=True),
    multiple=True,
    metavar="KPA",
    help="Pressure that may be measured, kPa; repeatable (default: six from 0.4 times the case's to"
    " 80 kPa above it).",
)
@option(
    "--noise-percent",
    type=NumberWithin(0, 20, min_open=True),
    default=0.2,
    show_default=True,
    metavar="PERCENT",
    help="Scatter of every frequency, one standard deviation in per cent.",
)
@option(
    "--step-hours",
    "steps",
    multiple=True,
    metavar="STEP=H",
    help="Hours of a step in your laboratory; repeatable. Steps and their defaults are in the"
    " guide. Example: mount=1.5.",
)
@option("--pictures/--no-pictures", default=True, help="Draw the picture.")
@options.figure_format
@options.study
def command(
    case: Path,
    hours: float | None,
    sensors: int | None,
    pressures: tuple[float, ...],
    noise_percent: float,
    steps: tuple[str, ...],
    study: options.Study,
) -> int:
    """Plan a test of CASE before it is made: what to measure, in which order, and what it can find.

    Writes plan.json, plan.md (one page to print), tables (CSV) and a picture. The modes are the
    case's targets. If it has none, they are [0,0] to [4,0]. Each step has the chance that
    'tyrecal diagnose' then finds an effect, with a probability of 0.9. Hours are assumptions.

    \b
    tyrecal plan cases/p235_75r17.yaml --jobs 2
    tyrecal plan cases/p235_75r17.yaml --hours 4 --sensors 12 --step-hours mount=1.5
    """
    from ..studies.plan.result import PLAN_STAGES
    from ..studies.plan.study import plan, planned
    from ..studies.result import StudyInput

    loaded, _ = study.load(case)
    evaluator = study.evaluator(loaded)
    runs = planned(loaded, evaluator, sensors, pressures, study.jobs)
    run = study.run(loaded, "plan", evaluator, plan=runs)
    given, step_hours = StudyInput(loaded, evaluator, {}, jobs=study.jobs), dict(map(_step, steps))
    with study.terminal.progress("plan", PLAN_STAGES) as bar:
        evaluator.on_progress = bar.at
        noise = noise_percent / 100
        result = plan(given, hours, sensors, pressures, noise, step_hours, bar.begin)
    if not study.pictures:
        return study.present(run, result, {})
    from ..report.plan import figures

    return study.present(run, result, figures(result))


def _step(text: str) -> tuple[str, float]:
    """Name and hours of --step-hours. Raises click.UsageError."""
    name, _, hours = text.partition("=")
    try:
        number = float(hours)
    except ValueError:
        number = -1.0
    if not 0 <= number < 1000:
        raise click.UsageError(f"--step-hours {text}: must be STEP=HOURS, as in mount=1.5")
    return name.strip(), number
