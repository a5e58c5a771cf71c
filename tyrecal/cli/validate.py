"""tyrecal validate"""

from __future__ import annotations

from pathlib import Path

import click

from . import options


@click.command()
@options.case_argument
@options.as_json
@options.quiet
def command(case: Path, as_json: bool, quiet: bool) -> int:
    """Check CASE and report every mistake: file, line, key, value, what would be right."""
    from ..case import validate
    from .output import print_json, say

    mistakes = validate(case)
    for mistake in mistakes:
        click.echo(f"error: {mistake}", err=True)
    if as_json:
        print_json(
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
        return 2
    say(f"{case}: no mistakes", as_json, quiet)
    return 0
