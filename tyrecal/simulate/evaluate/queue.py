"""A scheduler of our own, whose workers are jobs of a queueing system (SLURM, PBS).

The settings are a YAML file, `QueueSettings`. They say nothing about what is computed: results
are those of any other place.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ..settings import typed
from .failure import SolverUnavailable

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


class QueueSettings(BaseModel):
    """Jobs of a queueing system. ``local`` starts them on this machine, to try the settings.

    workers: processes in all, each does one case at a time; cores: of one job, a worker each;
    memory: of one job, e.g. "8GB"; directives: further lines of the job's head, without their
    ``#SBATCH`` or ``#PBS``; prologue: shell lines before the workers start (modules, environments);
    interface: network device, e.g. ib0; python: on the nodes; log_directory: of the jobs' output.
    """

    model_config = ConfigDict(extra="forbid", strict=True)

    queueing_system: Literal["slurm", "pbs", "local"]
    workers: Annotated[int, Field(ge=1, le=100_000)]
    cores: Annotated[int, Field(ge=1, le=1024)] = 1
    memory: Annotated[str, Field(pattern=r"^[0-9.]+ *[kMGT]i?B$")] = "2GB"
    walltime: Annotated[str, Field(pattern=r"^([0-9]+-)?[0-9]+:[0-9]{2}:[0-9]{2}$")] = "01:00:00"
    queue: str | None = None
    account: str | None = None
    directives: list[str] = Field(default_factory=list)
    prologue: list[str] = Field(default_factory=list)
    interface: str | None = None
    python: str = sys.executable
    log_directory: str | None = None


def read_settings(path: Path) -> QueueSettings:
    """Settings from their file. Raises InputError, in one sentence a mistake."""
    return typed(path, QueueSettings)


def jobs_of(settings: QueueSettings) -> Any:
    """A cluster of dask-jobqueue, its scheduler in this process, no jobs yet.

    Raises SolverUnavailable without the extra.
    """
    handlers = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        import dask
        from dask_jobqueue import PBSCluster, SLURMCluster
        from dask_jobqueue.local import LocalCluster
    except ImportError:
        raise SolverUnavailable("clusters need the extra: pip install 'tyrecal[cluster]'") from None
    for each, handler in handlers.items():  # dask-jobqueue makes Ctrl-C an exit with code 0
        signal.signal(each, handler)
    given: dict[str, Any] = {
        "cores": settings.cores,
        "processes": settings.cores,
        "memory": settings.memory,
        "walltime": settings.walltime,
        "interface": settings.interface,
        "python": settings.python,
        "log_directory": settings.log_directory,
        "job_name": "tyrecal",
        "death_timeout": 600,
        "job_extra_directives": settings.directives,
        "job_script_prologue": [
            *(f"export {name}=1" for name in THREAD_VARIABLES),
            *settings.prologue,
        ],
    }
    if settings.queueing_system == "local":
        given["job_script_prologue"] = []  # its jobs are commands, not scripts
        return LocalCluster(**given)
    given |= {"queue": settings.queue, "account": settings.account}
    with dask.config.set({"distributed.scheduler.allowed-failures": 3}):
        return {"slurm": SLURMCluster, "pbs": PBSCluster}[settings.queueing_system](**given)


@contextmanager
def reached(scheduler: str) -> Iterator[str]:
    """The address of a scheduler: as given, or of one that a settings file (``.yaml``) starts, with
    its jobs, for as long as the block lasts. Raises InputError, SolverUnavailable."""
    if not scheduler.endswith((".yaml", ".yml")):
        yield scheduler
        return
    settings = read_settings(Path(scheduler))
    cluster = jobs_of(settings)
    try:
        jobs = -(-settings.workers // settings.cores)
        cluster.adapt(minimum_jobs=jobs, maximum_jobs=jobs)  # one that ends is submitted anew
        yield cluster.scheduler_address
    finally:
        with suppress(Exception):  # jobs that are gone must not hide why we are here
            cluster.close()
