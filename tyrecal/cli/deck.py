"""tyrecal deck"""

from __future__ import annotations

from pathlib import Path

import click

from . import options


@click.command()
@options.every(
    options.case_argument,
    options.assignments,
    options.pressure,
    options.mesh,
    options.solver,
    options.output,
    options.as_json,
    options.quiet,
)
def command(
    case: Path,
    assignments: tuple[str, ...],
    pressure_kPa: float | None,
    mesh: str,
    solver: str,
    output: Path | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Write the decks of CASE, to read or to run elsewhere.

    \b
    tyrecal deck cases/p235_75r17.yaml --output decks
    python -m tyrecal_solvers.bundled decks/modes --oldjob inflate
    """
    from ..deck.write import Decks
    from ..evaluate.solver import find_solver
    from .output import Run, print_json, say

    loaded, values = options.load(case, mesh, assignments, pressure_kPa)
    adapter = find_solver(solver or loaded.case.solver.name)
    gradients = tuple(values) if "gradients" in adapter.capabilities else ()
    decks = Decks(loaded, values, gradients)
    decks.texts(adapter.dialect)  # a template that fails leaves the folder untouched
    run = Run(case, output, "deck", adapter)
    paths = [str(path) for path in adapter.write(decks, run.folder)]
    run.finish()
    if as_json:
        print_json(paths)
    say("\n".join(paths), as_json, quiet or as_json)
    return 0
