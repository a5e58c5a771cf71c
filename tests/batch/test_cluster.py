"""Clusters: a scheduler and workers, some of which die, and settings of a queueing system."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tyrecal.simulate.evaluate.cluster import connected, jobs_of, reached, read_settings
from tyrecal.simulate.evaluate.executor import executor, in_order
from tyrecal.simulate.evaluate.failure import EvaluationFailed, SolverUnavailable
from tyrecal.simulate.settings import InputError

from ..cli.test_cli import run
from ..conftest import ROOT
from .support import vary

DASK = [sys.executable, "-m", "dask"]


def wait_for(condition: Callable[[], Any], seconds: float = 300.0) -> Any:
    end = time.monotonic() + seconds
    while not (answer := condition()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return answer


class Machines:
    """A scheduler and worker processes; ``address``; ``log``: "pid key" of every run."""

    def __init__(self, folder: Path, **settings: str):
        self.folder, self.log = folder, folder / "runs.txt"
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{port}"
        self.log.touch()
        self.environment = {
            **os.environ,
            "RUNS": str(self.log),
            "PYTHONPATH": str(ROOT),
            **settings,
        }
        self.workers: list[subprocess.Popen[bytes]] = []
        self.scheduler = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"
        )

    def add_worker(self) -> None:
        options = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--memory-limit", "0"]
        options += ["--host", "127.0.0.1", "--local-directory", str(self.folder)]
        options += ["--preload", "tests.batch.support"]
        self.workers.append(self._start("worker", self.address, *options))

    def _start(self, *command: str) -> subprocess.Popen[bytes]:
        with (self.folder / f"{len(self.workers)}-{command[0]}.log").open("wb") as log:
            return subprocess.Popen(
                [*DASK, *command], env=self.environment, cwd=self.folder, stdout=log, stderr=log
            )

    def runs(self) -> list[tuple[int, str]]:
        lines = self.log.read_text().splitlines()
        return [(int(pid), key) for pid, key in (line.split() for line in lines)]

    def stop(self) -> None:
        for process in [*self.workers, self.scheduler]:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def machines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machines]:
    """A scheduler and four workers."""
    started = Machines(tmp_path_factory.mktemp("machines"))
    for _ in range(4):
        started.add_worker()
    try:
        yield started
    finally:
        started.stop()


def square(task: float) -> float:
    """Dies with 3, raises with -1."""
    if task == 3:
        os._exit(9)
    if task < 0:
        raise ValueError("negative")
    return task**2


@pytest.mark.cluster
def test_one_of_four_workers_killed_in_the_middle(machines: Machines, tmp_path: Path) -> None:
    cases = list(map(str, vary(tmp_path / "cases", 5)))
    plain, out = tmp_path / "plain", tmp_path / "out"
    options = ["--quiet"]
    command = [sys.executable, "-m", "tyrecal", "batch", *cases, *options]
    batch = subprocess.Popen([*command, "--scheduler", machines.address, "--output", out])
    wait_for(lambda: len(machines.runs()) > 10 or batch.poll() is not None)
    assert batch.poll() is None
    unlucky = machines.runs()[-1][0]
    (worker,) = [each for each in machines.workers if each.pid == unlucky]
    worker.send_signal(signal.SIGSTOP)  # so that what it was at is known for certain
    records = {path.stem for path in out.glob("record/*/*.record")}
    under_way = [key for pid, key in machines.runs() if pid == unlucky][-1]
    worker.kill()
    worker.wait()
    assert batch.wait() == 0
    assert run("batch", *cases, *options, "--jobs", "2", "--output", str(plain)) == 0
    assert (out / "batch.json").read_bytes() == (plain / "batch.json").read_bytes()
    for case in json.loads((plain / "batch.json").read_text())["cases"]:
        for file in ("fit.json", "fit_history.csv"):
            place = Path(case["name"]) / file
            assert (out / place).read_bytes() == (plain / place).read_bytes()
    times = Counter(key for _, key in machines.runs())
    twice = {key for key, count in times.items() if count > 1}
    assert twice <= {under_way} - records and max(times.values()) <= 2
    recorded = [{path.name for path in each.glob("record/*/*.record")} for each in (out, plain)]
    assert recorded[0] == recorded[1] == {f"{key}.record" for key in times}
    assert not list(out.rglob("run-*"))


@pytest.mark.cluster
def test_a_task_that_kills_workers_is_given_up(tmp_path: Path) -> None:
    own = Machines(tmp_path, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="1")
    try:
        for _ in range(3):
            own.add_worker()
        with executor(scheduler=own.address) as workers:
            wait_for(lambda: len(workers.client.scheduler_info(n_workers=-1)["workers"]) == 3)
            answers = dict(workers.each(square, [5.0, 3.0, 7.0]))
        assert answers[0] == 25 and answers[2] == 49
        assert isinstance(answers[1], EvaluationFailed) and "2 workers died" in str(answers[1])
    finally:
        own.stop()


@pytest.mark.cluster
def test_starts_of_a_fit_are_those_of_one_process(machines: Machines, tmp_path: Path) -> None:
    (case,) = map(str, vary(tmp_path / "cases", 1))
    starts = ["--starts", "2", "--seed", "1", "--no-pictures", "--quiet", "--output"]
    assert run("fit", case, *starts, str(tmp_path / "a")) == 0
    scheduler = ["--scheduler", machines.address]
    assert run("fit", case, *starts, str(tmp_path / "b"), *scheduler) == 0
    assert (tmp_path / "a/fit.json").read_bytes() == (tmp_path / "b/fit.json").read_bytes()
    facts = json.loads((tmp_path / "b/run.json").read_text())["fit"]
    assert facts["solver_runs"] == len(list((tmp_path / "b").glob("record/*/*.record")))


def slow(task: float) -> float:
    time.sleep(task)
    return task


@pytest.mark.cluster
def test_a_scheduler_that_goes_away_ends_the_command(tmp_path: Path) -> None:
    own = Machines(tmp_path)
    try:
        own.add_worker()
        with (
            executor(scheduler=own.address) as workers,
            pytest.raises(SolverUnavailable, match="went away"),
        ):
            for _ in workers.each(slow, [0.01, 60.0, 60.0]):
                own.scheduler.kill()
    finally:
        own.stop()


@pytest.mark.cluster
def test_order_and_exceptions(machines: Machines) -> None:
    with executor(scheduler=machines.address) as workers:
        assert list(in_order(workers.each(square, [5.0, 0.0, 7.0]))) == [25, 0, 49]
        with pytest.raises(ValueError, match="negative"):
            list(workers.each(square, [1.0, -1.0]))


@pytest.mark.cluster
def test_another_edition_at_a_worker_is_refused(
    machines: Machines, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tyrecal.simulate.evaluate import cluster

    monkeypatch.setattr(cluster, "sources", lambda: "another")
    with (
        executor(scheduler=machines.address) as workers,
        pytest.raises(SolverUnavailable, match="another edition"),
    ):
        list(workers.each(square, [1.0]))


@pytest.mark.slow
def test_no_scheduler_there(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from tyrecal.simulate.evaluate import cluster

    monkeypatch.setattr(cluster, "SCHEDULER_PATIENCE_S", 0.3)
    (case,) = map(str, vary(tmp_path / "cases", 1))
    nowhere = ["--scheduler", "tcp://127.0.0.1:1", "--output", str(tmp_path / "out")]
    assert run("batch", case, *nowhere) == 3
    message = capsys.readouterr().err
    assert "no Dask scheduler answers at 'tcp://127.0.0.1:1'" in message
    assert "Traceback" not in message
    with pytest.raises(SolverUnavailable), connected("nonsense://x"):
        pass


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(SolverUnavailable, match=r"'\.\[cluster\]'"), connected("tcp://x:1"):
        pass


SETTINGS = """
queueing_system: {system}
workers: 8
cores: 4
memory: 6GB
walltime: "02:30:00"
queue: express
account: tyres
directives: ["--constraint=avx512"]
prologue: ["module load python/3.12"]
python: /opt/tyrecal/bin/python
"""


def script(system: str, folder: Path) -> list[str]:
    """Lines of the job script that such settings make."""
    path = folder / "cluster.yaml"
    path.write_text(SETTINGS.format(system=system))
    with jobs_of(read_settings(path)) as cluster:
        text: str = cluster.job_script()
    return text.splitlines()


def test_a_task_whose_worker_dies_is_given_to_three_others(tmp_path: Path) -> None:
    path = tmp_path / "cluster.yaml"
    path.write_text(SETTINGS.format(system="slurm"))
    with jobs_of(read_settings(path)) as cluster:
        assert cluster.scheduler.allowed_failures == 3


def test_a_job_of_slurm(tmp_path: Path) -> None:
    lines = script("slurm", tmp_path)
    for line in (
        "-p express",
        "-A tyres",
        "--cpus-per-task=4",
        "--mem=6G",
        "-t 02:30:00",
        "--constraint=avx512",
        "-n 1",
        "-J tyrecal",
    ):
        assert f"#SBATCH {line}" in lines
    common(lines)


def test_a_job_of_pbs(tmp_path: Path) -> None:
    lines = script("pbs", tmp_path)
    for line in (
        "-q express",
        "-A tyres",
        "-l select=1:ncpus=4:mem=5723MB",
        "-l walltime=02:30:00",
        "--constraint=avx512",
        "-N tyrecal",
    ):
        assert f"#PBS {line}" in lines
    common(lines)


def common(lines: list[str]) -> None:
    """Settings: one thread a worker, before the workers start; as many workers as cores."""
    start = next(i for i, line in enumerate(lines) if line.startswith("/opt/tyrecal/bin/python"))
    for name in ("OPENBLAS", "MKL", "OMP"):
        assert lines.index(f"export {name}_NUM_THREADS=1") < start
    assert lines.index("module load python/3.12") < start
    for option in ("--nthreads 1", "--nworkers 4", "--memory-limit 1.40GiB"):  # of 6e9 bytes each
        assert f"{option} " in lines[start]


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (("slurm", "slurms"), ["line 2", "queueing_system", "'slurm', 'pbs' or 'local'"]),
        (("workers: 8", "workers: 0"), ["line 3", "workers", "must be at least 1"]),
        (("cores: 4", "core: 4"), ["core", "did you mean 'cores'?"]),
        (("6GB", "lots"), ["line 5", "memory"]),
        (('"02:30:00"', "two hours"), ["line 6", "walltime"]),
        (("account: tyres", "account: ["), ["line"]),
    ],
)
def test_wrong_settings_are_named(edit: tuple[str, str], words: list[str], tmp_path: Path) -> None:
    path = tmp_path / "cluster.yaml"
    path.write_text(SETTINGS.format(system="slurm").replace(*edit))
    with pytest.raises(InputError) as refused:
        read_settings(path)
    for word in words:
        assert word in str(refused.value)


def kill_the_job(place: str) -> str:
    """End the job in the middle of its task, unless it has been done before."""
    if Path(place).exists():
        return "done"
    Path(place).touch()
    os.kill(os.getppid(), signal.SIGKILL)  # the nanny, which would start another worker
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


@pytest.mark.cluster
def test_a_job_that_ends_is_submitted_anew_and_its_task_done(tmp_path: Path) -> None:
    path = tmp_path / "here.yaml"
    path.write_text("queueing_system: local\nworkers: 1\nmemory: 1GB\n")
    with reached(str(path)) as address, executor(scheduler=address) as workers:
        assert list(workers.each(kill_the_job, [str(tmp_path / "killed")])) == [(0, "done")]
