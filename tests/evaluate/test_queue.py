"""Settings of a queueing system: what its jobs are asked for, and that they do the work."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from tyrecal.simulate.evaluate.cluster import jobs_of, reached, read_settings
from tyrecal.simulate.evaluate.executor import executor
from tyrecal.simulate.settings import InputError

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
