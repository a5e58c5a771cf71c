"""tyrecal fit"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import arguments, complete, options
from .main import EXIT_FIT
from .parameters import FileOrFolder, OneOf, WholeNumber, names_option, option
from .terminal import Progress, Terminal

if TYPE_CHECKING:
    from ..simulate.evaluate.evaluator import Evaluator
    from ..studies.fit.calibrate import Fit
    from ..tyre.case import LoadedCase
    from .output import Run


@dataclass(frozen=True)
class Numbers:
    """Numbers that a fit may change, and may not."""

    fix: tuple[str, ...]  # variables to hold
    free: str | None  # uncertain numbers to fit too, with commas
    prior: bool  # weigh in what is known before

    def fixed(self, values: Mapping[str, float]) -> dict[str, float]:
        """The held variables with their start values. Raises click.UsageError."""
        for name in self.fix:
            arguments.refuse_unknown("--fix", name, values, "variable")
        return {name: values[name] for name in self.fix}

    @property
    def freed(self) -> list[str]:
        """The uncertain numbers to fit too."""
        return [name.strip() for name in self.free.split(",")] if self.free else []


@click.command()
@options.every(options.case_argument, options.assignments, options.pressure)
@option(
    "--method",
    type=OneOf(["slsqp", "gauss-newton"]),
    default="slsqp",
    show_default=True,
    help="Method: SciPy's SLSQP, or damped Gauss-Newton, which needs about half the designs"
    " (for slow solvers).",
)
@option(
    "--measured",
    type=FileOrFolder(exists=True, folder=False),
    metavar="FILE",
    help="Measurements (CSV) in place of the case's targets, in their states (pressure, load,"
    " rim); with --pressure-kPa, only those at that pressure. Frequencies without c and m get"
    " the likeliest labels.",
)
@names_option(
    "--fix",
    metavar="NAME",
    shell_complete=complete.variables,
    help="Variable to hold at its start value; repeatable.",
)
@option(
    "--free",
    metavar="PATH,...",
    help="Uncertain numbers to fit too, by path or by the name of their uncertainty: each within"
    " three standard deviations of what is known of it, which counts as a measured value."
    " Example: belt_1_angle,tread_density.",
)
@option(
    "--prior",
    is_flag=True,
    help="Weigh in what is known before: each variable's percent, and the errors of section,"
    " material laws and constants. Fewer values than variables are enough.",
)
@option(
    "--starts",
    type=WholeNumber(1, 100000),
    default=1,
    metavar="N",
    show_default=True,
    help="Number of starts: the case's, and others drawn within the bounds.",
)
@options.seed("the drawn starts")
@option("--pictures/--no-pictures", default=True, help="Draw convergence, section, modes.")
@options.scheduler
@options.figure_format
@options.packed("numbers", Numbers)
@options.study
def command(
    case: Path,
    method: str,
    measured: Path | None,
    numbers: Numbers,
    starts: int,
    seed: int,
    study: options.Study,
) -> int:
    """Calibrate the variables of CASE to its targets: frequencies, and contact areas, lengths,
    widths and vertical stiffnesses on the road.

    Writes fit.json, fit.csv, fit_history.csv and pictures. If the model does not fit (chi2 per
    degree of freedom above 5), a warning gives the likeliest reason. --set NAME=VALUE on a variable
    changes where the fit starts. --pressure-kPa and --set rim.free=true choose the targets that
    were measured in that state.

    \b
    tyrecal fit cases/p235_75r17.yaml
    tyrecal fit cases/p235_75r17.yaml --fix C10 --method gauss-newton
    tyrecal fit cases/p235_75r17.yaml --prior --report
    tyrecal fit cases/p235_75r17.yaml --free rubber_density,belt_1_angle
    tyrecal fit cases/p235_75r17.yaml --report
    tyrecal fit cases/p235_75r17.yaml --measured measured.csv --pressure-kPa 200
    tyrecal fit cases/p235_75r17.yaml --starts 20 --seed 1 --jobs 2
    tyrecal fit cases/p235_75r17.yaml --starts 20 --seed 1 --scheduler tcp://10.0.0.1:8786
    """
    from ..measured.sense import doubts_of_file
    from ..report.table import fit_doubts, fit_verdict, shown, tyre_doubts
    from ..simulate.evaluate.cluster import reached
    from ..simulate.program import join_command
    from ..studies.fit.study import FitStudy
    from ..studies.fit.targets import objective_unit, read_targets
    from ..studies.fit.verdict import FITS
    from ..studies.fitted import NOT_CONVERGED, has_good

    terminal = study.terminal
    study.refuse_two_machines()
    loaded, values = study.load(case)
    fixed, freed = numbers.fixed(values), numbers.freed
    calibration = FitStudy(loaded, study.evaluator(loaded), measured, fixed, freed, numbers.prior)
    file = measured or loaded.measured
    file_doubts = doubts_of_file(file) if file else []
    for doubt in file_doubts:
        terminal.warn(doubt)
    evaluator = calibration.evaluator
    if calibration.evaluates_one_by_one and starts == 1:
        why = "a fit from one start evaluates one design at a time"
        if study.scheduler:
            raise click.UsageError(f"--scheduler has no effect here: {why}; give --starts too")
        study.say_idle(why)
    if method == "slsqp" and not evaluator.has_gradients:
        name = evaluator.solver.name
        terminal.note(
            f"solver '{name}' gives no sensitivities: --method gauss-newton needs about a third of"
            " its runs"
        )
    plan = calibration.run_plan(method, starts, study.jobs)
    run = study.run(loaded, "fit", evaluator, plan=plan)
    with terminal.progress("fit") as bar, reached(study.scheduler) as evaluator.scheduler:
        unit = "sigma" if calibration.measured else objective_unit(loaded)
        points = _Points(terminal, bar, unit)
        fit = calibration.run(method, starts, seed, study.jobs, points.notify, bar.at)
    loaded, run.provenance = calibration.case, calibration.provenance
    fit.found = run.write(fit.found)
    result = fit.result
    terminal.result(result)
    tables = fit.found.tables()
    if fit.found.states or fit.found.labels or fit.found.shapes:  # each as wide as it needs
        for table in tables:
            terminal.show(shown(table))
    else:
        terminal.show(shown(*tables))
    terminal.say("\n".join([*fit_verdict(result), *fit.found.sentences()]))
    for each in fit.left_out:
        terminal.note(f"{calibration.measured or case}: not used: {each}")
    for warning in (*tyre_doubts(result), *fit_doubts(result)):
        if warning not in file_doubts:
            terminal.warn(warning)
    good = fit.found.is_good
    earlier = not good and has_good(run.folder / "fit.json")
    finish = partial(run.finish, aside=NOT_CONVERGED if earlier else "")
    try:
        if study.pictures or study.report:
            _write_shapes(run, loaded, evaluator, fit, bool(study.pictures))
    except OSError:  # the disk is full: an earlier fit stays
        raise
    except Exception:  # a picture that fails does not lose the fit
        finish()
        raise
    finish()
    if earlier:
        terminal.warn(f"the fit in '{run.folder}' had converged: it is kept")
    study.finish(run)
    words = ["tyrecal", "diagnose", str(case)]
    if measured or not loaded.measured:
        words += ["--measured", str(measured or "FILE")]
    next_command = join_command(words)
    reason, fits = fit.found.reason, fit.found.verdict == FITS
    may_lack_effects = fits or reason is None or not reason.excludes_effects
    if good and may_lack_effects and loaded.kind.names_its_parts and read_targets(loaded):
        terminal.say(f"next: {next_command} finds what the model lacks")
    return 0 if good else EXIT_FIT


def _write_shapes(
    run: Run, loaded: LoadedCase, evaluator: Evaluator, fit: Fit, pictures: bool
) -> None:
    """Write the fitted tyre's mode shapes, and the pictures of the fit."""
    from ..report.shape_data import tyre_data
    from ..simulate.evaluate.evaluator import Question
    from ..tyre.values import with_values

    state = next(iter(fit.fitted.states))  # the first of the targets' states
    values = state.design(loaded, fit.fitted.values)
    modes = sorted(fit.fitted.modes.values(), key=lambda mode: mode.frequency_Hz)
    evaluation = evaluator.evaluate(Question(values))
    design = with_values(loaded, values)
    shapes = tyre_data(design, evaluation, modes)
    run.write_json("fit_shapes.json", shapes)
    if pictures:
        from ..report.pictures import draw_fit

        kind = run.figure_format
        draw_fit(run.new, design, evaluation, modes, fit.history, fit.found, kind)


class _Points:
    """Prints the progress of a fit: each design with --verbose; the latest design and the best
    objective, in ``unit``, on a terminal."""

    def __init__(self, terminal: Terminal, bar: Progress, unit: str):
        self.terminal, self.bar, self.unit, self.best = terminal, bar, unit, float("inf")

    def notify(self, number: int, values: Mapping[str, float], outcome: Any) -> None:
        """Print a design with its objective, or why it failed."""
        objective = getattr(outcome, "objective", None)
        self.best = self.best if objective is None else min(self.best, objective)
        state = f"{objective:.4f} {self.unit}" if objective is not None else f"failed: {outcome}"
        numbers = "  ".join(f"{k}={v:.5g}" for k, v in values.items())
        self.terminal.detail(f"point {number}: {state}  {numbers}")
        self.bar.words(f"design {number}: {state:.30}, best {self.best:.4f}")
