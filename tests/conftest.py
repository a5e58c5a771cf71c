"""Shared by all tests: where the cases are, one BLAS thread, loaded cases."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import shutil
import signal
import threading
from pathlib import Path

import pytest

# a shell starts what runs in its background with SIGINT ignored, and commands would inherit that
if threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).parents[1]
CASES = ROOT / "cases"


@pytest.fixture
def case_folder(tmp_path: Path) -> Path:
    """A copy of the main case and its section, to be edited."""
    folder = tmp_path / "my cases"
    folder.mkdir()
    for name in ("p235_75r17.yaml", "p235_75r17.csv"):
        shutil.copy(CASES / name, folder)
    return folder
