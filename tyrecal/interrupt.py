"""Ctrl-C, which Python raises wherever it stands: remembered, and put off where it would tear."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

_heard = False


@contextmanager
def ctrl_c_remembered() -> Iterator[None]:
    """Within the block Ctrl-C is remembered as well as raised.

    What it met may turn it into another error (a file that it had just closed is closed again) or
    swallow it (a callback of the garbage collector): `ctrl_c_heard` knows, and `raise_ctrl_c`
    raises it again. Where somebody else answers Ctrl-C, or it is ignored, nothing changes.
    """
    global _heard
    if not _ours() or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _remember)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        _heard = False


def ctrl_c_heard() -> bool:
    """Whether Ctrl-C was pressed since the block of `ctrl_c_remembered` began."""
    return _heard


def raise_ctrl_c() -> None:
    """Raises KeyboardInterrupt where Ctrl-C was pressed and we are still at work."""
    if _heard:
        raise KeyboardInterrupt


@contextmanager
def ctrl_c_put_off() -> Iterator[None]:
    """Ctrl-C counts when the block, a short one, is done."""
    if not _ours():
        yield
        return
    numbers: list[int] = []
    answer = signal.signal(signal.SIGINT, lambda number, frame: numbers.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, answer)
        if numbers:
            signal.raise_signal(signal.SIGINT)


def _remember(number: int, frame: Any) -> None:
    global _heard
    _heard = True
    raise KeyboardInterrupt


def _ours() -> bool:
    """Python's main thread alone hears of signals."""
    return threading.current_thread() is threading.main_thread()
