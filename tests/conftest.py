"""Shared by all tests: where the cases are, one BLAS thread, loaded cases."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import shutil
from pathlib import Path

import pytest

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
