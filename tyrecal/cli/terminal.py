"""Output of commands: words for people, results for programs, the progress of long work."""

from __future__ import annotations

import logging
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import click

from ..files import NotWritten, json_text, printable
from .progress import BETWEEN_S, clock

SOLVERS = "tyrecal_solvers"  # logger of the solvers that ship
RESUME = "tyrecal.resume"  # key of the context's notes: how to go on after Ctrl-C


def coloured() -> bool | None:
    """False where colours are disabled (https://no-color.org), None: on terminals only."""
    unwanted = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return False if unwanted else None


def error(text: str) -> None:
    """Print what went wrong, in red on a terminal."""
    say(click.style(f"error: {_plain(text)}", fg="red"), err=True, color=coloured())


def _plain(text: str) -> str:
    """Lines without control characters: names and words may come from a stranger's files."""
    return "\n".join(map(printable, text.split("\n")))


def say(text: str, err: bool = False, **how: Any) -> None:
    """Print. Raises OSError where standard output is a file on a full disc."""
    with _reaching(err):
        click.echo(text, err=err, **how)


@contextmanager
def _reaching(err: bool) -> Iterator[None]:
    """A reader that has closed the pipe (`| head`) misses the rest, and costs no result. Where
    standard error is full, or its terminal gone, no message is possible."""
    try:
        yield
    except OSError as error:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, (sys.stderr if err else sys.stdout).fileno())
        os.close(nowhere)
        if not err and not isinstance(error, BrokenPipeError):
            raise NotWritten(error.errno, error.strerror, "standard output") from None


def resume(words: str) -> None:
    """Have Ctrl-C print how to continue."""
    click.get_current_context().meta[RESUME] = words


@dataclass(frozen=True)
class Terminal:
    """Output of a command under --json, --quiet and --verbose.

    Results go to standard output; beside --json only the JSON does. Errors and warnings go to
    standard error, whatever is asked for.
    """

    as_json: bool = False
    quiet: bool = False
    verbose: bool = False

    def say(self, text: str) -> None:
        """A line of the result, for people: on standard error beside JSON."""
        if not self.quiet:
            say(_plain(text), err=self.as_json)

    def note(self, text: str) -> None:
        """A remark on the result, always on standard error."""
        if not self.quiet:
            say(_plain(text), err=True)

    def show(self, table: Any, beside_json: bool = False) -> None:
        """A table of the result, for people; beside JSON, which holds the same, only on demand."""
        if self.quiet or (self.as_json and not beside_json):
            return
        from rich.console import Console

        console = Console(stderr=self.as_json)
        if not console.is_terminal:
            console = Console(stderr=self.as_json, width=110)
        with (
            _reaching(self.as_json),
            console.capture() as text,
        ):  # rich answers a closed pipe by leaving the process
            console.print(table)
        say(text.get(), nl=False, err=self.as_json, color=coloured())

    def result(self, content: Any) -> None:
        """The result for programs, where they ask for it."""
        if self.as_json:
            say(json_text(content), nl=False)

    def detail(self, text: str) -> None:
        """Print a line that only --verbose shows."""
        if self.verbose:
            say(_plain(text), err=True)

    def warn(self, text: str) -> None:
        """Print a warning that must not be overlooked."""
        say(click.style(_plain(text), fg="yellow"), err=True, color=coloured())

    def error(self, text: str) -> None:
        """Print what went wrong without ending the command."""
        error(text)

    @contextmanager
    def progress(self, what: str, stages: Sequence[str] = ()) -> Iterator[Progress]:
        """How far ``what`` is while it lasts, on standard error: a bar on a terminal, elsewhere a
        line for each of its ``stages`` and now and then one more; nothing with --quiet."""
        if self.quiet:
            yield Progress(what)
            return
        if not sys.stderr.isatty() or os.environ.get("TERM") == "dumb":
            with _listening(Progress(what, stages, self.note)) as progress:
                progress.begin("")
                yield progress
            return
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, TextColumn
        from rich.progress import Progress as Bar
        from rich.text import Text

        class Clock(ProgressColumn):
            """Goes on between two designs."""

            def render(self, task: Any) -> Text:
                return Text(shown.clock(time.monotonic()))

        shown = Progress(what, stages)
        with (
            Bar(
                TextColumn("{task.description}", markup=False),
                BarColumn(bar_width=20),
                MofNCompleteColumn(),
                Clock(),
                console=Console(stderr=True),
                transient=True,
            ) as bar,
            _listening(shown),
        ):
            shown.show_on(bar)
            yield shown


