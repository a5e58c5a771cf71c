"""Worker processes and executors: every task once, and no process outlives what was killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from multiprocessing import active_children
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tyrecal.simulate.evaluate import executor as executor_module
from tyrecal.simulate.evaluate.executor import Here, Processes, end_workers, executor, in_order
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.pool import Pool, _tell_to_end, process_pool

ROOT = Path(__file__).parents[2]


PARENT = """
import os, sys, time
from pathlib import Path
from tests.evaluate.test_pool import work
from tyrecal.simulate.evaluate.pool import process_pool

if __name__ == "__main__":
    with process_pool(1) as pool:
        pool.submit(work, sys.argv[1]).result()
"""


TOLD_TO_END = """
import os, signal
from tyrecal.simulate.evaluate.pool import _work

def task():
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    finally:
        print("cleared", flush=True)

try:
    _work(task)
finally:
    print("answered", flush=True)
"""


STOPPED = """
import os, random, signal, sys, threading
from tests.evaluate.test_pool import large
from tyrecal.simulate.evaluate.executor import Processes
from tyrecal.simulate.evaluate.pool import process_pool

if __name__ == "__main__":
    moment = random.Random(1)
    list(Processes(2).each(large, range(2)))
    for trial in range(20):
        try:
            stop = threading.Timer(0.2 * moment.random(), os.kill, (os.getpid(), signal.SIGINT))
            stop.start()
            if trial % 4:
                for answer in Processes(2).each(large, range(1000)):
                    pass
            else:
                with process_pool(2) as pool:
                    for answer in pool.map(large, range(1000)):
                        pass
        except KeyboardInterrupt:
            print("stopped", trial, flush=True)
        stop.join()
"""


SCRIPT = """
import tyrecal.__main__  # as the command does, which every worker imports anew
from tests.evaluate.test_pool import answers_term
from tyrecal.simulate.evaluate.pool import process_pool

if __name__ == "__main__":
    with process_pool(1) as pool:
        print([pool.submit(answers_term).result() for task in range(2)])
"""


def answers_term() -> bool:
    """Return whether this process would clear up before it ends."""
    return getattr(signal.getsignal(signal.SIGTERM), "__name__", "") == "_remember"


def work(place: str) -> None:
    """Say who is at work, and be long about it."""
    Path(place).write_text(str(os.getpid()))
    time.sleep(60)


def large(task: int) -> bytes:
    """More than a pipe holds, so that most of the time a worker is in the middle of its answer."""
    return bytes(5_000_000)


def test_an_orderly_end_waits_for_all_that_was_asked() -> None:
    with process_pool(2) as pool:
        later = [pool.submit(large, i) for i in range(3)]
        assert list(pool.map(abs, [-1, 2, -3])) == [1, 2, 3]
    assert all(len(task.result(0)) == 5_000_000 for task in later)
    with pytest.raises(RuntimeError, match="shutdown"):
        pool.submit(abs, 1)


def test_workers_that_are_told_to_end_have_so_long_all_together() -> None:
    """Workers that need longer are killed."""
    heard: list[tuple[str, Any]] = []

    class Deaf:
        pid = 1

        def terminate(self) -> None:
            heard.append(("terminate", None))

        def join(self, timeout: float) -> None:
            heard.append(("join", timeout))
            time.sleep(0.05)

        def kill(self) -> None:
            heard.append(("kill", None))

    ended = lambda **how: heard.append(("shutdown", how))
    workers = {i: Deaf() for i in range(2)}
    pool: Any = SimpleNamespace(_processes=workers, _result_queue=None, shutdown=ended)
    Pool.end(pool)
    names = ["terminate", "terminate", "join", "kill", "join", "kill", "shutdown"]
    assert [name for name, _ in heard] == names
    first, second = (left for name, left in heard if name == "join")
    assert 4.95 < first <= 5.0 and 0 < second <= first - 0.05
    assert heard[-1] == ("shutdown", {"cancel_futures": True})


def test_where_there_are_no_signals_a_worker_is_ended_with_what_it_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows' way, with a stand-in for its taskkill."""
    (tmp_path / "taskkill").write_text(f"#!/bin/sh\necho $* > {tmp_path}/asked\nexit 1\n")
    (tmp_path / "taskkill").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(sys, "platform", "win32")
    _tell_to_end(SimpleNamespace(pid=4711))  # type: ignore[arg-type]
    assert (tmp_path / "asked").read_text() == "/T /F /PID 4711\n"


def test_an_error_in_the_block_comes_out_and_what_had_not_begun_is_dropped() -> None:
    with pytest.raises(ZeroDivisionError), process_pool(1) as pool:
        later = [pool.submit(large, i) for i in range(50)]
        1 / 0  # noqa: B018
    assert all(task.done() for task in later) and any(task.cancelled() for task in later)


@pytest.mark.slow
def test_stopped_in_the_middle_of_large_answers_it_ends(tmp_path: Path) -> None:
    (tmp_path / "stopped.py").write_text(STOPPED)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, tmp_path / "stopped.py"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("stopped") == 20 and not done.stderr


def test_a_busy_worker_ends_with_its_parent(tmp_path: Path) -> None:
    (tmp_path / "parent.py").write_text(PARENT)
    pid_file = tmp_path / "pid"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen([sys.executable, tmp_path / "parent.py", pid_file], env=environment)
    while not (pid_file.exists() and pid_file.read_text()) and parent.poll() is None:
        time.sleep(0.02)
    parent.kill()
    parent.wait()
    for _ in range(100):
        status = Path(f"/proc/{pid_file.read_text()}/stat")
        if not status.exists() or status.read_text().rpartition(")")[2].split()[0] == "Z":
            return
        time.sleep(0.1)
    raise AssertionError("the worker outlived its parent")


def test_workers_of_the_command_answer_when_they_are_told_to_end(tmp_path: Path) -> None:
    (tmp_path / "script.py").write_text(SCRIPT)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, tmp_path / "script.py"], env=environment, capture_output=True, text=True
    )
    assert (done.stdout, done.stderr) == ("[True, True]\n", "")


@pytest.mark.parametrize("kind", [KeyboardInterrupt, GeneratorExit])
def test_an_interruption_ends_the_workers(
    monkeypatch: pytest.MonkeyPatch, kind: type[BaseException]
) -> None:
    """The interruption comes in the block, or while its end is waited for."""
    ended: list[str] = []
    monkeypatch.setattr(Pool, "end", lambda self: ended.append("now"))
    with pytest.raises(kind), Pool(1):
        raise kind
    assert ended == ["now"]

    def interrupted(self: Pool, **given: Any) -> None:
        assert given == {"cancel_futures": False}
        raise KeyboardInterrupt

    monkeypatch.setattr(Pool, "shutdown", interrupted)
    with pytest.raises(KeyboardInterrupt), Pool(1):
        pass
    assert ended == ["now", "now"]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends processes without a signal")
def test_a_worker_that_is_told_to_end_finishes_its_task_and_ends() -> None:
    """The task may clear what it had begun; no answer follows."""
    done = subprocess.run(
        [sys.executable, "-c", TOLD_TO_END], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (128 + signal.SIGTERM, "cleared\n"), done.stderr


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
    assert not executor_module._at_work


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
    with closing(Processes(2).each(do_task, [str(place), 1])) as answers:
        assert next(answers)[0] == 1
        while not place.exists():
            time.sleep(0.01)
        began = time.monotonic()
    assert time.monotonic() - began < 30
    assert not active_children()


def do_task(task: str | int) -> None:
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
