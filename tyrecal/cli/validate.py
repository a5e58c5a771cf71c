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
@options.talking
def command(case: Path, allow_unusual: bool, terminal: Terminal) -> int:
    """Check CASE and report every mistake: file, line, key, value, what would be right.

    Numbers that no tyre has are mistakes, too: most often they stand in another unit.

    \b
    tyrecal validate cases/p235_75r17.yaml
    tyrecal validate my.yaml --json
    """
    from ..tyre.case import overruled
    from ..tyre.load import judged

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
    if not loaded.case.targets.weights:
        terminal.note("it has no targets: 'tyrecal fit' needs some, or --measured FILE")
    return 0


def _refused(loaded: LoadedCase) -> Mistake | None:
    """What the bundled solver refuses of a deck of one's own that is meant for it."""
    from ..simulate.deck.own import trial
    from ..tyre.case.mistakes import Mistake
    from ..tyre.own_deck.text import OwnDeckError
    from ..tyre.resolve import resolved

    if not loaded.deck or loaded.case.solver.name != "bundled":
        return None
    try:
        trial(resolved(loaded).flat)
    except OwnDeckError as error:
        file = str(loaded.deck.path.parent / error.place.file)
        return Mistake(file, error.place.line, "", "", error.message)
    return None
