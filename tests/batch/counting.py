"""Record every run of the solver with its process; a Dask worker loads this module first."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.simulate.evaluate.store import key_of

DELAY_S = 0.05  # so that a run can be interrupted


def dask_setup(worker: Any) -> None:
    """Called by the worker."""
    plain, log = Bundled.run, Path(os.environ["RUNS"])

    def run(self: Bundled, folder: Path, time_limit_s: float) -> None:
        with log.open("a") as file:
            file.write(f"{os.getpid()} {key_of(folder, self)}\n")
        time.sleep(DELAY_S)
        plain(self, folder, time_limit_s)

    Bundled.run = run  # type: ignore[method-assign]
