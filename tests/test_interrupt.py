"""Ctrl-C at the worst moments: what it meets neither tears, nor loses it, nor calls it else."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import click
import pytest

from tyrecal.interrupt import (
    defer_interrupts,
    pending_interrupt,
    raise_interrupt,
    remember_interrupts,
)
from tyrecal.simulate.evaluate import folders
from tyrecal.simulate.evaluate.pool import first_done, process_pool

from .cli.test_conventions import CASE, COARSE, run


@pytest.fixture(autouse=True)
def answered_by_python() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def then_ctrl_c(function: Any) -> Any:
    """The function, and Ctrl-C just before it returns, each time."""

    def interrupted(*arguments: Any, **named: Any) -> Any:
        answer = function(*arguments, **named)
        signal.raise_signal(signal.SIGINT)
        return answer

    return interrupted


def test_put_off_it_counts_when_the_block_is_done() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), defer_interrupts():
        with defer_interrupts():
            signal.raise_signal(signal.SIGINT)
        done.append("all")
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_folder_is_removed_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "run" / "files").mkdir(parents=True)
    with monkeypatch.context() as patch:
        patch.setattr(os, "close", then_ctrl_c(os.close))
        with pytest.raises(KeyboardInterrupt):
            folders.drop(tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_pool_is_made_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    known, forgotten = [], []
    with monkeypatch.context() as patch:
        patch.setattr(
            "multiprocessing.synchronize.SemLock._cleanup",
            lambda name: forgotten.append(name) or resource_tracker.unregister(name, "semaphore"),
        )
        register = resource_tracker.register
        patch.setattr(
            resource_tracker,
            "register",
            then_ctrl_c(lambda name, kind: known.append(name) or register(name, kind)),
        )
        with pytest.raises(KeyboardInterrupt):
            process_pool(1)
        gc.collect()
    assert known and sorted(known) == sorted(forgotten)


def test_locks_that_a_thread_shares_are_not_torn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Met between giving a lock back and taking it again, it would give it back twice."""
    plain = threading.Condition._release_save

    def release(lock: threading.Condition) -> Any:
        state = plain(lock)
        signal.raise_signal(signal.SIGINT)
        return state

    monkeypatch.setattr(threading.Condition, "_release_save", release)
    with pytest.raises(KeyboardInterrupt):
        first_done([Future()])


def test_one_that_was_swallowed_is_raised_again() -> None:
    with remember_interrupts():
        raise_interrupt()
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert pending_interrupt()
        with pytest.raises(KeyboardInterrupt):
            raise_interrupt()
    assert not pending_interrupt()


def test_where_it_is_ignored_it_stays_so() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with remember_interrupts():
        signal.raise_signal(signal.SIGINT)
        raise_interrupt()


@pytest.mark.parametrize("met", ["swallowed", "another error"])
def test_the_command_ends_as_interrupted(
    met: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from tyrecal.simulate.evaluate.store import Store

    def read(store: Store, key: str) -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            if met == "another error":
                raise OSError(9, "Bad file descriptor") from None

    monkeypatch.setattr(Store, "read", read)
    command = ["sweep-pressure", CASE, *COARSE, "--steps", "3", "--output", str(tmp_path)]
    assert run(*command) == 130
    message = capsys.readouterr().err
    assert (
        "interrupted: " in message
        and "same command again to resume" in message
        and "error" not in message
    )
    assert len(list(tmp_path.glob("record/*/*.record"))) == (met == "swallowed")


def test_what_was_under_way_has_ended_by_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C that met the caller of a generator, between two of its answers."""
    ended = []

    def answers() -> Iterator[int]:
        try:
            yield from range(10)
        finally:
            ended.append(len(capsys.readouterr().err))

    def command() -> None:
        under_way = answers()
        next(under_way)
        raise KeyboardInterrupt

    monkeypatch.setattr("tyrecal.cli.solvers.command", click.Command("solvers", callback=command))
    assert run("solvers") == 130
    assert ended == [0]  # nothing had been said
    assert "interrupted" in capsys.readouterr().err
