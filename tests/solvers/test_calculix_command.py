"""The command that runs CalculiX: several decks at a time, its end, its log and its version."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from tyrecal_solvers.calculix import adapter
from tyrecal_solvers.calculix.adapter import CalculiX
from tyrecal_solvers.calculix.runner import _is_safe, _said
from tyrecal_solvers.errors import RunFailed

from .standin_calculix import evaluate, folder_for, with_two_diameters


def test_decks_run_at_the_same_time_and_tell_the_same(tmp_path: Path) -> None:
    """The two decks wait for each other to begin; with one at a time neither would end."""
    together = evaluate(with_two_diameters(tmp_path / "two", "together", 2))
    alone = evaluate(with_two_diameters(tmp_path / "one", "none", 1))
    assert [mode["n"] for mode in together["modes"]] == [1, 2]
    for mode, other in zip(together["modes"], alone["modes"], strict=True):
        assert mode["frequency_Hz"] == other["frequency_Hz"]
        np.testing.assert_array_equal(mode["amplitude"], other["amplitude"])
    assert not list(tmp_path.glob("*/run/*.rin")) and not list(tmp_path.glob("*/run/*.rout"))


@pytest.mark.parametrize("parallel", [1, 2])
def test_one_deck_of_several_that_fails_fails_all(tmp_path: Path, parallel: int) -> None:
    with pytest.raises(RunFailed, match="a is wrong"):
        evaluate(with_two_diameters(tmp_path, "error", parallel))


@pytest.mark.parametrize(("parallel", "ended"), [(1, 0), (2, 1)])
def test_an_interruption_ends_the_decks_at_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parallel: int, ended: int
) -> None:
    """The interruption reaches decks in this thread by itself."""
    folder, calls = with_two_diameters(tmp_path, "none", parallel), []

    def run_job(place: Path, job: str, *given: object) -> None:
        if job != "inflate":
            raise KeyboardInterrupt
        (place / f"{job}.rout").write_text("a state")

    monkeypatch.setattr(adapter, "run_job", run_job)
    monkeypatch.setattr(adapter, "end_commands", lambda: calls.append(1))
    with pytest.raises(KeyboardInterrupt):
        evaluate(folder)
    assert len(calls) == ended


def test_after_a_failure_nothing_runs_on(tmp_path: Path) -> None:
    """The folder may go: a deck that had begun has ended."""
    with pytest.raises(RunFailed, match="code 139"):
        evaluate(with_two_diameters(tmp_path, "one of two", 2))
    assert (tmp_path / "tools" / "ended").exists()


@pytest.mark.slow
def test_a_run_that_hangs_is_ended(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match=r"time limit.*Newton goes on") as failure:
        evaluate(folder_for(tmp_path, "hang"), 4.0)
    assert failure.value.cause == "timed_out"


def test_a_command_that_is_not_there(tmp_path: Path) -> None:
    solver = CalculiX()
    solver.command = ["no-such-ccx"]
    with pytest.raises(RunFailed, match="cannot start 'no-such-ccx'"):
        solver.run(folder_for(tmp_path, "none"), 30.0)


def test_of_an_error_three_lines_are_told(tmp_path: Path) -> None:
    log = tmp_path / "a.log"
    log.write_text("first\n *ERROR in e_c3d:\n\n one\n two\n three\n *ERROR again\nJob finished\n")
    assert _said(log) == ("*ERROR in e_c3d: one two", False, True)
    log.write_text("*WARNING reading *STEP.\n*WARNING in x: Card image:\nToo many cutbacks\n")
    assert _said(log) == ("", True, False)


def test_paths_that_ccx_copes_with() -> None:
    """Safe paths have 100 characters at most, no blank, and only ASCII."""
    assert _is_safe(Path("/" + 99 * "x")) and not _is_safe(Path("/" + 100 * "x"))
    assert not _is_safe(Path("/a b")) and not _is_safe(Path("/\u00fc"))


def test_a_program_has_twenty_seconds_to_say_its_version(monkeypatch: pytest.MonkeyPatch) -> None:
    def silent(command: list[str], timeout: float, **given: object) -> None:
        assert command == ["mute", "-v"] and timeout == 20
        raise subprocess.TimeoutExpired(command, timeout)

    monkeypatch.setattr(subprocess, "run", silent)
    assert adapter._version(("mute",)) == "unknown"
