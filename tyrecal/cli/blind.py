"""tyrecal blind make, answer, score; power, the old name of plan"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from ..files import Json
from . import arguments, complete, options
from .parameters import FileOrFolder, WholeNumber, names_option, option
from .plan import command as plan
from .terminal import Progress, Terminal, resume, say

folder = click.argument("folder", type=FileOrFolder(file=False), metavar="DIR")
truth = option(
    "--truth",
    type=FileOrFolder(file=False),
    metavar="DIR",
    help="Folder of the sealed truth (default: DIR-truth, next to DIR).",
)


def trials_option(flag: str, name: str, default: int, what: str) -> Any:
    """The option for the number of trials of one kind."""
    number = WholeNumber(0)
    help = f"Trials {what}."
    return option(
        flag, name, type=number, default=default, show_default=True, metavar="N", help=help
    )


@dataclass(frozen=True)
class Trials:
    """Numbers of trials of each kind."""

    effects: int
    plain: int
    outside: int


@click.group()
def command() -> None:
    """Test the diagnosis on synthetic data with a hidden effect.

    \b
    tyrecal blind make trials --case cases/p235_75r17.yaml --effects 60 --none 40 --outside 20
    tyrecal blind answer trials --jobs 2
    tyrecal blind score trials
    """


@command.command(params=[*plan.params])
def power(**values: Any) -> int:
    """The old name of 'tyrecal plan', until version 0.3.0.

    \b
    tyrecal blind power cases/p235_75r17.yaml
    tyrecal plan cases/p235_75r17.yaml
    """
    say("'tyrecal blind power' is now 'tyrecal plan'; the old name goes in 0.3.0", err=True)
    assert plan.callback
    code: int = plan.callback(**values)
    return code


@command.command()
@folder
@option(
    "--case",
    "case_path",
    type=FileOrFolder(),
    required=True,
    metavar="CASE",
    shell_complete=complete.cases,
    help="Case with the plain model, its uncertainties and the measured modes.",
)
@trials_option("--effects", "effects", 60, "with an effect of the catalogue")
@trials_option("--none", "plain", 40, "without any")
@trials_option("--outside", "outside", 20, "with an error that the catalogue does not list")
@names_option(
    "--effect",
    "drawn",
    metavar="EFFECT",
    shell_complete=complete.effects,
    help="Effect to draw; repeatable (default: all that the case allows).",
)
@option(
    "--seed",
    type=WholeNumber(0),
    metavar="N",
    help="Seed of the random numbers (default: a secret one).",
)
@truth
@options.every(options.jobs, options.allow_unusual)
@options.packed("trials", Trials)
@options.with_study
def make(
    folder: Path,
    case_path: Path,
    trials: Trials,
    drawn: tuple[str, ...],
    seed: int | None,
    truth: Path | None,
    study: options.Study,
) -> int:
    """Draw tyres, compute them, seal the truth and write measurements to DIR.

    The measurements are computed by the model itself. The trials show the best that a diagnosis can
    reach (an inverse crime).

    Run the same command again to resume.

    \b
    tyrecal blind make trials --case cases/p235_75r17.yaml --effects 60 --none 40 --outside 20
    """
    from dataclasses import replace

    from ..measured.load import load_case
    from ..simulate.deck.tyre_design import TyreDesign
    from ..simulate.evaluate.evaluator import Evaluator
    from ..simulate.evaluate.store import Store
    from ..studies.blind.answer import rows_of, tyre_model
    from ..studies.blind.make import make as made
    from ..studies.blind.maker import bundled_maker
    from ..studies.blind.protocol import Protocol
    from ..studies.blind.ruler import measure

    counts = {"effect": trials.effects, "none": trials.plain, "outside": trials.outside}
    if not (number := sum(counts.values())):
        raise click.UsageError("there must be at least one trial")
    terminal, jobs = study.terminal, study.jobs
    case, sealed = load_case(case_path, study.allow_unusual), _sealed(folder, truth)
    resume("finished trials are kept; run the same command again to resume")
    store = Store((sealed / "record").resolve())
    maker = bundled_maker(case, store)
    for id in drawn:
        arguments.refuse_unknown("--effect", id, maker.laws, "effect of these trials")
    if drawn:
        maker = replace(maker, laws={id: maker.laws[id] for id in drawn})
    protocol = Protocol(maker.about, case.path.name, counts).about(case.case.pressure_kPa)
    evaluator = Evaluator(TyreDesign(case), "bundled", store=store)

    def ruler() -> Json:
        """How hard each trial is, see `blind.ruler`."""
        return measure(tyre_model(case, evaluator, protocol, jobs), rows_of(case, protocol))

    with terminal.progress("make trials") as bar:
        progress = _progress("made", terminal, bar)
        sha256 = made(folder, sealed, case, protocol, maker, ruler, jobs, seed, progress)
    result = {"trials": number, "folder": str(folder), "truth": str(sealed), "sha256": sha256}
    terminal.result(result)
    terminal.say(f"{number} trials in {folder}; the truth is in {sealed}, sha256 {sha256}")
    return 0


@command.command()
@folder
@names_option(
    "--effect",
    "effects",
    metavar="EFFECT",
    shell_complete=complete.effects,
    help="Effect to consider; repeatable (default: all).",
)
@options.every(options.jobs, options.store)
@options.with_terminal
def answer(
    folder: Path, effects: tuple[str, ...], jobs: int, store: Path | None, terminal: Terminal
) -> int:
    """Answer every trial of DIR with the diagnosis; reads only DIR.

    Finished answers are kept. Run the same command again to resume.

    \b
    tyrecal blind answer trials --jobs 2
    """
    from ..simulate.deck.tyre_design import TyreDesign
    from ..simulate.evaluate.evaluator import Evaluator
    from ..simulate.evaluate.store import Store
    from ..studies.blind import answer as blind
    from ..studies.blind.protocol import read_protocol, refuse_open_truth
    from ..tyre.effects import catalogue

    for id in effects:
        arguments.refuse_unknown("--effect", id, catalogue(), "effect")
    refuse_open_truth(folder)
    protocol, case = read_protocol(folder), blind.case_of(folder)
    resume("finished answers are kept; run the same command again to resume")
    evaluator = Evaluator(TyreDesign(case), store=Store((store or folder / "record").resolve()))
    model = blind.tyre_model(case, evaluator, protocol, jobs, effects or None)
    with terminal.progress("answer trials") as bar:
        rows = blind.rows_of(case, protocol)
        sha256 = blind.answer(folder, model, rows, jobs, _progress("answered", terminal, bar))
    terminal.result({"folder": str(folder), "sha256": sha256})
    terminal.say(f"all trials of {folder} are answered, sha256 {sha256}")
    return 0


@command.command()
@folder
@truth
@options.with_terminal
def score(folder: Path, truth: Path | None, terminal: Terminal) -> int:
    """Open the truth and score the answers of DIR: score.json, score.md.

    The seals are checked first: neither the truth nor the answers may have changed.

    \b
    tyrecal blind score trials --json
    """
    from ..files import write_text
    from ..report.blind import page
    from ..studies.blind.protocol import read_protocol, write_json
    from ..studies.blind.score import score as scored
    from ..studies.blind.score import summary

    figures = summary(scored(folder, _sealed(folder, truth)))
    write_json(folder / "score.json", figures)
    words = page(figures, read_protocol(folder).maker)
    write_text(folder / "score.md", words)
    terminal.result(figures)
    terminal.say(words)
    return 0


def _sealed(folder: Path, truth: Path | None) -> Path:
    """Folder of the sealed truth of the trials in ``folder``."""
    return truth or folder.with_name(f"{folder.name}-truth")


def _progress(what: str, terminal: Terminal, bar: Progress) -> Callable[[int, int], None]:
    """Function that moves the bar, and prints a line after every tenth of the trials."""

    def on_progress(done: int, total: int) -> None:
        bar.at(done, total)
        if done == total or done % max(1, total // 10) == 0:
            terminal.note(f"{what} {done} of {total}")

    return on_progress
