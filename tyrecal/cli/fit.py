"""tyrecal fit"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from . import options
from .main import EXIT_FIT


@click.command()
@options.every(options.case_argument, options.assignments, options.pressure)
@click.option(
    "--method",
    type=click.Choice(["slsqp", "least-squares"]),
    default="slsqp",
    show_default=True,
    help="Optimiser.",
)
@click.option("--fix", multiple=True, metavar="NAME", help="Hold a variable at its start value.")
@click.option(
    "--starts",
    type=click.IntRange(1, 100000),
    default=1,
    metavar="N",
    show_default=True,
    help="Starts: the case's own, the others drawn within the bounds.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    metavar="S",
    show_default=True,
    help="Seed of the drawn starts.",
)
@click.option("--pictures/--no-pictures", default=True, help="Draw convergence, section, modes.")
@options.scheduler
@options.every(*options.STUDY)
def command(
    case: Path,
    assignments: tuple[str, ...],
    pressure_kPa: float | None,
    method: str,
    fix: tuple[str, ...],
    starts: int,
    seed: int,
    pictures: bool,
    scheduler: str,
    jobs: int,
    mesh: str,
    solver: str,
    output: Path | None,
    store: Path | None,
    no_store: bool,
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Calibrate the variables of CASE to its targets: frequencies, and contact areas and vertical
    stiffnesses on the road.

    Writes fit.json, fit.csv, fit_history.csv and pictures. --set NAME=VALUE on a variable changes
    where the fit starts.

    \b
    tyrecal fit cases/p235_75r17.yaml
    tyrecal fit cases/p235_75r17.yaml --fix C10 --method least-squares
    tyrecal fit cases/p235_75r17.yaml --starts 20 --seed 1 --jobs 2
    tyrecal fit cases/p235_75r17.yaml --starts 20 --seed 1 --scheduler tcp://10.0.0.1:8786
    """
    from ..evaluate.door import Door
    from ..evaluate.queue import reached
    from ..fit.calibrate import calibrate, history_csv
    from ..fit.problem import objective_unit
    from ..report.table import fit_csv, fit_table
    from .output import Run, print_json, say, show

    loaded, values = options.load(case, mesh, assignments, pressure_kPa)
    unknown = [name for name in fix if name not in values]
    if unknown:
        raise click.UsageError(f"--fix {unknown[0]}: no such variable, only {', '.join(values)}")
    loaded = _starting_at(loaded, values)
    door = Door(loaded, solver)
    adapter = door.solver
    if loaded.case.targets.footprint:
        door.needs_road()
    run = Run(case, output, "fit", adapter)
    door.folder, door.keep = run.runs, verbose
    door.store = run.open_store(store, no_store)
    unit = objective_unit(loaded)
    if scheduler and jobs > 1:
        raise click.UsageError("--jobs is for this machine; with --scheduler its workers count")
    with _Progress(quiet, verbose, unit) as progress, reached(scheduler) as door.scheduler:
        fit = calibrate(
            loaded,
            door,
            method,
            {name: values[name] for name in fix},
            starts,
            seed,
            jobs,
            progress.notify,
        )
    run.write_json("fit.json", fit.result)
    run.write_text("fit.csv", fit_csv(fit.result))
    run.write_text("fit_history.csv", history_csv(fit.history))
    if as_json:
        print_json(fit.result)
    else:
        show(fit_table(fit.result), as_json, quiet)
    for warning in _warnings(fit.result):
        click.secho(warning, fg="yellow", err=True)
    if pictures:
        from ..evaluate.door import Question
        from ..report.pictures import draw_fit

        values = fit.fitted.values
        modes = sorted(fit.fitted.modes.values(), key=lambda mode: mode.frequency_Hz)
        evaluation = door.evaluate(Question(values))
        draw_fit(run.folder, loaded, values, evaluation, modes, fit.history, unit)
    run.finish(solver_runs=door.counts.runs, answered_from_record=door.counts.recorded)
    say(f"results in {run.folder}", as_json, quiet)
    return 0 if fit.result["converged"] and fit.result["moved"] else EXIT_FIT


def _starting_at(loaded: Any, values: Mapping[str, float]) -> Any:
    """The case with its variables' start values replaced."""
    from dataclasses import replace

    variables = {
        name: variable.model_copy(update={"start": values[name]})
        for name, variable in loaded.case.variables.items()
    }
    for name, variable in variables.items():
        if not variable.lower <= variable.start <= variable.upper:
            raise click.UsageError(
                f"--set {name}={variable.start:g}: a fit must start within the bounds"
                f" {variable.lower:g} to {variable.upper:g}"
            )
    return replace(loaded, case=loaded.case.model_copy(update={"variables": variables}))


def _warnings(result: Mapping[str, Any]) -> list[str]:
    """What the user must not overlook."""
    warnings = []
    if not result["moved"]:
        warnings.append("THE FIT DID NOT MOVE: every variable ended where it started")
    if not result["converged"]:
        warnings.append(
            f"not converged: {result['message']}; projected gradient"
            f" {result['projected_gradient_norm']:.3g} {result['objective_unit']}"
        )
    for name, variable in result["variables"].items():
        if variable["at_bound"]:
            seen = variable["standard_error"] is not None
            why = "the data want it beyond" if seen else "the data do not see it"
            warnings.append(f"{name} ended at a bound: {why}")
    if result["failed_evaluations"]:
        warnings.append(
            f"{result['failed_evaluations']} designs could not be evaluated; the search"
            " stepped back from them"
        )
    if result["label_margin"] < 0.3:
        warnings.append(
            f"a mode is hard to name (margin {result['label_margin']:.2f} of 1): two modes have"
            " met; look at their pictures"
        )
    values = result["singular_values"]
    if values and values[-1] < 1e-3 * values[0]:
        warnings.append("the data do not determine all variables: see singular_values in fit.json")
    return warnings


class _Progress:
    """A line that follows the fit on a terminal; silent elsewhere unless verbose."""

    def __init__(self, quiet: bool, verbose: bool, unit: str):
        import sys

        self.live = sys.stderr.isatty() and not quiet
        self.verbose = verbose and not quiet
        self.best, self.unit = float("inf"), unit

    def __enter__(self) -> _Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self.live:
            click.echo("\r\033[K", nl=False, err=True)

    def notify(self, number: int, values: Mapping[str, float], outcome: Any) -> None:
        """One more design point."""
        objective = getattr(outcome, "objective", None)
        self.best = min(self.best, objective or float("inf"))
        state = f"{objective:.4f} {self.unit}" if objective is not None else f"failed: {outcome}"
        if self.verbose:
            numbers = "  ".join(f"{k}={v:.5g}" for k, v in values.items())
            click.echo(f"point {number}: {state}  {numbers}", err=True)
        elif self.live:
            text = f"\r\033[Kdesign {number}: {state:.60}, best {self.best:.4f} {self.unit}"
            click.echo(text, nl=False, err=True)
