"""Studies where there is no fcntl, no fork, no process group and no signal mask.

Windows and macOS were not at hand: what they lack is taken away here, from the processes that a
command starts too. What they have instead (other locks, other ways to end processes) is not tried.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import CASES

BLOCKED = """
import multiprocessing.reduction, os, signal, sys
for name in ("fcntl", "grp", "pwd", "resource", "termios", "multiprocessing.forkserver"):
    sys.modules[name] = None
multiprocessing.reduction.HAVE_SEND_HANDLE = False  # what a fork server needs
for name in ("fork", "forkpty", "getpgid", "getuid", "killpg", "mkfifo", "sched_getaffinity",
             "setpgid", "setsid", "sysconf"):
    delattr(os, name)
for name in ("SIGHUP", "pthread_kill", "pthread_sigmask", "sigwait"):
    delattr(signal, name)
with open(os.environ["BLOCKED"], "a") as file:
    print(os.getpid(), file=file)
"""
CASE = str(CASES / "p235_75r17.yaml")
OTHER = str(CASES / "205_60r15.yaml")
COARSE = ["--mesh", "coarse"]
TWO = ["--jobs", "2"]
VOLATILE = {"run.json", ".lock", ".lock.json"}
slow = pytest.mark.slow


def results(folder: Path) -> dict[str, bytes]:
    """Result files by their path in ``folder``, records and pages without their dates."""
    times = rb"\d{4}-\d\d-\d\d( |%20)\d\d:\d\d( |%20)UTC"
    return {
        path.relative_to(folder).as_posix(): re.sub(times, b"", path.read_bytes())
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in VOLATILE and path.suffix != ".record"
    }


@pytest.mark.parametrize(
    ("command", "processes"),
    [
        (["modes", CASE, *COARSE, "--no-pictures"], 1),
        pytest.param(["batch", CASE, OTHER, "--studies", "modes", *COARSE, *TWO], 3, marks=slow),
        pytest.param(
            ["fit", CASE, *COARSE, *TWO, "--starts", "2", "--method", "gauss-newton", "--report"],
            3,
            marks=slow,
        ),
        pytest.param(
            ["sweep-pressure", CASE, *COARSE, *TWO, "--steps", "2", "--no-pictures"], 3, marks=slow
        ),
        pytest.param(["footprint", CASE, *COARSE, "--loads-N", "300"], 1, marks=slow),
        pytest.param(["effects", "bead_filler", "--case", CASE, *COARSE, *TWO], 3, marks=slow),
    ],
    ids=lambda each: each[0] if isinstance(each, list) else "",
)
def test_studies_with_what_windows_has(command: list[str], processes: int, tmp_path: Path) -> None:
    for name in ("plain", "blocked", "site"):
        (tmp_path / name).mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(BLOCKED)
    started = tmp_path / "started"
    blocked = {"PYTHONPATH": str(tmp_path / "site"), "BLOCKED": str(started)}
    outputs = []
    for name, environment in (("plain", {}), ("blocked", blocked)):
        done = subprocess.run(
            [sys.executable, "-m", "tyrecal", *command, "--output", "out"],
            env={**os.environ, **environment},
            cwd=tmp_path / name,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        assert "Traceback" not in done.stderr
        outputs.append(done.stdout)
    assert outputs[0] == outputs[1]
    without = results(tmp_path / "blocked" / "out")
    assert without == results(tmp_path / "plain" / "out") and len(without) >= 2
    assert len(started.read_text().split()) >= processes  # all of them went without