@contextmanager
def _listening(progress: Progress) -> Iterator[Progress]:
    """Context in which the solver's messages on loads move the progress bar."""
    listener = _Loads(progress)
    log = logging.getLogger(SOLVERS)
    level = log.level
    log.addHandler(listener)
    log.setLevel(min(level or logging.INFO, logging.INFO))  # --verbose wants more
    try:
        yield progress
    finally:
        log.removeHandler(listener)
        log.setLevel(level)


class Progress:
    """Progress of the work: on a ``bar``, or by lines that ``say`` gets; else does nothing."""

    def __init__(
        self, what: str, stages: Sequence[str] = (), say: Callable[[str], None] | None = None
    ):
        self._what, self._stages, self._say = what, stages, say
        self._bar: Any = None
        self._task: Any = None
        self._done, self._began = 0.0, time.monotonic()
        self._total = self._before = self._piece = 0  # of the stage; before the last piece; of it
        self._of_stage = self._said = self._began

    def show_on(self, bar: Any) -> None:
        """Show progress on a rich bar from here on."""
        self._bar, self._task = bar, bar.add_task(self._what, total=None)

    def begin(self, stage: str) -> None:
        """A stage begins, one of ``stages``; without any, the whole."""
        if stage in self._stages:
            place = f"stage {self._stages.index(stage) + 1} of {len(self._stages)}"
            self._what = f"{place}, {stage}"
        if self._say and (stage or not self._stages):
            self._said = time.monotonic()
            self._say(f"{self._what} ...")
        self._reset()

    def at(self, done: int, total: int) -> None:
        """``done`` of ``total`` are finished, of what was begun last: 0, or another total, begins
        a further piece of the stage, which is counted on top of those before."""
        if total != self._piece or not done:
            self._before, self._piece = self._total, total
            self._total += total
            if self._bar:
                self._bar.update(self._task, total=self._total)
        self._show(self._before + done, self._what)

    def within(self, done: int, total: int) -> None:
        """``done`` of ``total`` parts of the next one are finished."""
        if done < total:
            whole = int(self._done)
            self._show(whole + done / total, f"{self._what}, load {done + 1} of {total}")

    def words(self, text: str) -> None:
        """Show the current work, in a few words."""
        self._show(self._done, f"{text:.60}")

    def _reset(self) -> None:
        self._done, self._of_stage = 0.0, time.monotonic()
        self._total = self._before = self._piece = 0
        if self._bar:
            self._bar.reset(self._task, total=None)

    def _show(self, done: float, words: str) -> None:
        self._done, now = done, time.monotonic()
        if self._bar:
            # at once: the next may be done within a blink
            self._bar.update(self._task, completed=done, description=words, refresh=True)
        elif self._say and now > self._said + BETWEEN_S:
            self._said = now
            count = f", {int(done)} of {self._total} done" if self._total else ""
            self._say(f"{words}{count}, {self.clock(now)}")

    def clock(self, now: float) -> str:
        """Time elapsed in all and, once something is done, time left of this stage."""
        elapsed = f"{clock(now - self._began)} elapsed"
        if not 0 < self._done < self._total:
            return elapsed
        left = (now - self._of_stage) * (self._total / self._done - 1)
        return f"{elapsed}, {clock(left)} left" + (" in this stage" if self._stages else "")


class _Loads(logging.Handler):
    """Passes on what the solver reaches on the road: ``loads``, (done, total), of its records."""

    def __init__(self, progress: Progress):
        super().__init__(logging.INFO)
        self.progress = progress

    def emit(self, record: logging.LogRecord) -> None:
        if loads := getattr(record, "loads", None):
            self.progress.within(*loads)
        else:  # on the way to a load
            self.progress.words(record.getMessage())
