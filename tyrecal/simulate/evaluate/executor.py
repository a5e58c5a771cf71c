"""Where tasks are done: in this process, in worker processes, or by the workers of a scheduler."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from typing import Any, Protocol

from .failure import EvaluationFailed
from .pool import Pool, first_done, process_pool

Task = tuple[int, Any]  # its place among the tasks, and what its function is given


class Executor(Protocol):
    """One function, many tasks; both, and the answers, can be pickled."""

    def each(
        self, function: Callable[[Any], Any], tasks: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        """(place of a task, ``function`` of it or EvaluationFailed), as they finish.

        A task whose process died with it has crashed: EvaluationFailed. Raises what ``function``
        raises. Closed early, it ends what is under way where it can.
        """


class Here:
    """This process, one task after the other."""

    def each(
        self, function: Callable[[Any], Any], tasks: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        """As in `Executor`."""
        for place, task in enumerate(tasks):
            yield place, function(task)


class Processes:
    """``jobs`` processes of this machine. One that dies takes no other task with it."""

    def __init__(self, jobs: int):
        self.jobs = jobs

    def each(
        self, function: Callable[[Any], Any], tasks: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        """As in `Executor`."""
        waiting = list(enumerate(tasks))[::-1]
        while waiting:
            lost = yield from _until_one_dies(function, waiting, self.jobs)
            for suspect in lost:  # which of them killed its process? each again, alone
                if (yield from _until_one_dies(function, [suspect], 1)):
                    yield suspect[0], EvaluationFailed("crashed", "its process died, twice")


def _until_one_dies(
    function: Callable[[Any], Any], waiting: list[Task], jobs: int
) -> Generator[tuple[int, Any], None, list[Task]]:
    """Does tasks off the end of ``waiting``, yields answers; returns the tasks under way when a
    process died: its death ends them all."""
    under_way: dict[Future[Any], Task] = {}
    lost: list[Task] = []
    with _pool(jobs, lost) as pool:
        while under_way or (waiting and not lost):
            while waiting and not lost and len(under_way) < jobs:
                task = waiting.pop()
                try:
                    under_way[pool.submit(function, task[1])] = task
                except BrokenProcessPool:
                    lost.append(task)
            answers = []
            for future in first_done(under_way):
                task = under_way.pop(future)
                try:
                    answers.append((task[0], future.result()))
                except BrokenProcessPool:
                    lost.append(task)
            yield from answers
    return lost


_idle: dict[int, Pool] = {}  # by number of processes
_at_work: set[Pool] = set()
_of_parent: list[Pool] = []  # kept: collected, they would write to the parent's pipes


def _leave_to_parent() -> None:
    """A forked process neither uses nor ends the workers of its parent."""
    _of_parent.extend([*_at_work, *_idle.values()])
    _at_work.clear()
    _idle.clear()


if hasattr(os, "register_at_fork"):  # not on Windows
    os.register_at_fork(after_in_child=_leave_to_parent)


def end_workers() -> None:
    """End the processes of loops that were cut off: an error that is reported later holds such a
    loop, and with it its workers, until it is collected."""
    for pool in [*_at_work, *_idle.values()]:
        pool.end()
    _idle.clear()


@contextmanager
def _pool(jobs: int, lost: Sequence[Task]) -> Iterator[Pool]:
    """Worker processes, kept for the next tasks where all went well: by then they have read the
    templates and built the mesh. ``lost``: tasks whose process died.

    At Ctrl-C, or where nobody wants the rest, all are ended at once; a failed task's finish.
    """
    pool = _idle.pop(jobs, None) or process_pool(jobs)
    _at_work.add(pool)
    with ExitStack() as stack:
        stack.enter_context(pool)
        stack.callback(_at_work.discard, pool)
        try:
            yield pool
        except (KeyboardInterrupt, GeneratorExit):
            end_workers()
            raise
        if not lost:
            stack.pop_all()
            _at_work.discard(pool)
            _idle[jobs] = pool


@contextmanager
def executor(jobs: int = 1, scheduler: str = "") -> Iterator[Executor]:
    """``jobs`` at a time on this machine, or the workers of a Dask scheduler at that address.

    Raises SolverUnavailable where there is no such scheduler.
    """
    if scheduler:
        from .cluster import connected

        with connected(scheduler) as cluster:
            yield cluster
    else:
        yield Processes(jobs) if jobs > 1 else Here()


def in_order(answers: Iterable[tuple[int, Any]]) -> Iterator[Any]:
    """The answers in the order of their tasks."""
    early: dict[int, Any] = {}
    following = 0
    for place, answer in answers:
        early[place] = answer
        while following in early:
            yield early.pop(following)
            following += 1
