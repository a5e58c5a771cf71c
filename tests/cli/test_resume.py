"""Killed, refused, short of space: the same command again ends as if nothing had been."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ..conftest import CASES
from .test_cli import run

CASE = str(CASES / "p235_75r17.yaml")
RESULTS = ("fit.json", "fit.csv", "fit_history.csv")
FIT = ["fit", CASE, "--mesh", "coarse", "--no-pictures", "--quiet", "--output"]
COMMAND = [sys.executable, "-m", "tyrecal", *FIT]


def record(out: Path) -> set[str]:
    """Names of the finished evaluations."""
    return {path.name for path in out.glob("record/*/*.record")}


def facts(out: Path, study: str = "fit") -> dict:
    return json.loads((out / "run.json").read_text())[study]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("undisturbed")
    subprocess.run([*COMMAND, str(out), "--no-store"], check=True)
    assert not (out / "record").exists()
    return out


@pytest.mark.slow
def test_killed_four_times_and_run_again(undisturbed: Path, tmp_path: Path) -> None:
    out = tmp_path / "Reifen für Köln"
    chance = random.Random(1)
    runs = facts(undisturbed)["solver_runs"]
    for _ in range(4):
        before = record(out)
        process = subprocess.Popen([*COMMAND, str(out)])
        wanted = len(before) + chance.choice([1, 2])
        while len(record(out)) < min(wanted, runs) and process.poll() is None:
            time.sleep(0.005)
        time.sleep(chance.uniform(0, 0.1))
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert before <= record(out)
    finished = record(out)
    subprocess.run([*COMMAND, str(out)], check=True)
    for name in RESULTS:
        assert (out / name).read_bytes() == (undisturbed / name).read_bytes()
    run_facts = facts(out)
    assert run_facts["answered_from_record"] == len(finished)
    assert run_facts["solver_runs"] == runs - len(finished) == len(record(out) - finished)
    assert not (out / "runs").exists()
    assert not list(out.rglob("*.partial"))


@pytest.mark.slow
def test_two_at_once_in_one_folder(
    undisturbed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = subprocess.Popen([*COMMAND, str(tmp_path)])
    while not (tmp_path / "run.json").exists() and first.poll() is None:
        time.sleep(0.005)
    first.send_signal(signal.SIGSTOP)  # so that it cannot be done before the second begins
    assert run(*FIT, str(tmp_path)) == 2
    first.send_signal(signal.SIGCONT)
    message = capsys.readouterr().err
    assert f"process {first.pid}" in message and "tyrecal fit" in message
    assert message.count("\n") == 1 and "--output" in message
    assert first.wait() == 0
    assert (tmp_path / "fit.json").read_bytes() == (undisturbed / "fit.json").read_bytes()
    assert run(*FIT, str(tmp_path)) == 0  # it is free again


@pytest.mark.slow
def test_two_at_once_with_one_store(undisturbed: Path, tmp_path: Path) -> None:
    store = ["--store", str(tmp_path / "gemeinsamer Speicher")]
    both = [subprocess.Popen([*COMMAND, str(tmp_path / name), *store]) for name in ("a", "b")]
    for process in both:
        assert process.wait() == 0
    for name in ("a", "b"):
        assert (tmp_path / name / "fit.json").read_bytes() == (
            undisturbed / "fit.json"
        ).read_bytes()
        assert not (tmp_path / name / "record").exists()
    stored = set((tmp_path / "gemeinsamer Speicher").glob("*/*.record"))
    assert len(stored) > json.loads((undisturbed / "fit.json").read_text())["evaluations"]
    assert subprocess.run([*COMMAND, str(tmp_path / "alone"), *store], check=False).returncode == 0
    assert set((tmp_path / "gemeinsamer Speicher").glob("*/*.record")) == stored


def test_the_lock_of_a_dead_process_holds_nobody(tmp_path: Path) -> None:
    (tmp_path / ".lock").write_text('{"pid": 1, "host": "x", "command": "fit", "started": "t"}\n')
    assert run("modes", CASE, "--mesh", "coarse", "--output", str(tmp_path), "--quiet") == 0


def test_a_lock_whose_owner_has_not_written_yet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with (tmp_path / ".lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert run("modes", CASE, "--output", str(tmp_path)) == 2
    assert "in use by another process" in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["link", "fifo", "folder"])
@pytest.mark.parametrize("name", [".lock", ".lock.json"])
def test_what_is_no_lock_is_refused_by_name(
    name: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    victim, place = tmp_path / "victim", tmp_path / "out" / name
    victim.write_text("mine")
    place.parent.mkdir()
    if kind == "link":
        place.symlink_to(victim)
    elif kind == "fifo":
        os.mkfifo(place)
    else:
        place.mkdir()
    assert run("modes", CASE, "--output", str(place.parent)) == 2
    message = capsys.readouterr().err
    assert str(place) in message and message.count("\n") == 1
    assert victim.read_text() == "mine" and list(place.parent.iterdir()) == [place]


def test_a_file_system_without_locks_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def without(*_: object) -> None:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))

    monkeypatch.setattr(fcntl, "flock", without)
    assert run("modes", CASE, "--mesh", "coarse", "--output", str(tmp_path), "--quiet") == 0
    (message,) = caplog.messages
    assert str(tmp_path) in message and "cannot be locked" in message


@pytest.mark.slow
@pytest.mark.parametrize(
    ("most_bytes", "command"),
    [
        (20_000, "modes"),  # the decks do not fit
        pytest.param(200_000, "modes", marks=pytest.mark.slow),  # the solver's results do not fit
        (2_000, "fit"),
    ],
)
def test_a_full_disc_ends_in_one_sentence(most_bytes: int, command: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tyrecal", command, CASE, "--output", str(tmp_path / "out")],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes)),
    )
    assert done.returncode == 2
    *others, message = done.stderr.splitlines()  # a slow machine says that it is at work
    assert "error: " in message and "File too large" in message, done.stderr
    assert others in ([], [f"{command} ..."]), done.stderr
    left = {p.relative_to(tmp_path / "out").as_posix() for p in (tmp_path / "out").rglob("*")}
    assert left <= {"run.json", ".lock", "record"}


@pytest.mark.slow
def test_a_full_disc_under_the_results(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plain = Path.write_text

    def full(path: Path, text: str, **options: str) -> int:
        if "fit.csv" not in path.name:
            return plain(path, text, **options)
        plain(path, text[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_text", full)
    arguments = ["fit", CASE, "--mesh", "coarse", "--output", str(tmp_path), "--no-pictures"]
    assert run(*arguments) == 2
    message = capsys.readouterr().err
    assert "No space left on device" in message and "fit.csv" in message
    assert not (tmp_path / "fit.csv").exists() and not list(tmp_path.rglob("*.partial"))
    monkeypatch.undo()
    assert run(*arguments, "--quiet") == 0
    assert facts(tmp_path)["solver_runs"] == 0  # nothing was lost


def test_no_store_and_a_store_of_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("TYRECAL_STORE", str(tmp_path / "shared"))
    modes = ["modes", CASE, "--mesh", "coarse", "--quiet"]
    for name, runs in (("a", 1), ("b", 0)):
        assert run(*modes, "--output", str(tmp_path / name)) == 0
        assert facts(tmp_path / name, "modes")["solver_runs"] == runs
    assert (tmp_path / "a/modes.json").read_bytes() == (tmp_path / "b/modes.json").read_bytes()
    assert run(*modes, "--output", str(tmp_path / "a"), "--no-store") == 0
    assert facts(tmp_path / "a", "modes")["solver_runs"] == 1
    assert run("store", "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["records"] == 1 and summary["solvers"] == {"bundled 1.0.0": 1}


def test_store_verifies_and_prunes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for pressure in ("180", "240", "220"):  # in the middle as the case has it
        arguments = ["--output", str(tmp_path), "--quiet", "--pressure-kPa", pressure]
        assert run("modes", CASE, *arguments) == 0
    first = sorted(tmp_path.glob("record/*/*.record"))[0]
    first.write_bytes(first.read_bytes()[:-1])
    capsys.readouterr()
    assert run("store", str(tmp_path)) == 0
    assert "3 evaluations" in capsys.readouterr().out
    assert run("store", str(tmp_path), "--verify", "--json") == 0
    summary = json.loads(capsys.readouterr().out)
    assert (summary["records"], summary["damaged"]) == (2, 1) and "removed" not in summary
    assert run("store", str(tmp_path), "--prune", "0.4") == 0
    output = capsys.readouterr().out
    assert "1 evaluation," in output and "removed: 1" in output and "damaged: 0" in output
    assert run("store") == 2 and run("store", str(tmp_path / "none")) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_solvers_lists_what_works_and_what_does_not(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from importlib.metadata import EntryPoint

    from tyrecal.simulate.evaluate import solver

    entries = [
        EntryPoint("bundled", "tyrecal_solvers.bundled.adapter:Bundled", solver.GROUP),
        EntryPoint("broken", "no_such_package:Solver", solver.GROUP),
        EntryPoint("not_one", "json:JSONDecoder", solver.GROUP),
    ]
    monkeypatch.setattr(solver, "entry_points", lambda group: entries)
    assert run("solvers", "--json") == 0
    solvers = {each["name"]: each for each in json.loads(capsys.readouterr().out)}
    assert {"footprint", "gradients", "modes"} <= set(solvers["bundled"]["capabilities"])
    assert solvers["bundled"]["dialect"] == "abaqus" and solvers["bundled"]["problem"] is None
    assert "no_such_package" in solvers["broken"]["problem"]
    assert solvers["not_one"]["problem"]
    assert run("solvers") == 0
    assert "no_such_package" in capsys.readouterr().out
