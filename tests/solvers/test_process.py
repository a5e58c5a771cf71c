"""External commands: time limits that end whole process groups, and honest failures."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tyrecal_solvers.errors import RunFailed
from tyrecal_solvers.process import last_words, run_command


def test_exit_code_and_output(tmp_path: Path) -> None:
    code = run_command([sys.executable, "-c", "print('hello'); exit(7)"], tmp_path, 20, "log")
    assert code == 7
    assert last_words(tmp_path / "log") == "hello"
    assert last_words(tmp_path / "no such log") == ""


@pytest.mark.slow
def test_a_hanging_command_is_ended_with_its_children(tmp_path: Path) -> None:
    """The child is a fork, so that a busy machine has it at once."""
    parent = """import os, time
pid = os.fork()
if pid:
    open('child', 'w').write(str(pid))
    print('starting', flush=True)
time.sleep(60)"""
    start = time.monotonic()
    with pytest.raises(RunFailed, match=r"time limit of 5 s: starting") as failure:
        run_command([sys.executable, "-c", parent], tmp_path, 5, "log")
    assert failure.value.cause == "timed_out"
    assert time.monotonic() - start < 20
    assert _ends(int((tmp_path / "child").read_text()))


@pytest.mark.slow
def test_children_that_ignore_the_end_are_killed(tmp_path: Path) -> None:
    """Their parent does as it is told, and is not there any more to ask."""
    parent = """import signal, subprocess, time
deaf = 'trap "" TERM; echo $$ > child; sleep 60; true'
subprocess.Popen(['sh', '-c', deaf])
time.sleep(60)"""
    with pytest.raises(RunFailed):
        run_command([sys.executable, "-c", parent], tmp_path, 3, "log")
    assert _ends(int((tmp_path / "child").read_text()))


def test_without_process_groups_the_tree_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Windows' way, with a stand-in for its taskkill."""
    taskkill = tmp_path / "taskkill"
    taskkill.write_text(f"#!/bin/sh\necho $* > {tmp_path}/asked\n")
    taskkill.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.delattr(os, "killpg")
    command = [
        sys.executable,
        "-c",
        "import os, time; print(os.getpid(), flush=True); time.sleep(60)",
    ]
    with pytest.raises(RunFailed, match="time limit") as failure:
        run_command(command, tmp_path, 2, "log")
    pid = (tmp_path / "log").read_text().strip()
    assert (tmp_path / "asked").read_text() == f"/T /F /PID {pid}\n" and pid in str(failure.value)
    assert _ends(int(pid))


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
    pid_file = tmp_path / "pid"
    while not (pid_file.exists() and pid_file.read_text().endswith(".")):
        assert process.poll() is None
        time.sleep(0.05)
    pid = int(pid_file.read_text()[:-1])
    assert _alive(pid)
    process.kill()
    process.wait()
    assert _ends(pid)


def _ends(pid: int) -> bool:
    """Return whether a process ends within ten seconds."""
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
