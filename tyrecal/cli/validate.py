"""tyrecal validate"""

from __future__ import annotations

from pathlib import Path

import click

from . import options
from .main import EXIT_INPUT
from .terminal import Terminal


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
    from ..tyre.load import load_case, validate

    mistakes = validate(case, allow_unusual)
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
    if mistakes:
        return EXIT_INPUT
    loaded = load_case(case, allow_unusual)
    for sentence in overruled(loaded):
        terminal.warn(sentence)
    terminal.say(f"{case}: no mistakes")
    if not loaded.case.targets.weights:
        terminal.note("it has no targets: 'tyrecal fit' needs some, or --measured FILE")
    return 0
