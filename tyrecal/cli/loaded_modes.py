"""tyrecal modes --load-N and --sweep-load: the tyre on the road"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import click

from .main import EXIT_SOLVER


def wanted_loads(load_N: float | None, sweep: str | None) -> list[float]:
    """The loads asked for, N; empty: the unloaded tyre alone. Raises click.UsageError."""
    from .options import parse_loads

    if load_N is not None and sweep is not None:
        raise click.UsageError("give --load-N or --sweep-load, not both")
    if sweep is not None:
        loads = parse_loads(sweep, "--sweep-load", zero=True)
        if loads == [0.0]:
            raise click.UsageError("--sweep-load needs a load above 0")
        return loads
    return [] if load_N is None else parse_loads(repr(load_N), "--load-N")


def at_load(
    door: Any,
    run: Any,
    values: Mapping[str, float],
    load_N: float,
    report: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Modes under one load, in modes.json, with their shapes in modes_shapes.json."""
    from ..report.kept import loaded_data
    from ..report.table import modes_table
    from ..studies.loaded import LoadedTyre, load_tyres
    from ..studies.loaded_result import loaded_modes_result
    from .output import print_json, say, show

    outcome = load_tyres(door, {"initial": values}, [load_N])["initial"]
    if not isinstance(outcome, LoadedTyre):
        raise outcome
    result = loaded_modes_result(values, outcome)
    run.write_json("modes.json", result)
    run.write_json("modes_shapes.json", loaded_data(outcome, door.case))
    run.finish(solver_runs=door.counts.runs, answered_from_record=door.counts.recorded)
    if as_json:
        print_json(result)
    else:
        show(modes_table(result), as_json, quiet)
    for sentence in result["findings"]["words"]:
        say(sentence, as_json, quiet)
    run.report(report, as_json, quiet)
    return 0


def over_loads(
    door: Any,
    run: Any,
    designs: Mapping[str, Mapping[str, float]],
    loads_N: Sequence[float],
    jobs: int,
    pictures: bool,
    report: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Modes over the load, in load_sweep.json, .csv and .png."""
    from ..report.table import load_csv, load_table
    from ..studies.loaded import LoadedTyre, load_tyres, progress
    from ..studies.loaded_result import load_sweep_result
    from .output import print_json, say, show

    above = [load for load in loads_N if load]

    def notify(design: str, outcome: Any) -> None:
        reached, failure = progress(outcome)
        if failure:
            text = f"error: {design}, {above[reached]:g} N: {failure}"
            click.secho(text, fg="red", err=True)

    outcomes = load_tyres(door, designs, loads_N, jobs, notify)
    if not any(isinstance(each, LoadedTyre) for each in outcomes.values()):
        return EXIT_SOLVER
    result = load_sweep_result(designs, loads_N, outcomes)
    run.write_json("load_sweep.json", result)
    run.write_text("load_sweep.csv", load_csv(result["rows"]))
    if pictures:
        from ..report.load import draw_load_sweep

        draw_load_sweep(run.folder / "load_sweep.png", result["rows"])
    run.finish(solver_runs=door.counts.runs, answered_from_record=door.counts.recorded)
    if as_json:
        print_json(result)
    for found in result["findings"]:
        rows = [row for row in result["rows"] if row["design"] == found["design"]]
        if not as_json:
            show(load_table(rows, found["design"]), as_json, quiet)
        for sentence in found["words"]:
            say(f"{found['design']}: {sentence}", as_json, quiet)
    if result["failed"]:
        text = "error: not every load was reached; the loads below it are kept"
        click.secho(text, fg="red", err=True)
    say(f"results in {run.folder}", as_json, quiet)
    run.report(report, as_json, quiet)
    return EXIT_SOLVER if result["failed"] else 0
