"""Processes for designs or starts that are evaluated at the same time."""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import active_children, forkserver, get_context, parent_process

WARM = "tyrecal.evaluate.warm"


class Pool(ProcessPoolExecutor):
    """Worker processes that are not waited for after Ctrl-C: what they had not finished is lost."""

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        if kind is not None and issubclass(kind, KeyboardInterrupt):
            self.shutdown(wait=False, cancel_futures=True)
            for process in active_children():
                process.terminate()
        self.shutdown(cancel_futures=kind is not None)


def warm_up() -> None:
    """Start the process that workers are forked from, if there is none; waits for nothing.

    It imports what they need while its parent does the same for itself, so that a worker begins
    at once: two seconds of a core less for two of them.
    """
    get_context("forkserver").set_forkserver_preload([WARM])
    forkserver.ensure_running()


def process_pool(jobs: int) -> Pool:
    """``jobs`` worker processes, which end when the process that asked for them is killed."""
    warm_up()
    return Pool(jobs, get_context("forkserver"), initializer=_end_with_parent)


def _end_with_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
