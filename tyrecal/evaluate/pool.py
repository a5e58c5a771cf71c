"""Processes for designs or starts that are evaluated at the same time."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import forkserver, get_context, parent_process
from typing import Any

from ..interrupt import ctrl_c_put_off

WARM = "tyrecal.evaluate.warm"
PATIENCE_S = 5.0  # for a process that was told to end


class Pool(ProcessPoolExecutor):
    """Worker processes that are not waited for after Ctrl-C: what they had not finished is lost."""

    def submit(self, *task: Any, **named: Any) -> Future[Any]:
        """As in the standard library; no worker is left half started, and so unknown, by Ctrl-C."""
        with ctrl_c_put_off():
            return super().submit(*task, **named)

    def map(  # type: ignore[override]
        self, function: Callable[..., Any], *tasks: Iterable[Any]
    ) -> Iterator[Any]:
        """As in the standard library, but that, cut off, it cancels nothing: `end` and the end of
        the block do, and a future that was cancelled before stops the thread that ends the pool."""
        futures = [self.submit(function, *task) for task in zip(*tasks, strict=False)]
        return (futures.pop(0).result() for _ in range(len(futures)))

    def end(self) -> None:
        """End the workers now, whatever they do; a second Ctrl-C has to wait until they have."""
        with ctrl_c_put_off():
            workers = list((self._processes or {}).values())
            answers: Any = self._result_queue
            for worker in workers:
                worker.terminate()
            for worker in workers:
                worker.join(PATIENCE_S)
                worker.kill()
            # One may have died in the middle of an answer. The thread that reads it is waited for
            # here and when Python ends, and sees its end only when nobody can write the rest.
            if answers is not None:
                answers._writer.close()
            self.shutdown(cancel_futures=True)

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        if kind is not None and issubclass(kind, KeyboardInterrupt | GeneratorExit):
            self.end()
            return
        try:
            self.shutdown(cancel_futures=kind is not None)
        except KeyboardInterrupt:
            self.end()
            raise


def warm_up() -> None:
    """Start the process that workers are forked from, if there is none; waits for nothing.

    It imports what they need while its parent does the same for itself, so that a worker begins
    at once: two seconds of a core less for two of them.
    """
    get_context("forkserver").set_forkserver_preload([WARM])
    # it inherits the mask: Ctrl-C is its parent's to answer, from its first moment on
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def process_pool(jobs: int) -> Pool:
    """``jobs`` worker processes, which end when the process that asked for them is killed."""
    with ctrl_c_put_off():  # half made, it would leave semaphores behind
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
