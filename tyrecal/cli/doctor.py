"""tyrecal doctor"""

from __future__ import annotations

from pathlib import Path

import click

from ..files import Json
from . import complete, options
from .main import EXIT_SOLVER
from .parameters import FileOrFolder, option
from .solvers import command_words, settings_file, settings_words
from .terminal import Terminal

HINTS = {
    "abaqus": "set 'commands: {abaqus: ...}' in your settings to start it",
    "calculix": "on Debian 'apt-get install calculix-ccx'",
}


@click.command()
@option(
    "--solver",
    default="bundled",
    show_default=True,
    metavar="NAME",
    shell_complete=complete.solvers,
    help="Solver that evaluates the known tyre.",
)
@option(
    "--store",
    type=FileOrFolder(file=False),
    envvar="TYRECAL_STORE",
    metavar="DIR",
    help="Evaluation store to list (default: those of the results folders here, or TYRECAL_STORE).",
)
@options.with_terminal
def command(solver: str, store: Path | None, terminal: Terminal) -> int:
    """Check the installation: packages, solvers, machine, stores, and a known tyre's frequencies.

    The tyre takes a second or two. Exit code 3 if a package is missing or too old, or if the
    frequencies differ from the recorded ones.

    \b
    tyrecal doctor
    tyrecal doctor --solver calculix
    tyrecal doctor --json
    """
    from ..simulate.doctor.installation import extras, machine, packages, records
    from ..simulate.doctor.self_check import self_check
    from ..simulate.evaluate.solver import installed
    from ..version import __version__

    with terminal.progress("known tyre"):
        check = self_check(solver)
    report: Json = {
        "format": 1,
        "tyrecal": __version__,
        "installed_in": str(Path(__file__).parents[1]),
        "machine": machine(),
        "packages": packages(),
        "extras": extras(),
        "settings": settings_file(),
        "solvers": installed(),
        "store": str(store) if store else None,
        "records": records(store),
        "self_check": check,
    }
    report["ok"] = bool(check["ok"]) and all(each["ok"] for each in report["packages"])
    terminal.result(report)
    if not terminal.as_json:
        terminal.say("\n".join(_words(report)))
    for package in report["packages"]:
        if not package["ok"]:
            there = package["version"] or "not installed"
            terminal.error(f"{package['name']} must be {package['needed']}, it is {there}")
    if not check["ok"]:
        terminal.error(
            f"the known tyre: {check['problem'] or 'its numbers differ from the recorded ones'}"
        )
    return 0 if report["ok"] else EXIT_SOLVER


def _words(report: Json) -> list[str]:
    """Lines of the report for people."""
    from ..simulate.modes.label import in_words

    here, check = report["machine"], report["self_check"]
    known = [here[key] for key in ("free_memory_GB", "memory_GB") if here[key] is not None]
    of = " of ".join(f"{each:g}" for each in known) or "unknown"
    lines = [f"tyrecal {report['tyrecal']} in {report['installed_in']}"]
    lines += [f"Python {here['python']}, {here['system']}"]
    lines += [f"{here['cores']} cores, {of} GB of memory, {here['free_disc_GB']:g} GB of disk free"]
    lines += [
        "",
        "packages: " + ", ".join(f"{p['name']} {p['version']}" for p in report["packages"]),
    ]
    for extra in report["extras"]:
        there = f"missing {', '.join(extra['missing'])}: {extra['install']} in a clone of tyrecal"
        lines.append(f"  [{extra['name']}] " + (there if extra["missing"] else "installed"))
    lines += ["", f"settings: {settings_words(report['settings'])}", "", "solvers:"]
    for solver in report["solvers"]:
        state = solver["problem"] or f"version {solver['version']}"
        hint = HINTS.get(solver["name"]) if solver["problem"] else None
        about = "; ".join(filter(None, (state, command_words(solver), hint)))
        lines.append(f"  {solver['name']}: {about}")
    lines += ["", "evaluation stores:"]
    for record in report["records"]:
        lines.append(f"  {record['folder']}: {record['records']} evaluations, {record['MB']:g} MB")
    if not report["records"]:
        lines.append("  none here yet; each is next to its results, or in --store DIR")
    lines += ["", f"a known tyre by solver '{check['solver']}', {check['seconds']:g} s:"]
    for mode in check["modes"]:
        hertz, off = mode["frequency_Hz"], mode["deviation_percent"]
        now = "not found" if hertz is None else f"{hertz:.2f} Hz ({off:+z.3f} %)"
        lines.append(
            f"  {in_words(mode['label']):<17}recorded {mode['recorded_Hz']:.2f}, now {now}"
        )
    verdict = "as recorded" if check["ok"] else "NOT as recorded"
    return [*lines, f"  {verdict}, within {check['tolerance_percent']:g} %"]
