"""Progress of a batch, and the time that it will still take."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from typing import Any

import click

BETWEEN_S = 30.0  # time between lines of progress if there is no terminal


class BatchProgress:
    """A bar on a terminal; else a line every `BETWEEN_S`, and one for each case that fails."""

    def __init__(self, total: int, quiet: bool, verbose: bool):
        self.total, self.quiet, self.verbose = total, quiet, verbose
        self.done = self.run = self.bad = 0  # cases: all, really run, not good
        self.began = self.reported = time.monotonic()
        self.bar: Any = None

    def __enter__(self) -> BatchProgress:
        if sys.stderr.isatty() and not self.quiet:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

            columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
            self.bar = Progress(*columns, console=Console(stderr=True), transient=True)
            self.bar.start()
            self.bar.add_task("", total=self.total)
        return self

    def __exit__(self, *_: object) -> None:
        if self.bar:
            self.bar.stop()

    def notify(self, report: Mapping[str, Any]) -> None:
        """Count and show a finished case."""
        entries = report["studies"]
        bad = [study for study, entry in entries.items() if entry["status"] != "good"]
        self.done, self.bad = self.done + 1, self.bad + bool(bad)
        self.run += not report["facts"].get("answered", False)
        now = time.monotonic()
        if self.bar:
            self.bar.update(0, completed=self.done, description=self._state(now))
        elif not self.quiet and (self.verbose or bad or now > self.reported + BETWEEN_S):
            self.reported = now
            what = ", ".join(f"{study}: {entries[study]['status']}" for study in bad) or "good"
            click.echo(
                f"{self.done}/{self.total} {report['name']}: {what}; {self._state(now)}", err=True
            )

    def _state(self, now: float) -> str:
        bad = f"{self.bad} not good, " if self.bad else ""
        left = seconds_left(now - self.began, self.run, self.total - self.done)
        return bad + (f"{clock(left)} left" if left is not None else "answered from results")


def seconds_left(elapsed_s: float, run: int, left: int) -> float | None:
    """Time of the ``left`` cases, if ``run`` cases took ``elapsed_s``; None if none has run.

    Cases with results of an earlier run take almost no time, so they do not count.
    """
    return elapsed_s * left / run if run else None


def clock(seconds: float) -> str:
    """Minutes and seconds, with hours if there are any."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
