"""tyrecal validate"""

from __future__ import annotations

from pathlib import Path

import click

from . import options
from .main import EXIT_INPUT
from .talk import Talk


@click.command()
@options.case_argument
@options.talking
def command(case: Path, talk: Talk) -> int:
    """Check CASE and report every mistake: file, line, key, value, what would be right.

    \b
    tyrecal validate cases/p235_75r17.yaml
    tyrecal validate my.yaml --json
    """
    from ..case import load_case, overruled, validate

    mistakes = validate(case)
    for mistake in mistakes:
        talk.error(str(mistake))
    talk.result(
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
    for sentence in overruled(load_case(case)):
        talk.warn(sentence)
    talk.say(f"{case}: no mistakes")
    return 0
