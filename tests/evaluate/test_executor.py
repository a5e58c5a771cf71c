"""Executors: every task once, in whatever order; a process that dies takes no other task along."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from contextlib import closing
from multiprocessing import active_children
from pathlib import Path

import pytest

from tyrecal.simulate.evaluate import executor as executor_module
from tyrecal.simulate.evaluate.executor import Here, Processes, end_workers, executor, in_order
from tyrecal.simulate.evaluate.failure import EvaluationFailed


def square(task: float) -> float:
    """Slower for small tasks; dies with 3, raises with -1."""
    if task == 3:
        os._exit(9)
    if task < 0:
        raise ValueError("negative")
    time.sleep(0.02 / (1 + task))
    return task**2


def mark(place: str) -> None:
    """Say that work began, and be long about it."""
    Path(place).write_text("began")
    time.sleep(60)


@pytest.mark.parametrize("jobs", [1, 3])
def test_all_tasks_in_order(jobs: int) -> None:
    tasks = [5.0, 0.0, 7.0, 1.0]
    with executor(jobs) as workers:
        assert isinstance(workers, Here if jobs == 1 else Processes)
        assert list(in_order(workers.each(square, tasks))) == [t**2 for t in tasks]
        assert list(workers.each(square, [])) == []


def knows(module: str) -> bool:
    """Return whether this process had imported the module before it was needed here."""
    return module in sys.modules


def test_workers_begin_with_what_they_need() -> None:
    names = ["tyrecal.batch.case", "tyrecal_solvers.bundled.adapter", "tyrecal.nothing"]
    assert list(in_order(Processes(2).each(knows, names))) == [True, True, False]


def test_in_order_of_anything() -> None:
    assert list(in_order([(2, "c"), (0, "a"), (1, "b")])) == ["a", "b", "c"]


def test_a_task_that_kills_its_process_is_found_and_the_others_are_done() -> None:
    tasks = [5.0, 3.0, 7.0, 1.0, 3.0, 2.0]
    answers = dict(Processes(2).each(square, tasks))
    assert set(answers) == set(range(6))
    assert {i for i, a in answers.items() if isinstance(a, EvaluationFailed)} == {1, 4}
    assert [answers[i] for i in (0, 2, 3, 5)] == [25, 49, 1, 4]


@pytest.mark.parametrize("make", [Here, lambda: Processes(2)])
def test_what_a_task_raises_is_raised(make: Callable[[], Processes]) -> None:
    with pytest.raises(ValueError, match="negative"):
        list(make().each(square, [1.0, -1.0]))


def test_a_loop_that_somebody_still_holds_can_be_ended() -> None:
    answers = Processes(2).each(time.sleep, [0, 300, 300])
    next(answers)
    assert active_children()
    end_workers()
    assert not active_children()
    answers.close()


def test_closed_early_it_ends_what_is_under_way(tmp_path: Path) -> None:
    place = tmp_path / "began"
    with closing(Processes(2).each(work, [str(place), 1])) as answers:
        assert next(answers)[0] == 1
        while not place.exists():
            time.sleep(0.01)
        began = time.monotonic()
    assert time.monotonic() - began < 30
    assert not active_children()


def work(task: str | int) -> None:
    """The long task, or a short one."""
    if isinstance(task, str):
        mark(task)


def test_workers_that_were_ended_are_not_ended_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers are at work, or wait for the next tasks."""
    ended: list[str] = []

    class Workers:
        def __init__(self, name: str):
            self.name = name

        def end(self) -> None:
            ended.append(self.name)

    monkeypatch.setattr(executor_module, "_idle", {2: Workers("idle")})
    monkeypatch.setattr(executor_module, "_at_work", {Workers("at work")})
    end_workers()
    assert sorted(ended) == ["at work", "idle"]
    end_workers()
    assert sorted(ended) == ["at work", "at work", "idle"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no processes are forked here")
def test_a_forked_process_leaves_its_parents_workers_alone() -> None:
    tasks = [5.0, 7.0, 1.0]
    list(Processes(2).each(square, tasks))
    workers = {process.pid for process in active_children()}
    child = os.fork()
    if not child:
        try:
            end_workers()
            os._exit(0)
        finally:
            os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert workers and {process.pid for process in active_children()} == workers
    assert list(in_order(Processes(2).each(square, tasks))) == [t**2 for t in tasks]
