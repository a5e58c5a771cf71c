"""tyrecal solvers"""

from __future__ import annotations

import click

from . import options
from .talk import Talk


@click.command()
@options.talking
def command(talk: Talk) -> int:
    """List the installed solvers: version, what they can do, why one cannot be used.

    \b
    tyrecal solvers
    tyrecal fit cases/p235_75r17.yaml --solver bundled
    """
    from ..evaluate.solver import installed
    from ..report.table import solvers_table

    found = installed()
    talk.result(found)
    talk.show(solvers_table(found))
    return 0
