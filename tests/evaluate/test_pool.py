"""Worker processes do not outlive the process that was killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

PARENT = """
import os, sys, time
from pathlib import Path
from tests.evaluate.test_pool import work
from tyrecal.evaluate.pool import process_pool

if __name__ == "__main__":
    with process_pool(1) as pool:
        pool.submit(work, sys.argv[1]).result()
"""


def work(place: str) -> None:
    """Say who is at work, and be long about it."""
    Path(place).write_text(str(os.getpid()))
    time.sleep(60)


def test_a_busy_worker_ends_with_its_parent(tmp_path: Path) -> None:
    (tmp_path / "parent.py").write_text(PARENT)
    said = tmp_path / "pid"
    root = Path(__file__).parents[2]
    environment = {**os.environ, "PYTHONPATH": str(root)}
    parent = subprocess.Popen([sys.executable, tmp_path / "parent.py", said], env=environment)
    while not (said.exists() and said.read_text()) and parent.poll() is None:
        time.sleep(0.02)
    parent.kill()
    parent.wait()
    for _ in range(100):
        status = Path(f"/proc/{said.read_text()}/stat")
        if not status.exists() or status.read_text().rpartition(")")[2].split()[0] == "Z":
            return
        time.sleep(0.1)
    raise AssertionError("the worker outlived its parent")
