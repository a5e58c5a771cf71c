"""Too little memory ends the bundled solver at once."""

from __future__ import annotations

import subprocess
import sys

import pytest

STARVED = """
import resource
import numpy, scipy.linalg
size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
hard = resource.getrlimit(resource.RLIMIT_AS)[1]
resource.setrlimit(resource.RLIMIT_AS, (size + 20_000_000, hard))  # a buffer has 32 MB
from tyrecal_solvers.bundled.section import lapack_memory
"""


@pytest.mark.skipif(sys.platform != "linux", reason="sizes of processes are read from /proc")
def test_no_memory_for_the_buffers_of_lapack_is_an_error() -> None:
    """OpenBLAS itself tries for ever, so that a fit would not end."""
    command = [sys.executable, "-c", STARVED]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1 and "MemoryError" in done.stderr, done.stderr
