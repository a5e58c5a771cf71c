"""Tasks done by the workers of a Dask scheduler (the extra ``cluster``)."""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from threadpoolctl import threadpool_limits

from .failure import EvaluationFailed, SolverUnavailable
from .sources import sources

SCHEDULER_PATIENCE_S = 20.0  # for a scheduler to answer
log = logging.getLogger("tyrecal")


class Cluster:
    """The workers of a scheduler; those that die are replaced by the others."""

    def __init__(self, client: Any, address: str):
        self.client, self.address = client, address

    def each(
        self, function: Callable[[Any], Any], tasks: Sequence[Any]
    ) -> Generator[tuple[int, Any], None, None]:
        """As in `Executor`. A task is given up, as crashed, once it has seen more workers die
        than the scheduler allows (three, unless configured)."""
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
    """``function`` as it runs elsewhere too: the same sources, one BLAS thread."""
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
        raise SolverUnavailable("clusters need the extra: pip install 'tyrecal[cluster]'") from None
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
