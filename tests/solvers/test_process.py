"""External commands: time limits that end whole process groups, and honest failures."""

from __future__ import annotations

import os
import shutil
import subprocess
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
    with pytest.raises(RunFailed, match=r"time limit of 5 s: starting") as failure:
        run_command([sys.executable, "-c", parent], tmp_path, 5, "log")
    assert failure.value.cause == "timed_out"
    assert time.monotonic() - start < 20
    assert _ends(int((tmp_path / "child").read_text()))


@pytest.mark.skipif(shutil.which("setpriv") is None, reason="needs Linux with util-linux")
@pytest.mark.parametrize("parallel", [False, True])
def test_a_command_ends_with_a_killed_process(tmp_path: Path, parallel: bool) -> None:
    """Started from the main thread, or as the CalculiX runner does where it runs several."""
    solver = "import os, time; open('pid', 'w').write(f'{os.getpid()}.'); time.sleep(60)"
    call = f"run_command([sys.executable, '-c', {solver!r}], Path('.'), 60, 'log')"
    if parallel:
        call = f"list(ThreadPoolExecutor(2).map(lambda _: {call}, [0]))"
    tool = f"""import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tyrecal_solvers.process import run_command
{call}"""
    process = subprocess.Popen([sys.executable, "-c", tool], cwd=tmp_path)
    said = tmp_path / "pid"
    while not (said.exists() and said.read_text().endswith(".")):
        assert process.poll() is None
        time.sleep(0.05)
    pid = int(said.read_text()[:-1])
    assert _alive(pid)
    process.kill()
    process.wait()
    assert _ends(pid)


def _ends(pid: int) -> bool:
    """Whether a process is gone within ten seconds."""
    for _ in range(100):
        if not _alive(pid):
            return True
        time.sleep(0.1)
    return False


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
