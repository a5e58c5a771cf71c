"""Tasks done by the workers of a Dask scheduler (the extra ``cluster``): one that runs, or one of
our own, whose workers are jobs of a queueing system (SLURM, PBS).

The settings are a YAML file, `QueueSettings`. They say nothing about what is computed: results are
those of any other place.
"""

from __future__ import annotations

import logging
import signal
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field
from threadpoolctl import threadpool_limits

from ...files import Json
from ..provenance import sources
from ..settings import typed
from .failure import EvaluationFailed, SolverUnavailable

SCHEDULER_PATIENCE_S = 20.0  # for a scheduler to answer
log = logging.getLogger("tyrecal")
NO_DASK = (
    "a cluster needs packages that are not installed here:"
    " run pip install '.[cluster]' in a clone of tyrecal"
)
THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")


class Cluster:
    """The workers of a scheduler; those that die are replaced by the others."""

    def __init__(self, client: Any, address: str):
        self.client, self.address = client, address

    def each(
        self, function: Callable[[Any], Any], tasks: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        """As in `Executor`. A task is given up, as crashed, once it has seen more workers die
        than the scheduler allows (three, unless configured). Raises SolverUnavailable if that goes
        away, or a worker has other sources."""
        from distributed import KilledWorker, as_completed
        from distributed.client import FutureCancelledError

        at_worker = partial(_at_worker, function, sources())
        futures = self.client.map(at_worker, list(tasks), pure=False, key="tyrecal")
        places = {future.key: place for place, future in enumerate(futures)}
        waiting = as_completed(futures, loop=self.client.loop)
        del futures  # so that an answer is forgotten once it has been handed on
        try:
            for future in waiting:
                try:
                    answer = future.result()
                except KilledWorker as error:
                    words = f"{error.allowed_failures + 1} workers died with it"
                    answer = EvaluationFailed("crashed", words)
                except FutureCancelledError:
                    raise SolverUnavailable(
                        f"the scheduler at {self.address} went away; the same command resumes"
                    ) from None
                yield places[future.key], answer
        finally:
            with suppress(Exception):  # a dead scheduler must not hide why we are here
                if waiting.futures:
                    self.client.cancel([*waiting.futures], force=True)


def _at_worker(function: Callable[[Any], Any], expected: str, task: Any) -> Any:
    """``function`` as it runs elsewhere too: sources of the hash ``expected``, one BLAS thread."""
    if sources() != expected:
        raise SolverUnavailable("a worker has another edition of tyrecal: install the same on all")
    with threadpool_limits(1):
        return function(task)


@contextmanager
def connected(address: str) -> Iterator[Cluster]:
    """The workers of the scheduler at ``address``. Raises SolverUnavailable."""
    try:
        from distributed import Client
    except ImportError:
        raise SolverUnavailable(NO_DASK) from None
    try:
        client = Client(address, timeout=SCHEDULER_PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SolverUnavailable(f"no Dask scheduler answers at '{address}': {error}") from None
    try:
        if not client.scheduler_info(n_workers=-1)["workers"]:
            log.warning("the scheduler at %s has no workers yet; waiting for some", address)
        yield Cluster(client, address)
    finally:
        with suppress(Exception):
            client.close(timeout=2)


class QueueSettings(BaseModel):
    """Jobs of a queueing system. ``local`` starts them on this machine, to try the settings."""

    model_config = ConfigDict(extra="forbid", strict=True)

    queueing_system: Literal["slurm", "pbs", "local"]
    # processes in all, each does one case at a time
    workers: Annotated[int, Field(ge=1, le=100_000)]
    cores: Annotated[int, Field(ge=1, le=1024)] = 1  # of one job, a worker each
    memory: Annotated[str, Field(pattern=r"^[0-9.]+ *[kMGT]i?B$")] = "2GB"  # of one job, e.g. "8GB"
    # of one job, [days-]hours:minutes:seconds
    walltime: Annotated[str, Field(pattern=r"^([0-9]+-)?[0-9]+:[0-9]{2}:[0-9]{2}$")] = "01:00:00"
    queue: str | None = None  # None: the system's default, as of the account
    account: str | None = None
    # further lines of the job's head, without their ``#SBATCH`` or ``#PBS``
    directives: list[str] = Field(default_factory=list)
    # shell lines before the workers start (modules, environments)
    prologue: list[str] = Field(default_factory=list)
    interface: str | None = None  # network device, e.g. ib0
    python: str = sys.executable  # on the nodes
    log_directory: str | None = None  # of the jobs' output


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
        raise SolverUnavailable(NO_DASK) from None
    for each, handler in handlers.items():  # dask-jobqueue makes Ctrl-C an exit with code 0
        signal.signal(each, handler)
    given: Json = {
        "cores": settings.cores,
        "processes": settings.cores,
        "memory": settings.memory,
        "walltime": settings.walltime,
        "interface": settings.interface,
        "python": settings.python,
        "log_directory": settings.log_directory,
        "job_name": "tyrecal",
        "death_timeout": 600,  # s without a scheduler, after which a worker ends
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
