"""tyrecal modes --load-N and --sweep-load: the tyre on the road"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from .arguments import parse_loads
from .main import EXIT_SOLVER
from .options import Study

if TYPE_CHECKING:
    from ..case import LoadedCase


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
    from ..report.table import modes_table
    from ..studies.loaded import LoadedTyre, load_tyres
    from ..studies.loaded_result import loaded_modes_result

    talk = study.talk
    with talk.progress(f"modes at {load_N:g} N") as bar:
        evaluator.on_progress = bar.at
        outcome = load_tyres(loaded, evaluator, {"initial": values}, [load_N])["initial"]
    if not isinstance(outcome, LoadedTyre):
        raise outcome
    result = loaded_modes_result(values, outcome)
    result = run.write_json("modes.json", result)
    run.write_json("modes_shapes.json", loaded_data(outcome, loaded))
    run.finish()
    talk.result(result)
    talk.show(modes_table(result))
    for sentence in result["findings"]["words"]:
        talk.say(sentence)
    study.page(run)
    return 0


def over_loads(
    loaded: LoadedCase,
    evaluator: Any,
    run: Any,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    study: Study,
    pictures: bool,
) -> int:
    """Modes over the load, in load_sweep.json, .csv and .png."""
    from ..report.table import load_csv, load_table
    from ..studies.loaded import LoadedTyre, load_tyres, progress
    from ..studies.loaded_result import load_sweep_result

    talk, above = study.talk, [load for load in loads_N if load]

    def notify(design: str, outcome: Any) -> None:
        reached, failure = progress(outcome)
        if failure:
            talk.error(f"{design}, {above[reached]:g} N: {failure}")
        talk.detail(f"{design}: {reached} loads")

    with talk.progress("modes on the road") as bar:
        evaluator.on_progress = bar.at
        outcomes = load_tyres(loaded, evaluator, designs, loads_N, study.jobs, notify)
    if not any(isinstance(each, LoadedTyre) for each in outcomes.values()):
        return EXIT_SOLVER
    result = load_sweep_result(designs, loads_N, outcomes)
    result = run.write_json("load_sweep.json", result)
    run.write_text("load_sweep.csv", load_csv(result["rows"]))
    if pictures:
        from ..report.figure import save
        from ..report.load import draw_load_sweep

        save(draw_load_sweep(result["rows"]), run.new / "load_sweep.png")
    run.finish()
    talk.result(result)
    for found in result["findings"]:
        rows = [row for row in result["rows"] if row["design"] == found["design"]]
        talk.show(load_table(rows, found["design"]))
        for sentence in found["words"]:
            talk.say(f"{found['design']}: {sentence}")
    if result["failed"]:
        talk.error("not every load was reached; the loads below it are kept")
    study.finish(run)
    return EXIT_SOLVER if result["failed"] else 0
