"""tyrecal deck"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from ..errors import InputError
from ..files import Json
from . import arguments, options
from .main import EXIT_INPUT
from .parameters import option
from .terminal import Terminal

if TYPE_CHECKING:
    from ..tyre.case import LoadedCase
    from ..tyre.own_deck.gauge import Gauges
    from ..tyre.own_deck.own_decks import OwnDecks
    from ..tyre.own_deck.text import Block

MAX_DECK_DOUBTS = 10  # printed sentences on lines that are not checked for ABAQUS


@click.command()
@option(
    "--check",
    is_flag=True,
    help="List the content of CASE, a case or your own ABAQUS deck (FILE.inp), and write nothing.",
)
@options.every(
    options.case_argument,
    options.assignments,
    options.pressure,
    options.loads,
    options.fitted(),
    options.mesh,
    options.solver,
    options.output,
    options.allow_unusual,
)
@options.with_study
def command(case: Path, loads: str | None, check: bool, study: options.Study) -> int:
    """Write the decks of CASE, to read or to run elsewhere.

    \b
    tyrecal deck cases/p235_75r17.yaml --output decks
    python -m tyrecal_solvers.bundled decks/modes --oldjob inflate
    tyrecal deck cases/p235_75r17.yaml --output pressed --loads-N 3000,5000
    tyrecal deck cases/p235_75r17.yaml --fitted p235_75r17 --output fitted_decks
    tyrecal deck --check my_tyre.inp
    """
    terminal = study.terminal
    if check:
        if study.fitted:
            raise click.UsageError("--check takes no --fitted")
        return _check(case, study)
    from ..files import atomic_write, private_dir
    from ..simulate.deck.decks import Decks
    from ..simulate.deck.decks_design import design_of
    from ..simulate.evaluate.evaluator import Evaluator
    from ..simulate.evaluate.failure import DeckRefused
    from .output import Run

    if loads is not None:
        arguments.refuse_set(study.assignments, "road.loads_N", "--loads-N")
    loaded, _ = study.load(case)
    loaded, values = study.one_design(loaded)
    design = design_of(loaded, values)
    evaluator = Evaluator(design, study.solver)
    adapter = evaluator.solver
    evaluator.refuse_lacking(design)
    if loads is not None:
        evaluator.needs_road()
        loads_N = arguments.parse_loads(loads)
        arguments.refuse_unusual_loads(loaded, "--loads-N", loads_N, study.allow_unusual)
        decks = Decks(design, loads_N=tuple(loads_N))
    else:
        decks = Decks(design, tuple(values) if evaluator.has_gradients else ())
    paths = []
    with TemporaryDirectory() as fresh:  # an adapter writes plainly, and could follow links
        try:
            written = adapter.write(decks, Path(fresh))
        except adapter.refusals as error:
            raise DeckRefused(str(error)) from None
        # what is refused leaves the folder untouched
        run = Run(case, study.output, "deck", adapter, loaded=loaded)
        for path in written:
            place = run.folder / path.relative_to(fresh)  # included files may be in folders
            for above in reversed(place.relative_to(run.folder).parents[:-1]):
                private_dir(run.folder / above)
            paths.append(str(place))
            with atomic_write(place) as partial:
                shutil.copyfile(path, partial)
    run.finish()
    terminal.result(paths)
    if not terminal.as_json:
        terminal.say("\n".join(paths))
    terminal.detail(f"written for solver '{adapter.name}' from the templates '{adapter.dialect}'")
    return 0


def _check(path: Path, study: options.Study) -> int:
    """Print what a user's deck holds, which of its numbers have paths, what is wrong with it for
    the bundled solver and for ABAQUS, and what CalculiX lacks. Raises click.UsageError,
    InputError."""
    from ..simulate.deck.own import asked_by_abaqus, lacking_in_calculix
    from ..tyre.case.kinds.section_deck import trial
    from ..tyre.case.kinds.user_decks import DecksIn3D
    from ..tyre.own_deck.own_deck import read_own_deck
    from ..tyre.own_deck.summary import contents, words
    from ..tyre.own_deck.text import OwnDeckError
    from ..tyre.usual_deck import deck_slips

    terminal = study.terminal
    numbers: Mapping[str, float] = {}
    gauges: Gauges = ()
    if path.suffix in (".yaml", ".yml"):
        loaded, _ = replace(study, pressure_kPa=None, allow_unusual=True).load(path)
        if isinstance(loaded.kind, DecksIn3D):
            content = describe_decks(loaded, loaded.kind.decks, terminal)
            terminal.result(content)
            refused = content["abaqus"]["refuses"] and loaded.case.solver.name != "calculix"
            return EXIT_INPUT if refused else 0
        try:
            deck, gauges = loaded.kind.deck, loaded.kind.source(loaded.case).thickened
        except InputError as error:
            hint = f"'{path}' names no deck; to check it, run 'tyrecal validate'"
            raise click.UsageError(hint) from error
        numbers = loaded.deck_numbers
    else:
        if not path.is_file():
            raise click.UsageError(f"there is no file '{path}'")
        deck = read_own_deck(path)
    blocks = deck.with_numbers(numbers)
    report, lacking = asked_by_abaqus(blocks), lacking_in_calculix(blocks)
    result: Json = {"abaqus": report, "calculix": lacking, "refused": None}
    try:
        flat = deck.flat(numbers, gauges)
        mass_kg = trial(flat)
    except OwnDeckError as error:
        result["refused"] = str(error)
        terminal.error(f"not honoured: {error}")
    else:
        content, numbers = contents(deck, flat), {**deck.section_numbers, **numbers}
        for slip in deck_slips(deck, numbers):
            terminal.warn(str(slip))
        result |= {"mass_kg": mass_kg, **content, "numbers": numbers}
        for sentence in words(content, mass_kg):
            terminal.say(sentence)
        for name, value in numbers.items():
            terminal.say(f"  {name} = {value:g}")
    terminal.result(result)
    _say_what_solvers_take(report, lacking, terminal)
    return EXIT_INPUT if result["refused"] or report["refuses"] else 0


def _say_what_solvers_take(
    report: dict[str, list[str]], lacking: list[str], terminal: Terminal
) -> None:
    """Print the objections of ABAQUS and CalculiX to decks."""
    for sentence in report["refuses"]:
        terminal.error(f"ABAQUS refuses by its manual: {sentence}")
    for sentence in report["unknown"][:MAX_DECK_DOUBTS]:
        terminal.warn(f"not checked for ABAQUS: {sentence}")
    if more := len(report["unknown"][MAX_DECK_DOUBTS:]):
        terminal.warn(f"... and {more} more")
    for sentence in lacking:
        terminal.say(f"CalculiX does not honour: {sentence}")


def describe_decks(loaded: LoadedCase, decks: OwnDecks, terminal: Terminal) -> Json:
    """Print what is known of decks in three dimensions, what is added to them, what ABAQUS refuses
    of them by its manual, and what CalculiX lacks; returns the same as data."""
    from ..simulate.deck.decks_design import OUTPUT, added_words
    from ..simulate.deck.own import asked_by_abaqus, lacking_in_calculix

    numbers = loaded.deck_numbers
    jobs_blocks = decks.with_numbers(numbers, 1e3 * loaded.case.pressure_kPa)  # Pa
    report: dict[str, list[str]] = {"refuses": [], "unknown": []}
    before: list[Block] = []
    for (_, old_job), blocks in zip(decks.jobs, jobs_blocks, strict=True):
        before = before if old_job else []  # blocks of the jobs that this one continues
        for kind, sentences in asked_by_abaqus(blocks, before).items():
            report[kind] += sentences
        before = [*before, *blocks]
    lacking = lacking_in_calculix(before)  # of the last chain of jobs
    places = [f"{row.place.file}, line {row.place.line}" for _, row, *_ in decks.pressures]
    added = {solver: added_words(decks, solver) for solver in OUTPUT}
    jobs = [f"{job}, which continues {old}" if old else job for job, old in decks.jobs]
    terminal.say(f"jobs: {'; '.join(jobs)}; units {decks.units}")
    terminal.say(f"modes: {decks.modes or 'those in a range'}, named by the node set {decks.crown}")
    terminal.say(f"pressure: {'; '.join(places) or 'by its mark'}")
    for name, value in numbers.items():
        terminal.say(f"  {name} = {value:g}")
    for solver, words in added.items():
        terminal.say(f"{solver}: {words or 'nothing is added'}")
    _say_what_solvers_take(report, lacking, terminal)
    return {
        "jobs": decks.jobs,
        "units": decks.units,
        "modes": decks.modes,
        "crown": decks.crown,
        "pressure": places,
        "numbers": dict(numbers),
        "added": added,
        "abaqus": report,
        "calculix": lacking,
    }
