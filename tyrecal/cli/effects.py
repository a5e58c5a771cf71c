"""tyrecal effects"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from . import arguments, complete, options
from .parameters import FileOrFolder, option


@click.command()
@click.argument("name", required=False, shell_complete=complete.effects)
@option(
    "--case",
    "case",
    type=FileOrFolder(),
    metavar="CASE",
    shell_complete=complete.cases,
    help="Case: compute the change of this tyre's frequencies.",
)
@options.fitted()
@option(
    "--value",
    metavar="V",
    help="Size of the effect NAME in its unit, or with another (default: the end of its range)."
    " Example: 12mm.",
)
@option(
    "--pressures-kPa",
    "pressures",
    metavar="P1,P2,...",
    help="Pressures (default: two thirds of the case's, the case's, four thirds).",
)
@option("--pictures/--no-pictures", default=True, help="Draw each signature.")
@options.assignments
@options.jobs
@options.figure_format
@options.study_one_by_one
def command(
    name: str | None,
    case: Path | None,
    value: str | None,
    pressures: str | None,
    study: options.Study,
) -> int:
    """List what a plain tyre model leaves out, or explain the effect NAME.

    With --case, effects.json holds the changes of that tyre's modes, before and after the best
    re-fit of the case's variables. effect_ID.png shows them.

    \b
    tyrecal effects
    tyrecal effects bead_filler
    tyrecal effects bead_filler --case cases/p235_75r17.yaml --fitted p235_75r17/fit.json
    tyrecal effects --case cases/p235_75r17.yaml --jobs 2
    """
    from ..report.effects import effect_text, effects_table
    from ..report.table import shown
    from ..simulate.evaluate.solver import installed
    from ..studies.effects import CatalogueEntry, run
    from ..studies.run_plan import PlannedState, plan_evaluations
    from ..studies.signature import Plain
    from ..tyre.effects import IDS, catalogue
    from ..tyre.number_units import EFFECT_PATH, unit_of
    from ..tyre.state import pressure_name

    terminal = study.terminal

    if name is not None:
        arguments.refuse_unknown("effects", name, IDS, "effect")
    if value is not None and name is None:
        raise click.UsageError("--value needs the NAME of an effect")
    for stated in [] if case else options.given():
        raise click.UsageError(f"{stated} needs a --case")
    solvers = installed()
    chosen = [name] if name else list(catalogue())
    if not case:
        entries = [CatalogueEntry.of(catalogue()[id], solvers) for id in chosen]
        terminal.result([each.model_dump(exclude_unset=True) for each in entries])
        if name and not terminal.as_json:
            terminal.say(effect_text(entries[0]))
        else:
            terminal.show(shown(effects_table(entries)))
        return 0

    loaded, _ = study.load(case)
    loaded, values = study.one_design(loaded)
    size = None
    if name and value is not None:
        path = EFFECT_PATH + name
        (size,) = arguments.parse_numbers("--value", value, unit_of(path), 1)
        arguments.refuse_unusual(loaded, f"--value {value}", path, size, study.allow_unusual)
    evaluator = study.evaluator(loaded)
    adapter = evaluator.solver
    kPa = [round(loaded.case.pressure_kPa * share / 3, 6) for share in (2, 3, 4)]
    if pressures is not None:
        kPa = arguments.parse_pressure_list(
            "--pressures-kPa", loaded, pressures, study.allow_unusual
        )
    entries = [CatalogueEntry.of(catalogue()[id], solvers, loaded) for id in chosen]
    able = [each for each in entries if name or adapter.name in each.solvers]
    designs = [{**values, pressure_name(loaded): p} for p in kPa]
    plan = plan_evaluations(loaded, evaluator, designs, len(values), study.jobs)
    # in addition to the plain tyre at each pressure, each effect
    plan = replace(plan, states=(*plan.states, *[PlannedState()] * len(able)))
    output = study.run(loaded, "effects", evaluator, plan=plan, pressure_kPa=kPa)
    if name and not terminal.as_json:
        terminal.say(effect_text(entries[0]) + "\n")
    for each in entries:
        if each not in able:
            terminal.say(f"{each.id}: solver '{adapter.name}' cannot express it")
    terminal.detail(f"each at {', '.join(f'{p:g}' for p in kPa)} kPa")
    if not evaluator.has_gradients:
        from ..studies.run_plan import runs_in_words

        # at each pressure: the plain tyre, a neighbour by each variable, and each effect
        runs = len(kPa) * (1 + len(values) + len(able))
        terminal.note(runs_in_words(evaluator, values, runs, study.jobs))
    with terminal.progress("effects") as bar:
        evaluator.on_progress = bar.at
        plain = Plain(loaded, evaluator, values, kPa, study.jobs)
        result, signatures = run(plain, able, size, study.jobs, study.notify)
    figures = {}
    if study.pictures:
        from ..report.signature import draw_signature

        figures = {f"effect_{each.id}": draw_signature(each) for each in signatures}
    return study.present(output, result, figures)
