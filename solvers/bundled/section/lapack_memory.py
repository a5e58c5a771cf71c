"""Memory of LAPACK, taken when this is imported.

SciPy and NumPy each have a copy of OpenBLAS, which takes a buffer of 32 MB in its first call and
keeps it. Without memory for it OpenBLAS tries for ever.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

BUFFER_BYTES = 1 << 26  # twice a buffer of OpenBLAS


def take_buffers() -> None:
    """Let both copies of OpenBLAS take their buffers. Raises MemoryError if there is no memory."""
    for first_call in (
        lambda: lapack.dpbtrs(np.ones((1, 1)), np.ones(1)),
        lambda: np.linalg.solve(np.ones((1, 1)), np.ones(1)),
    ):
        np.empty(BUFFER_BYTES, np.uint8)  # raises; its pages are never touched
        first_call()


take_buffers()
