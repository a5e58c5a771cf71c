"""Processes for designs or starts that are evaluated at the same time."""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache
from multiprocessing import get_context, parent_process


def process_pool(jobs: int) -> ProcessPoolExecutor:
    """``jobs`` worker processes, which end when the process that asked for them is killed."""
    return ProcessPoolExecutor(jobs, get_context("forkserver"), initializer=_end_with_parent)


@lru_cache(maxsize=1)
def kept_pool(jobs: int) -> ProcessPoolExecutor:
    """`process_pool` that is there for the next question, too: its workers have read the templates
    and built the mesh by then."""
    return process_pool(jobs)


def _end_with_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
