"""tyrecal effects"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from . import arguments, complete, options
from .main import EXIT_SOLVER


@click.command()
@click.argument("name", required=False, shell_complete=complete.effects)
@click.option(
    "--case",
    "case",
    type=click.Path(path_type=Path),
    metavar="CASE",
    shell_complete=complete.cases,
    help="Compute what the effect does to this tyre.",
)
@options.fitted("Compute it for the design that 'tyrecal fit' found for the case.")
@click.option(
    "--value",
    type=float,
    metavar="V",
    help="Size of the effect NAME (default: the end of its range).",
)
@click.option(
    "--pressures-kPa",
    "pressures",
    metavar="P1,P2,...",
    help="Default: two thirds of the case's, the case's, four thirds.",
)
@click.option("--pictures/--no-pictures", default=True, help="Draw each signature.")
@options.assignments
@options.jobs
@options.study_one_by_one
def command(
    name: str | None,
    case: Path | None,
    fitted: Path | None,
    value: float | None,
    pressures: str | None,
    pictures: bool,
    assignments: tuple[str, ...],
    study: options.Study,
) -> int:
    """List what a plain tyre model leaves out, or explain the effect NAME.

    With --case, effects.json holds what it does to the modes of that tyre, before and after the
    best re-fit of the case's variables, and effect_ID.png shows it.

    \b
    tyrecal effects
    tyrecal effects bead_filler
    tyrecal effects bead_filler --case cases/p235_75r17.yaml --fitted p235_75r17/fit.json
    tyrecal effects --case cases/p235_75r17.yaml --jobs 2
    """
    from ..report.effects import effect_entry, effect_text, signature_entry
    from ..report.table import effects_table, shown, signatures_table
    from ..simulate.evaluate.failure import EvaluationFailed
    from ..simulate.evaluate.solver import installed
    from ..studies.signature import Plain, stated_size
    from ..tyre.case.mistakes import suggestion
    from ..tyre.effects import IDS, catalogue

    terminal = study.terminal

    if name is not None and name not in IDS:
        raise click.UsageError(f"there is no effect '{name}'{suggestion(name, IDS)}")
    if value is not None and name is None:
        raise click.UsageError("--value needs the NAME of an effect")
    for option in [] if case else options.given():
        if option not in ("--json", "--quiet", "--verbose"):
            raise click.UsageError(f"{option} needs a --case")
    solvers = installed()
    entries = {id: effect_entry(catalogue()[id], solvers) for id in ([name] if name else IDS)}
    if not case:
        terminal.result(list(entries.values()))
        if name and not terminal.as_json:
            terminal.say(effect_text(entries[name]))
        else:
            terminal.show(shown(effects_table(list(entries.values()))))
        return 0

    loaded, values = study.load(case, assignments)
    if fitted and (lost := _variables_in(assignments, values)):
        raise click.UsageError(f"--set {lost[0]}: the design is that of --fitted")
    if name and value is not None:
        path = f"effects.{name}"
        arguments.refuse_unusual(loaded, f"--value {value:g}", path, value, study.allow_unusual)
    evaluator = study.evaluator(loaded)
    adapter = evaluator.solver
    if not evaluator.has_gradients:
        raise click.UsageError(f"solver '{adapter.name}' gives no slopes, which a re-fit needs")
    kPa = _pressures(loaded, pressures, study.allow_unusual)
    if fitted:
        values = arguments.fitted_values(fitted, loaded, terminal)
    run = study.run(loaded, "effects", evaluator, pressure_kPa=kPa)
    plain = Plain(loaded, evaluator, values, kPa)
    if name and not terminal.as_json:
        terminal.say(effect_text(entries[name]) + "\n")
    sizes: dict[str, float] = {}
    for id, entry in entries.items():
        if name or adapter.name in entry["solvers"]:
            sizes[id] = stated_size(id) if value is None else value
        else:
            terminal.say(f"{id}: solver '{adapter.name}' cannot express it")
    terminal.detail(f"each at {', '.join(f'{p:g}' for p in kPa)} kPa")
    found, failed = [], 0
    with terminal.progress("effects") as bar:
        answers = zip(sizes, plain.signatures(sizes, study.jobs), strict=True)
        for done, (id, signature) in enumerate(answers, start=1):
            bar.at(done, len(sizes))
            if isinstance(signature, EvaluationFailed):
                failed += 1
                terminal.error(f"{id}: {signature}")
                continue
            terminal.detail(id)
            found.append({**entries[id], **signature_entry(signature, values)})
            if pictures:
                from ..report.figure import save
                from ..report.signature import draw_signature

                save(draw_signature(signature), run.new / f"effect_{id}.png")
    found = run.write_json("effects.json", found)
    run.finish()
    terminal.result(found)
    if found:
        terminal.show(shown(signatures_table(found)))
    terminal.say(f"results in {run.folder}")
    return EXIT_SOLVER if failed else 0


def _variables_in(assignments: tuple[str, ...], values: Mapping[str, float]) -> list[str]:
    """Variables among what is set."""
    from ..tyre.case import parse_assignment

    return [name for name, _ in map(parse_assignment, assignments) if name in values]


def _pressures(loaded: Any, text: str | None, allowed: bool) -> list[float]:
    """Pressures in kPa. Raises click.UsageError."""
    from math import isfinite

    if text is None:
        nominal = loaded.case.pressure_kPa
        return [round(nominal * share / 3, 6) for share in (2, 3, 4)]
    found = []
    for word in text.split(","):
        try:
            found.append(float(word))
        except ValueError:
            raise click.UsageError(f"--pressures-kPa: '{word.strip()}' is no number") from None
        if not (isfinite(found[-1]) and 0 < found[-1] < 2000) or found.count(found[-1]) > 1:
            raise click.UsageError(
                f"--pressures-kPa {found[-1]:g}: must be pressures between 0 and 2000, each once"
            )
        option = f"--pressures-kPa {found[-1]:g}"
        arguments.refuse_unusual(loaded, option, "pressure_kPa", found[-1], allowed)
    return found
