"""tyrecal validate"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from . import options
from .main import EXIT_INPUT
from .terminal import Terminal

if TYPE_CHECKING:
    from ..tyre.case import LoadedCase
    from ..tyre.case.mistakes import Mistake


@click.command()
@options.case_argument
@options.allow_unusual
@options.with_terminal
def command(case: Path, allow_unusual: bool, terminal: Terminal) -> int:
    """Check CASE and report every mistake: file, line, key, value, what would be right.

    Numbers that no tyre has are reported too: most often their unit is wrong.

    \b
    tyrecal validate cases/p235_75r17.yaml
    tyrecal validate my.yaml --json
    """
    from ..measured.load import judged
    from ..tyre.case import overruled
    from ..tyre.case.case_text import flow_lines
    from ..tyre.case.hints import lossless_hint, prony_hints, slack_cord_hint

    loaded, mistakes = judged(case, allow_unusual)
    if loaded and (refused := _refused(loaded)):
        mistakes = [refused]
    for mistake in mistakes:
        terminal.error(str(mistake))
    terminal.result(
        [
            {
                "file": str(m.file),
                "line": m.line,
                "key": m.key,
                "value": m.value,
                "message": m.message,
            }
            for m in mistakes
        ]
    )
    if mistakes or loaded is None:
        return EXIT_INPUT
    for sentence in overruled(loaded):
        terminal.warn(sentence)
    terminal.say(f"{case}: no mistakes")
    if loaded.assumed:
        terminal.note(f"lines that are left out:\n{flow_lines(loaded.assumed)}")
    if not (loaded.case.targets.weights or loaded.measured):
        terminal.note("it has no targets: 'tyrecal fit' needs some, or --measured FILE")
    for sentence in (*lossless_hint(loaded), *prony_hints(loaded)):
        terminal.note(sentence)
    if "road" in loaded.file_data and (hint := slack_cord_hint(loaded)):
        terminal.note(hint)
    return 0


def _refused(loaded: LoadedCase) -> Mistake | None:
    """Mistake for which the solver of the case refuses a user's decks."""
    from ..simulate.deck.decks_design import design_of
    from ..simulate.evaluate.evaluator import Evaluator
    from ..simulate.evaluate.failure import DeckRefused
    from ..tyre.case.mistakes import Mistake
    from ..tyre.own_deck.text import OwnDeckError

    try:
        evaluator = Evaluator(design_of(loaded))
        evaluator.design.check(evaluator)
    except OwnDeckError as error:
        folder = loaded.kind.files(loaded.case, loaded.folder)[0].parent
        file, line = error.place
        return Mistake(str(folder / file), line, "", "", error.message)
    except DeckRefused as error:
        return Mistake(str(loaded.path), 0, "solver.name", loaded.case.solver.name, str(error))
    return None
