"""tyrecal diagnose"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InputError
from . import arguments, complete, options
from .parameters import FileOrFolder, NumberWithin, names_option, option

if TYPE_CHECKING:
    from ..studies.inference.inverse_problem import Assumed

file = FileOrFolder(exists=True, folder=False)


@dataclass(frozen=True)
class Files:
    """Files of measurements of one tyre."""

    measured: Path | None
    repeats: tuple[Path, ...]
    toggled: tuple[tuple[Path, str], ...]  # each with its change, in words


@dataclass(frozen=True)
class Assumptions:
    """Options of `Assumed`, in per cent."""

    form_percent: float | None
    split_percent: float
    further: float

    def assumed(self) -> Assumed:
        """The same as fractions."""
        from ..studies.inference.inverse_problem import Assumed

        form = None if self.form_percent is None else self.form_percent / 100
        return Assumed(form, self.split_percent / 100, further=self.further)


@click.command()
@options.every(options.case_argument, options.assignments)
@option(
    "--measured",
    type=file,
    metavar="FILE",
    help="Measurements (CSV), with or without labels, or a universal file as for 'tyrecal measured"
    " label' (default: targets.file of the case).",
)
@options.fitted(" as the calibration's first guess")
@option(
    "--repeats",
    multiple=True,
    type=file,
    metavar="FILE",
    help="Measurements (CSV) of the same tyre after dismounting it; repeatable.",
)
@option(
    "--toggled",
    multiple=True,
    type=(file, str),
    metavar="FILE CHANGE",
    help="Measurements (CSV) of the same tyre with one thing changed: EFFECT=VALUE (0: absent) or"
    " EFFECT*FACTOR; repeatable.",
)
@names_option(
    "--effect",
    "effects",
    metavar="EFFECT",
    shell_complete=complete.effects,
    help="Effect to consider; repeatable (default: all).",
)
@names_option(
    "--without",
    metavar="EFFECT",
    shell_complete=complete.effects,
    help="Effect to leave out, because it is ruled out; repeatable.",
)
@option(
    # a standard deviation; an exact section: section.known_from of the case is exact
    "--form-percent",
    type=NumberWithin(0, 20),
    metavar="PERCENT",
    help="Error of the model's own form in every frequency (default: of its mesh, mode by mode,"
    " and of material laws, if the section is not exact).",
)
@option(
    "--split-percent",  # its standard deviation, over the frequency
    type=NumberWithin(0, 20),
    default=0.3,
    show_default=True,
    metavar="PERCENT",
    help="Split of pairs that every such tyre has, per cent.",
)
@option(
    "--further",
    type=NumberWithin(0, 1),
    default=0.05,
    show_default=True,
    metavar="SHARE",
    help="Prior odds of two effects against one, and of three against two.",
)
@option(
    "--add",
    "added",
    multiple=True,
    metavar="EFFECT=VALUE",
    shell_complete=complete.effect_values,
    help="Effect to add to the case: a new case is written, and nothing else; repeatable. Example:"
    " bead_filler=1.5.",
)
@option("--pictures/--no-pictures", default=True, help="Draw the result.")
@options.figure_format
@options.packed("files", Files)
@options.packed("assumptions", Assumptions)
@options.study
def command(
    case: Path,
    files: Files,
    effects: tuple[str, ...],
    without: tuple[str, ...],
    assumptions: Assumptions,
    added: tuple[str, ...],
    study: options.Study,
) -> int:
    """Find where CASE and measurements differ, and which effect explains it.

    Writes diagnosis.json, diagnosis.md (one page in words) and pictures. The model is calibrated
    to the measurements first; targets in the case file are not used. With a solver without exact
    sensitivities the number of runs and their time are printed first; --effect reduces them.

    \b
    tyrecal diagnose cases/p235_75r17.yaml --measured cases/p235_75r17_wheeler.csv
    tyrecal diagnose my.yaml --measured run1.csv --repeats run2.csv --repeats run3.csv --jobs 2
    tyrecal diagnose my.yaml --measured run1.csv --toggled clamped.csv spindle_lateral=0
    tyrecal diagnose my.yaml --add bead_filler=1.5
    tyrecal diagnose my.yaml --add bead_filler=1.5 --add rim_width=-0.01
    """
    terminal = study.terminal
    if added:
        from ..simulate.program import join_command

        for flag in options.given("--add", "--output", "--allow-unusual"):
            raise click.UsageError(f"--add only writes a case, so it takes no {flag}")
        path = _with_effects(case, added, study.output, study.allow_unusual)
        terminal.result({"case": str(path)})
        what = "the effect" if len(added) == 1 else "the effects"
        fit = join_command(["tyrecal", "fit", str(path)])
        terminal.say(f"{path} has {what} in it; next: {fit}")
        return 0
    from ..report.diagnosis import page
    from ..report.shape_data import parts_data
    from ..studies.diagnose.diagnosis import STAGES
    from ..studies.diagnose.study import parse_change, planned, states_measured
    from ..studies.diagnose.study import study as diagnosed
    from ..studies.variable import read_variables
    from ..tyre.effects import catalogue

    loaded, _ = study.load(case)
    read_variables(loaded)  # refuses a start outside its bounds before anything is written
    measured = files.measured or loaded.measured
    if measured is None:
        raise click.UsageError("--measured FILE must be given, or --add EFFECT=VALUE")
    for flag, ids in (("--effect", effects), ("--without", without)):
        for id in ids:
            arguments.refuse_unknown(flag, id, catalogue(), "effect")
    considered = [id for id in effects or catalogue() if id not in without]
    if not considered:
        raise click.UsageError("--without leaves no effect to consider")
    changes = [(path, parse_change(text)) for path, text in files.toggled]
    for _, change in [] if study.allow_unusual else changes:
        if not change.times:  # EFFECT=VALUE, not EFFECT*FACTOR
            option, name = f"--toggled {change.id}={change.value:g}", f"effects.{change.id}"
            arguments.refuse_unusual(loaded, option, name, change.value, allowed=False)
    first_guess = study.fitted_values(loaded).get("fitted")
    evaluator = study.evaluator(loaded)
    others = [*files.repeats, *(path for path, _ in changes)]
    states = states_measured(loaded, measured, others)
    plan = None
    if study.dry_run:
        plan = planned(loaded, evaluator, measured, considered, study.jobs)
    every = [measured, *others]
    run = study.run(loaded, "diagnose", evaluator, measured=every, plan=plan, **states)
    with terminal.progress("diagnose", STAGES) as bar:
        evaluator.on_progress = bar.at
        diagnosed_case = diagnosed(
            loaded,
            evaluator,
            measured,
            files.repeats,
            changes,
            assumptions.assumed(),
            study.jobs,
            considered,
            stage=bar.begin,
            first_guess=first_guess,
            say=terminal.note,
        )
    written = run.write(diagnosed_case.result)
    parts = parts_data(loaded, [part.region for part in written.section_map])
    run.write_json("diagnosis_section.json", parts)
    words = page(diagnosed_case, loaded.case.name, measured.name)
    run.write_text("diagnosis.md", words)
    if study.pictures:
        from ..report.diagnosis_pictures import draw_diagnosis

        figures = draw_diagnosis(diagnosed_case.diagnosis, parts)
        run.write_figures({f"diagnosis_{name}": figure for name, figure in figures.items()})
    run.finish()
    terminal.result(written.content())
    terminal.say(words)
    for doubt in written.labels.doubts() if written.labels else ():
        terminal.warn(doubt)
    study.finish(run)
    return 0


def _with_effects(case: Path, added: tuple[str, ...], output: Path | None, allowed: bool) -> Path:
    """Write the case with the effects ``added``; returns its path. allowed: unusual values too.
    Raises click.UsageError, CaseError."""
    from ..studies.export import add
    from ..tyre.case import parse_assignment
    from ..tyre.load import load_case
    from ..tyre.number_units import EFFECT_PATH, unit_of

    loaded = load_case(case, allowed)
    effects: dict[str, float] = {}
    try:
        for text in added:
            id, value = parse_assignment(text, lambda id: unit_of(EFFECT_PATH + id))
            arguments.refuse_unusual(loaded, f"--add {text}", f"effects.{id}", value, allowed)
            if effects.setdefault(id, value) != value:
                raise InputError(f"{id} is given twice, as {effects[id]:g} and {value:g}")
        return add(case, effects, output)
    except InputError as error:
        raise click.UsageError(f"--add: {error}") from None
