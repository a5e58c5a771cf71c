"""Processes for designs or starts that are evaluated at the same time.

On Linux they are forked from one that has imported what they need; elsewhere each is started anew
and imports it: macOS's own libraries do not survive a fork, Windows has none.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_all_start_methods, get_context, parent_process, resource_tracker
from multiprocessing.process import BaseProcess
from typing import Any

from ...interrupt import defer_interrupts, exit_code, pending_interrupt, remember_interrupts

WARM = "tyrecal.batch.warm"  # imported by the server that forks the processes, once
ANSWERED_S = 0.1  # the longest delay of an interruption while `first_done` waits
PATIENCE_S = 5.0  # for processes that were told to end
# signals that a terminal sends to all processes, and only the parent answers
PARENTS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name))


class Pool(ProcessPoolExecutor):
    """Worker processes that are not waited for after an interruption: what they had not finished
    is lost."""

    def submit(  # type: ignore[override]
        self, function: Callable[..., Any], *task: Any
    ) -> Future[Any]:
        """As in the standard library; no worker is left half started, and so unknown, by an
        interruption."""
        with defer_interrupts(), _deaf_children():
            return super().submit(_work, function, *task)

    def map(  # type: ignore[override]
        self, function: Callable[..., Any], *tasks: Iterable[Any]
    ) -> Iterator[Any]:
        """As in the standard library, but that, cut off, it cancels nothing: `end` and the end of
        the block do, and a future that was cancelled before stops the thread that ends the pool."""
        futures = [self.submit(function, *task) for task in zip(*tasks, strict=False)]
        return (_answer(futures.pop(0)) for _ in range(len(futures)))

    def end(self) -> None:
        """End the workers now, whatever they do; a second Ctrl-C has to wait until they have."""
        with defer_interrupts():
            workers = list((self._processes or {}).values())
            answers: Any = self._result_queue
            for worker in workers:
                _tell_to_end(worker)
            until = time.monotonic() + PATIENCE_S
            for worker in workers:
                worker.join(max(0.0, until - time.monotonic()))
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


def first_done(futures: Collection[Future[Any]]) -> set[Future[Any]]:
    """Futures that are done, once one is. An interruption does not meet the locks that are shared
    with the thread that reads the answers: torn there, it would end that thread."""
    while True:
        with defer_interrupts():
            done = wait(futures, ANSWERED_S, FIRST_COMPLETED).done
        if done:
            return done


def _answer(future: Future[Any]) -> Any:
    """The result of a future, once it is done. Raises what the task raised."""
    first_done([future])
    return future.result()


def warm_up() -> None:
    """Start the process that workers are forked from, if there is none; waits for nothing.

    It imports what they need while its parent does the same for itself, so that a worker begins
    at once. Two workers then use two seconds of processor time less in all.
    """
    if _method() != "forkserver":
        return
    from multiprocessing import forkserver

    get_context("forkserver").set_forkserver_preload([WARM])
    with _deaf_children():  # apart, since it unblocks what it finds blocked
        resource_tracker.ensure_running()
    with _deaf_children():
        forkserver.ensure_running()


def process_pool(jobs: int) -> Pool:
    """``jobs`` worker processes, which end when their parent process is killed."""
    with defer_interrupts():  # half made, it would leave semaphores behind
        warm_up()
        with _deaf_children():
            return Pool(jobs, get_context(_method()), initializer=_begin)


def leave_interrupts_to_parent() -> None:
    """This process does not answer what a terminal sends to all of its processes."""
    for number in PARENTS:
        signal.signal(number, signal.SIG_IGN)


def _method() -> str:
    """How workers are started here."""
    forked = sys.platform == "linux" and "forkserver" in get_all_start_methods()
    return "forkserver" if forked else "spawn"


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes started within are deaf to what a terminal sends to all, from their first moment:
    they inherit the mask. Windows has none."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, PARENTS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _tell_to_end(worker: BaseProcess) -> None:
    """End a worker with what it has started: `_work` sees to that where there are signals."""
    if sys.platform == "win32":
        command = ["taskkill", "/T", "/F", "/PID", str(worker.pid)]
        subprocess.run(command, capture_output=True, check=False)
    else:
        worker.terminate()


def _work(function: Callable[..., Any], *task: Any) -> Any:
    """A task in a worker. SIGTERM raises KeyboardInterrupt in the task, which clears up what it
    had begun; then the worker ends, even if the task turned it into another error."""
    with remember_interrupts():
        try:
            return function(*task)
        finally:
            if pending_interrupt():
                os._exit(exit_code(pending_interrupt()))


def _begin() -> None:
    """Start of a worker: it ignores interrupts, and ends if its parent ends."""
    leave_interrupts_to_parent()
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
