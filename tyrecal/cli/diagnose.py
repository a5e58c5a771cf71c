"""tyrecal diagnose"""

from __future__ import annotations

from pathlib import Path

import click

from . import arguments, complete, options

file = click.Path(path_type=Path, exists=True, dir_okay=False)


@click.command()
@options.every(options.case_argument, options.assignments)
@click.option("--measured", type=file, metavar="FILE", help="Measurements (CSV), labels or not.")
@click.option(
    "--repeats",
    multiple=True,
    type=file,
    metavar="FILE",
    help="The same measured again after dismounting; repeatable.",
)
@click.option(
    "--toggled",
    multiple=True,
    type=(file, str),
    metavar="FILE CHANGE",
    help="A run of the same tyre with one thing switched: EFFECT=VALUE (0: absent) or"
    " EFFECT*FACTOR; repeatable.",
)
@click.option(
    "--effect",
    "effects",
    multiple=True,
    metavar="EFFECT",
    shell_complete=complete.effects,
    help="Consider these effects only; repeatable.",
)
@click.option(
    "--without",
    multiple=True,
    metavar="EFFECT",
    shell_complete=complete.effects,
    help="Leave out an effect that is ruled out; repeatable.",
)
@click.option(
    "--form-percent",
    type=click.FloatRange(0, 20),
    metavar="PERCENT",
    help="Error of the model's own form in every frequency (default: of its mesh, mode by mode, and"
    " of material laws, where the section is not exact).",
)
@click.option(
    "--split-percent",
    type=click.FloatRange(0, 20),
    default=0.3,
    show_default=True,
    metavar="PERCENT",
    help="Split of pairs that every such tyre has.",
)
@click.option(
    "--further",
    type=click.FloatRange(0, 1),
    default=0.05,
    show_default=True,
    metavar="SHARE",
    help="Prior of two effects over that of one, and of three over that of two.",
)
@click.option(
    "--add",
    metavar="EFFECT=VALUE",
    shell_complete=complete.effect_values,
    help="Write a case with the effect in it, and do nothing else.",
)
@click.option("--pictures/--no-pictures", default=True, help="Draw what was found.")
@options.study
def command(
    case: Path,
    assignments: tuple[str, ...],
    measured: Path | None,
    repeats: tuple[Path, ...],
    toggled: tuple[tuple[Path, str], ...],
    effects: tuple[str, ...],
    without: tuple[str, ...],
    form_percent: float | None,
    split_percent: float,
    further: float,
    add: str | None,
    pictures: bool,
    study: options.Study,
) -> int:
    """Find where CASE and measurements part, and which effect explains it.

    Writes diagnosis.json, diagnosis.md (one page in words) and pictures. The model is calibrated
    to the measurements first; its targets play no part.

    \b
    tyrecal diagnose cases/p235_75r17.yaml --measured cases/p235_75r17_wheeler.csv
    tyrecal diagnose my.yaml --measured run1.csv --repeats run2.csv --repeats run3.csv --jobs 2
    tyrecal diagnose my.yaml --measured run1.csv --toggled clamped.csv spindle_lateral=0
    tyrecal diagnose my.yaml --add bead_filler=1.5
    """
    terminal = study.terminal
    if add:
        if assignments or measured:
            raise click.UsageError("--add writes a case and nothing else: no --set, no --measured")
        path = _added(case, add, study.output, study.allow_unusual)
        terminal.result({"case": str(path)})
        terminal.say(f"{path} has the effect in it; 'tyrecal fit {path}' calibrates it")
        return 0
    if measured is None:
        raise click.UsageError("--measured FILE must be given, or --add EFFECT=VALUE")
    from ..measured.tables import read_measurements
    from ..measured.targets import in_states
    from ..report.diagnosis import page
    from ..report.shape_data import parts_data
    from ..studies.diagnose.diagnosis import STAGES
    from ..studies.diagnose.inverse_problem import Assumed
    from ..studies.diagnose.result import diagnosis_result
    from ..studies.diagnose.study import parse_change, refuse_decks
    from ..studies.diagnose.study import study as diagnosed
    from ..studies.fit.targets import rims_of
    from ..tyre.effects import catalogue

    loaded, values = study.load(case, assignments)
    refuse_decks(loaded)
    loaded = arguments.starting_at(loaded, values)
    for id in (*effects, *without):
        if id not in catalogue():
            raise click.UsageError(f"'{id}': no such effect, only {', '.join(catalogue())}")
    considered = [id for id in effects or catalogue() if id not in without]
    if not considered:
        raise click.UsageError("--without leaves no effect to consider")
    changes = [(path, parse_change(text)) for path, text in toggled]
    for _, change in [] if study.allow_unusual else changes:
        if not change.times:
            option, name = f"--toggled {change.id}={change.value:g}", f"effects.{change.id}"
            arguments.refuse_unusual(loaded, option, name, change.value, False)
    evaluator = study.evaluator(loaded)
    files = [measured, *repeats, *(path for path, _ in changes)]
    readings = [
        each
        for path in files
        for each in in_states(loaded, read_measurements(path, labelled=path != measured))
    ]
    states = [each.state for each in readings]
    pressures, at = ({each.pressure_kPa for each in readings}, {each.load_N for each in readings})
    run = study.run(
        loaded,
        "diagnose",
        evaluator,
        measured=files,
        pressure_kPa=sorted(pressures),
        load_N=sorted(at),
        rim=rims_of(loaded, states) if any(each.rim for each in states) else (),
    )
    form = None if form_percent is None else form_percent / 100
    assumed = Assumed(form, split_percent / 100, further=further)
    with terminal.progress("diagnose", STAGES) as bar:
        evaluator.on_progress = bar.at
        found = diagnosed(
            loaded,
            evaluator,
            measured,
            repeats,
            changes,
            assumed,
            study.jobs,
            considered,
            stage=bar.begin,
        )
    told = run.write(
        diagnosis_result(
            found.diagnosis, found.under_load, found.variables, found.section, found.labels
        )
    )
    parts = parts_data(loaded, [part.region for part in told.section_map])
    run.write_json("diagnosis_section.json", parts)
    words = page(found, loaded.case.name, measured.name)
    run.write_text("diagnosis.md", words)
    if pictures:
        from ..report.diagnosis_pictures import draw_diagnosis
        from ..report.figure import save

        for name, figure in draw_diagnosis(found.diagnosis, parts).items():
            save(figure, run.new / f"diagnosis_{name}.png")
    run.finish()
    terminal.result(told.content())
    terminal.say(words)
    for doubt in told.labels.doubts() if told.labels else ():
        terminal.warn(doubt)
    study.finish(run)
    return 0


def _added(case: Path, assignment: str, output: Path | None, allowed: bool) -> Path:
    """The new case's file. Raises click.UsageError, CaseError."""
    from ..studies.diagnose.add import add
    from ..tyre.case import parse_assignment
    from ..tyre.load import load_case

    loaded = load_case(case, allowed)
    try:
        id, value = parse_assignment(assignment)
        arguments.refuse_unusual(loaded, f"--add {assignment}", f"effects.{id}", value, allowed)
        return add(case, id, value, output)
    except ValueError as error:
        raise click.UsageError(f"--add: {error}") from None
