"""How commands talk: words for people, results for programs, how far long work is."""

from __future__ import annotations

import logging
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import click

from ..files import json_text

SOLVERS = "tyrecal_solvers"  # logger of the solvers that ship
RESUME = "tyrecal.resume"  # key of the context's notes: how to go on after Ctrl-C


def coloured() -> bool | None:
    """False where nobody wants colours (https://no-color.org), None: on terminals only."""
    unwanted = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return False if unwanted else None


def error(text: str) -> None:
    """What went wrong, in red on a terminal."""
    _echo(click.style(f"error: {text}", fg="red"), err=True, color=coloured())


def _echo(text: str, err: bool = False, **how: Any) -> None:
    """Print; a reader that has closed the pipe (`| head`) misses the rest, and costs no result."""
    try:
        click.echo(text, err=err, **how)
    except BrokenPipeError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, (sys.stderr if err else sys.stdout).fileno())
        os.close(nowhere)


def resume(words: str) -> None:
    """Have Ctrl-C say how to go on."""
    click.get_current_context().meta[RESUME] = words


@dataclass(frozen=True)
class Talk:
    """What --json, --quiet and --verbose make of a command's words.

    Results go to standard output; beside --json only the JSON does. Errors and warnings go to
    standard error, whatever is asked for.
    """

    as_json: bool = False
    quiet: bool = False
    verbose: bool = False

    def say(self, text: str) -> None:
        """A line of the result, for people: on standard error beside JSON."""
        if not self.quiet:
            _echo(text, err=self.as_json)

    def note(self, text: str) -> None:
        """A remark on the result, always on standard error."""
        if not self.quiet:
            _echo(text, err=True)

    def show(self, table: Any, beside_json: bool = False) -> None:
        """A table of the result, for people; beside JSON, which holds the same, only on demand."""
        if self.quiet or (self.as_json and not beside_json):
            return
        from rich.console import Console

        console = Console(stderr=self.as_json)
        if not console.is_terminal:
            console = Console(stderr=self.as_json, width=110)
        with console.capture() as text:  # rich answers a closed pipe by leaving the process
            console.print(table)
        _echo(text.get(), nl=False, err=self.as_json, color=coloured())

    def result(self, content: Any) -> None:
        """The result for programs, where they ask for it."""
        if self.as_json:
            _echo(json_text(content), nl=False)

    def detail(self, text: str) -> None:
        """What only --verbose wants to know."""
        if self.verbose:
            _echo(text, err=True)

    def warn(self, text: str) -> None:
        """What must not be overlooked."""
        _echo(click.style(text, fg="yellow"), err=True, color=coloured())

    def error(self, text: str) -> None:
        """What went wrong and does not end the command."""
        error(text)

    @contextmanager
    def progress(self, what: str) -> Iterator[Progress]:
        """A bar with the time left, while it lasts: on standard error, only on a terminal."""
        if self.quiet or not sys.stderr.isatty() or os.environ.get("TERM") == "dumb":
            yield Progress()
            return
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )
        from rich.progress import Progress as Bar

        with Bar(
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=20),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
            speed_estimate_period=3600.0,  # an evaluation can take minutes
        ) as bar:
            progress = Progress(bar, bar.add_task(what, total=None), what)
            listener = _Loads(progress)
            log = logging.getLogger(SOLVERS)
            level = log.level
            log.addHandler(listener)
            log.setLevel(logging.INFO)
            try:
                yield progress
            finally:
                log.removeHandler(listener)
                log.setLevel(level)


class Progress:
    """How far the work is; does nothing where nobody looks."""

    def __init__(self, bar: Any = None, task: Any = None, what: str = ""):
        self._bar, self._task, self._what, self._done, self._total = bar, task, what, 0, 0

    def at(self, done: int, total: int) -> None:
        """``done`` of ``total`` are finished; another total is another piece of work."""
        if self._bar is None:
            return
        if total != self._total or not done:
            self._bar.reset(self._task, total=total)
            self._total = total
        self._done = done
        self._bar.update(self._task, completed=done, description=self._what)

    def within(self, done: int, total: int) -> None:
        """``done`` of ``total`` parts of the next one are finished."""
        if self._bar is not None and done < total:
            self.words(f"{self._what}, load {done + 1} of {total}")
            self._bar.update(self._task, completed=self._done + done / total)

    def words(self, text: str) -> None:
        """What is being done, in a few words."""
        if self._bar is not None:
            self._bar.update(self._task, description=f"{text:.60}")


class _Loads(logging.Handler):
    """Hears the loads that the solver reaches on the road, one design after the other."""

    def __init__(self, progress: Progress):
        super().__init__()
        self.progress = progress

    def emit(self, record: logging.LogRecord) -> None:
        found = re.match(r"load (\d+) of (\d+)", record.getMessage())
        if found:
            self.progress.within(int(found[1]), int(found[2]))
