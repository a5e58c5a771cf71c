"""The results folder, what is printed where, and the volatile facts of a run."""

from __future__ import annotations

import json
import platform
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import click


class OutputRefused(ValueError):
    """The results folder belongs to another case."""


class Run:
    """One command's run: its folder, and run.json, which holds all that differs between runs.

    Raises OutputRefused where the folder holds another case's results; OSError.
    """

    def __init__(self, case: Path, output: Path | None, command: str, solver: Any = None):
        self.case, self.command, self.solver = case.resolve(), command, solver
        self.folder = output or Path(case.stem)
        self.started, self._clock = datetime.now(UTC), time.monotonic()
        record = self.folder / "run.json"
        if record.exists():
            try:
                owner = json.loads(record.read_text()).get("case")
            except ValueError:
                owner = None
            if owner != str(self.case):
                raise OutputRefused(
                    f"folder '{self.folder}' holds results of {owner or 'something else'};"
                    " give another one with --output"
                )
        elif self.folder.exists() and not self.folder.is_dir():
            raise OutputRefused(f"'{self.folder}' is a file; give a folder with --output")
        self.folder.mkdir(parents=True, exist_ok=True)
        self.finish()

    def write_json(self, name: str, content: Any) -> Path:
        """Write a result file whole or not at all."""
        text = json.dumps(content, indent=1, allow_nan=False) + "\n"
        return self.write_text(name, text)

    def write_text(self, name: str, text: str) -> Path:
        """Write a result file whole or not at all."""
        path, partial = self.folder / name, self.folder / f".{name}.partial"
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)
        return path

    @property
    def runs(self) -> Path:
        """Where the solver's run folders go."""
        return self.folder / "runs"

    def finish(self, **facts: Any) -> None:
        """Write run.json: command, times, host, versions, and what else is volatile."""
        import tyrecal

        if self.runs.is_dir() and not any(self.runs.iterdir()):
            self.runs.rmdir()
        self.write_json(
            "run.json",
            {
                "case": str(self.case),
                "command": self.command,
                "arguments": sys.argv[1:],
                "started": self.started.isoformat(timespec="seconds"),
                "seconds": round(time.monotonic() - self._clock, 3),
                "host": platform.node(),
                "python": platform.python_version(),
                "tyrecal": tyrecal.__version__,
                "solver": f"{self.solver.name} {self.solver.version}" if self.solver else None,
                **facts,
            },
        )


def say(text: str, as_json: bool, quiet: bool) -> None:
    """A line for people: on standard output, or standard error beside JSON."""
    if not quiet:
        click.echo(text, err=as_json)


def show(table: Any, as_json: bool, quiet: bool) -> None:
    """A rich table for people, likewise."""
    if quiet:
        return
    from rich.console import Console

    console = Console(stderr=as_json)
    if not console.is_terminal:
        console = Console(stderr=as_json, width=110)
    console.print(table)


def print_json(content: Any) -> None:
    """A result on standard output, for programs."""
    click.echo(json.dumps(content, indent=1, allow_nan=False))
