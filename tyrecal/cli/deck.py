"""tyrecal deck"""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from . import arguments, options
from .talk import Talk


@click.command()
@options.every(
    options.case_argument,
    options.assignments,
    options.pressure,
    options.loads,
    options.mesh,
    options.solver,
    options.output,
    options.allow_unusual,
)
@options.talking
def command(
    case: Path,
    assignments: tuple[str, ...],
    pressure_kPa: float | None,
    loads: str | None,
    mesh: str,
    solver: str,
    output: Path | None,
    allow_unusual: bool,
    talk: Talk,
) -> int:
    """Write the decks of CASE, to read or to run elsewhere.

    \b
    tyrecal deck cases/p235_75r17.yaml --output decks
    python -m tyrecal_solvers.bundled decks/modes --oldjob inflate
    tyrecal deck cases/p235_75r17.yaml --output pressed --loads-N 3000,5000
    """
    from ..deck.write import Decks
    from ..evaluate.door import Door
    from ..files import whole
    from .output import Run

    loaded, values = arguments.load(case, mesh, assignments, pressure_kPa, talk, allow_unusual)
    door = Door(loaded, solver)
    adapter = door.solver
    door.needs_effects_of(loaded)
    if loads is not None:
        door.needs_road()
        asked = arguments.parse_loads(loads)
        arguments.refuse_unusual_loads(loaded, "--loads-N", asked, allow_unusual)
        decks = Decks(loaded, values, loads_N=tuple(asked))
    else:
        decks = Decks(loaded, values, tuple(values) if door.has_gradients else ())
    decks.texts(adapter.dialect)  # a template that fails leaves the folder untouched
    run = Run(case, output, "deck", adapter)
    paths = []
    with TemporaryDirectory() as fresh:  # an adapter's plain writing must meet no link
        for path in adapter.write(decks, Path(fresh)):
            paths.append(str(run.folder / path.name))
            with whole(run.folder / path.name) as partial:
                shutil.copyfile(path, partial)
    run.finish()
    talk.result(paths)
    if not talk.as_json:
        talk.say("\n".join(paths))
    talk.detail(f"written for solver '{adapter.name}' from the templates '{adapter.dialect}'")
    return 0
