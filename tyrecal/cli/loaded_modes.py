"""tyrecal modes --load-N and --sweep-load: the tyre on the road"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from .arguments import parse_loads
from .main import EXIT_SOLVER
from .options import Study

if TYPE_CHECKING:
    from ..tyre.case import LoadedCase


def wanted_loads(load_N: float | None, sweep: str | None) -> list[float]:
    """The loads asked for, N; empty: the unloaded tyre alone. Raises click.UsageError."""
    if load_N is not None and sweep is not None:
        raise click.UsageError("give --load-N or --sweep-load, not both")
    if sweep is not None:
        loads = parse_loads(sweep, "--sweep-load", zero=True)
        if loads == [0.0]:
            raise click.UsageError("--sweep-load needs a load above 0")
        return loads
    return [] if load_N is None else parse_loads(repr(load_N), "--load-N")


def at_load(
    loaded: LoadedCase,
    evaluator: Any,
    run: Any,
    values: Mapping[str, float],
    load_N: float,
    study: Study,
) -> int:
    """Modes under one load, in modes.json, with their shapes in modes_shapes.json."""
    from ..report.shape_data import loaded_data
    from ..report.table import shown
    from ..studies.loaded import LoadedTyre, load_tyres
    from ..studies.loaded_result import loaded_modes_result

    terminal = study.terminal
    with terminal.progress(f"modes at {load_N:g} N") as bar:
        evaluator.on_progress = bar.at
        outcome = load_tyres(loaded, evaluator, {"initial": values}, [load_N])["initial"]
    if not isinstance(outcome, LoadedTyre):
        raise outcome
    found = run.write(loaded_modes_result(values, outcome))
    run.write_json("modes_shapes.json", loaded_data(outcome, loaded))
    run.finish()
    terminal.result(found.content())
    terminal.show(shown(*found.tables()))
    for sentence in found.sentences():
        terminal.say(sentence)
    study.page(run)
    return 0


def over_loads(
    loaded: LoadedCase,
    evaluator: Any,
    output: Any,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    study: Study,
    pictures: bool,
) -> int:
    """Modes over the load, in load_sweep.json, .csv and .png."""
    from ..studies.loaded_result import run

    with study.terminal.progress("modes on the road") as bar:
        evaluator.on_progress = bar.at
        found = run(loaded, evaluator, designs, loads_N, study.jobs, study.notify)
    if not found.rows:
        return EXIT_SOLVER
    figures = {}
    if pictures:
        from ..report.load import draw_load_sweep

        figures["load_sweep"] = draw_load_sweep(found.rows)
    return study.present(output, found, figures)
