"""Interruptions: Ctrl-C, SIGTERM (a queueing system ends its job), SIGHUP (the terminal is gone).

All are one thing: KeyboardInterrupt, raised wherever Python stands, remembered, and put off where
it would tear. A signal that is ignored (`nohup`), or that somebody else answers, stays so.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

WORDS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "hung up"}
SIGNALS = {
    getattr(signal, name): words for name, words in WORDS.items() if hasattr(signal, name)
}  # number: what it does to a command
ONCE_S = 1.0  # one that follows within this time is the same: a closing terminal hangs up twice

_heard, _at, _late, _depth = 0, 0.0, 0, 0


def exit_code(number: int) -> int:
    """Exit code of a command that signal ``number`` ended, as a shell has it."""
    return 128 + number


def leave_when_interrupted() -> None:
    """From here to `remember_interrupts` an interruption ends the process with one sentence.

    For the first moments of a command, while Python imports it: KeyboardInterrupt would meet the
    importing machinery, and nothing was changed yet. Afterwards, when the command is done, it
    counts no more. A worker process imports what its parent did, and is not meant.
    """
    workers = sys.modules.get("multiprocessing")
    if workers and workers.current_process().name != "MainProcess":
        return
    for number in SIGNALS:
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, _leave)


@contextmanager
def remember_interrupts() -> Iterator[None]:
    """Within the block an interruption is remembered as well as raised.

    What it met may turn it into another error (a file that it had just closed is closed again) or
    swallow it (a callback of the garbage collector): `pending_interrupt` knows, and
    `raise_interrupt` raises it again.
    """
    global _heard, _late, _depth
    answers = {number: signal.getsignal(number) for number in SIGNALS} if _ours() else {}
    free = (signal.SIG_DFL, signal.default_int_handler, _leave)
    answers = {number: answer for number, answer in answers.items() if answer in free}
    if not answers:
        yield
        return
    hook = sys.unraisablehook
    try:
        sys.unraisablehook = _say_unless_interrupt
        for number in answers:
            signal.signal(number, _remember)
        yield
    finally:
        _depth += 1  # no more of it while handlers change
        for number, answer in answers.items():
            signal.signal(number, signal.SIG_IGN if answer is _leave else answer)
        sys.unraisablehook = hook
        _depth -= 1
        number, _heard, _late = _late, 0, 0
        if number:
            signal.raise_signal(number)


def pending_interrupt() -> int:
    """Number of the signal that came since the block of `remember_interrupts` began; 0: none."""
    return _heard


def raise_interrupt() -> None:
    """Raises KeyboardInterrupt where an interruption came and we are still at work."""
    if _heard:
        raise KeyboardInterrupt


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """An interruption counts when the block, a short one, is done."""
    global _depth, _late
    if not _ours():
        yield
        return
    answer: Any = signal.getsignal(signal.SIGINT)
    others = callable(answer) and answer not in (_remember, _leave)  # as in a notebook
    numbers: list[int] = []
    _depth += 1
    try:
        if others:
            signal.signal(signal.SIGINT, lambda number, frame: numbers.append(number))
        yield
    finally:
        _depth -= 1
        if others:
            signal.signal(signal.SIGINT, answer)
        if _late and not _depth:
            numbers, _late = [_late], 0
        if numbers:
            signal.raise_signal(numbers[0])


def _leave(number: int, frame: Any) -> None:
    try:
        os.write(2, f"\n{SIGNALS[number]}: nothing was changed\n".encode())
    finally:
        os._exit(exit_code(number))


def _remember(number: int, frame: Any) -> None:
    global _heard, _at, _late
    if _depth:
        _late = _late or number
        return
    now, _late = time.monotonic(), 0
    if _heard and now - _at < ONCE_S:
        return
    _heard, _at = _heard or number, now
    raise KeyboardInterrupt


def _say_unless_interrupt(unraisable: Any) -> None:
    """For ``sys.unraisablehook``: an interruption that met a callback is remembered, not
    printed."""
    if unraisable.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(unraisable)


def _ours() -> bool:
    """Python's main thread alone hears of signals."""
    return threading.current_thread() is threading.main_thread()
