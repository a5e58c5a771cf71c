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
RESUME = "tyrecal.resume"  # key of click's context: how to continue after Ctrl-C, in words


def coloured() -> bool | None:
    """False where colours are disabled (https://no-color.org), None: on terminals only."""
    unwanted = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return False if unwanted else None


def error(text: str) -> None:
    """Print what went wrong, in red on a terminal."""
    say(click.style(f"error: {_plain(text)}", fg="red"), err=True, color=coloured())


def _plain(text: str) -> str:
    """Lines without control characters, which names from foreign files may contain."""
    return "\n".join(map(printable, text.split("\n")))


def say(text: str, err: bool = False, **how: Any) -> None:
    """Print. Raises OSError if standard output is a file on a full disk."""
    with _reaching(err):
        click.echo(text, err=err, **how)


@contextmanager
def _reaching(err: bool) -> Iterator[None]:
    """Context in which a closed pipe (`| head`) loses output, but no result. If standard error is
    full or its terminal has gone, messages are lost, too."""
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

    Results go to standard output; with --json only the JSON does. Errors and warnings always go to
    standard error.
    """

    as_json: bool = False
    quiet: bool = False
    verbose: bool = False

    def say(self, text: str) -> None:
        """Print a line of the result for people; with --json on standard error."""
        if not self.quiet:
            say(_plain(text), err=self.as_json)

    def note(self, text: str) -> None:
        """Print a remark on standard error."""
        if not self.quiet:
            say(_plain(text), err=True)

    def show(self, table: Any, beside_json: bool = False) -> None:
        """Print a table of the result for people; with --json only if ``beside_json``."""
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
        """Print the result as JSON if --json is given."""
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
        """Show the progress of ``what`` on standard error: a bar on a terminal, else a line for
        each of its ``stages`` and one every `BETWEEN_S`; nothing with --quiet."""
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
            """Time that also advances between two designs."""

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
    """Progress of the work ``what``: on a bar (`show_on`), or as lines that ``say`` prints."""

    def __init__(
        self, what: str, stages: Sequence[str] = (), say: Callable[[str], None] | None = None
    ):
        self._what, self._stages, self._say = what, stages, say
        self._bar: Any = None
        self._task: Any = None
        self._done, self._began = 0.0, time.monotonic()
        # numbers of designs: of the stage, of its pieces before the last one, of the last piece
        self._total = self._before = self._piece = 0
        self._of_stage = self._said = self._began

    def show_on(self, bar: Any) -> None:
        """Show progress on a rich bar from here on."""
        self._bar, self._task = bar, bar.add_task(self._what, total=None)

    def begin(self, stage: str) -> None:
        """Begin a stage, one of ``stages``, or the whole work if there are none."""
        if stage in self._stages:
            place = f"stage {self._stages.index(stage) + 1} of {len(self._stages)}"
            self._what = f"{place}, {stage}"
        if self._say and (stage or not self._stages):
            self._said = time.monotonic()
            self._say(f"{self._what} ...")
        self._reset()

    def at(self, done: int, total: int) -> None:
        """Show that ``done`` of ``total`` designs of the last piece are finished. 0, or another
        total, begins a further piece of the stage, which is added to those before."""
        if total != self._piece or not done:
            self._before, self._piece = self._total, total
            self._total += total
            if self._bar:
                self._bar.update(self._task, total=self._total)
        self._show(self._before + done, self._what)

    def within(self, done: int, total: int) -> None:
        """Show that ``done`` of the ``total`` loads of the next design are finished."""
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
            # refresh at once: the next design may be finished before the bar's next refresh
            self._bar.update(self._task, completed=done, description=words, refresh=True)
        elif self._say and now > self._said + BETWEEN_S:
            self._said = now
            count = f", {int(done)} of {self._total} done" if self._total else ""
            self._say(f"{words}{count}, {self.clock(now)}")

    def clock(self, now: float) -> str:
        """Total time elapsed and, if a design is finished, time left in this stage, in words."""
        elapsed = f"{clock(now - self._began)} elapsed"
        if not 0 < self._done < self._total:
            return elapsed
        left = (now - self._of_stage) * (self._total / self._done - 1)
        return f"{elapsed}, {clock(left)} left" + (" in this stage" if self._stages else "")


class _Loads(logging.Handler):
    """Shows the loads that the solver reports in its log: ``loads`` = (done, total) of a record."""

    def __init__(self, progress: Progress):
        super().__init__(logging.INFO)
        self.progress = progress

    def emit(self, record: logging.LogRecord) -> None:
        if loads := getattr(record, "loads", None):
            self.progress.within(*loads)
        else:  # between two loads
            self.progress.words(record.getMessage())
