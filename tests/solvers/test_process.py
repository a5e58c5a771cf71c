"""External commands: time limits that end whole process groups, and honest failures."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest
from tyrecal_solvers.process import RunFailed, last_words, run_command


def test_exit_code_and_output(tmp_path: Path) -> None:
    code = run_command([sys.executable, "-c", "print('hello'); exit(7)"], tmp_path, 20, "log")
    assert code == 7
    assert last_words(tmp_path / "log") == "hello"
    assert last_words(tmp_path / "no such log") == ""


def test_a_hanging_command_is_ended_with_its_children(tmp_path: Path) -> None:
    child = "import time, os; open('child', 'w').write(str(os.getpid())); time.sleep(60)"
    parent = f"""import subprocess, sys, time
print('starting', flush=True)
subprocess.Popen([sys.executable, '-c', {child!r}])
time.sleep(60)"""
    start = time.monotonic()
    with pytest.raises(RunFailed, match=r"time limit of 2 s: starting") as failure:
        run_command([sys.executable, "-c", parent], tmp_path, 2, "log")
    assert failure.value.cause == "timed_out"
    assert time.monotonic() - start < 20
    pid = int((tmp_path / "child").read_text())
    for _ in range(100):
        if not _alive(pid):
            return
        time.sleep(0.1)
    raise AssertionError("the command's child outlived it")


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{pid}/stat")
    return not (state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z")


def test_a_command_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="cannot start 'no-such-solver'") as failure:
        run_command(["no-such-solver"], tmp_path, 1, "log")
    assert failure.value.cause == "crashed"
