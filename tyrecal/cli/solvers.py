"""tyrecal solvers"""

from __future__ import annotations

import click

from . import options


@click.command()
@click.option("--json", "as_json", is_flag=True, help="As JSON.")
@options.quiet
def command(as_json: bool, quiet: bool) -> int:
    """List the installed solvers: version, what they can do, why one cannot be used.

    \b
    tyrecal solvers
    tyrecal fit cases/p235_75r17.yaml --solver bundled
    """
    from ..evaluate.solver import installed
    from .output import print_json, show

    found = installed()
    if as_json:
        print_json(found)
    else:
        from ..report.table import solvers_table

        show(solvers_table(found), as_json, quiet)
    return 0
