"""TERM and HUP end a command as Ctrl-C does: a sentence, an exit code, nothing left at work."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
import time
from itertools import product
from pathlib import Path

import pytest

from tyrecal.files import CHANGED
from tyrecal.interrupt import WORDS

from ..conftest import CASES
from .test_cli import run

CASE = str(CASES / "p235_75r17.yaml")
SCRIPT = str(Path(sys.executable).parent / "tyrecal")  # which workers import anew
SWEEP = [SCRIPT, "sweep-pressure", CASE, "--mesh", "coarse", "--no-pictures", "--quiet"]
ENDS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
QUICK = [("SIGHUP", 1)]
PIECE = 'echo $$ >> "$PIDS"; trap "" TERM; '  # says who it is, and is deaf


def stubborn_ccx(folder: Path) -> dict[str, str]:
    """An environment in which ccx is a program that, like its child, does not want to end."""
    (folder / "bin").mkdir()
    program = folder / "bin" / "ccx"
    program.write_text(
        "#!/bin/sh\n[ $1 = -v ] && echo Version 2.20 && exit\n"
        f"{PIECE}sh -c '{PIECE}sleep 300; true' & sleep 300; true\n"
    )
    program.chmod(0o755)
    (folder / "pids").touch()
    return {
        **os.environ,
        "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}",
        "PIDS": str(folder / "pids"),
    }


def alive(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.parametrize(
    ("how", "jobs"),
    [
        pytest.param(how, jobs, marks=() if (how.name, jobs) in QUICK else pytest.mark.slow)
        for how, jobs in product(ENDS, (1, 2))
    ],
)
def test_the_solver_ends_with_all_that_it_started(
    how: signal.Signals, jobs: int, tmp_path: Path
) -> None:
    environment = stubborn_ccx(tmp_path)
    command = [
        *SWEEP,
        "--solver",
        "calculix",
        "--steps",
        "2",
        "--jobs",
        str(jobs),
        "--output",
        str(tmp_path / "out"),
    ]
    process = subprocess.Popen(
        command, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    pids: list[int] = []
    while len(pids) < 2 * jobs and process.poll() is None:
        pids = [int(word) for word in (tmp_path / "pids").read_text().split()]
        time.sleep(0.02)
    process.send_signal(how)
    words = process.communicate(timeout=200)[1]
    assert process.returncode == 128 + how, words
    pattern = (
        rf"\n{WORDS[how.name]}: finished evaluations .* run the same command again to resume\n"
    )
    assert re.fullmatch(pattern, words), words
    assert len(pids) == 2 * jobs and not [pid for pid in pids if alive(pid)]
    assert not (tmp_path / "out" / "runs").exists()


@pytest.mark.slow
def test_workers_that_have_done_some_clear_up_too(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [*SWEEP, "--steps", "40", "--jobs", "2", "--output", str(out)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while len(list(out.glob("record/*/*.record"))) < 6 and process.poll() is None:
        time.sleep(0.01)
    process.terminate()
    words = process.communicate(timeout=200)[1]
    assert process.returncode == 143
    assert re.fullmatch(
        r"\nterminated: finished evaluations .* run the same command again to resume\n", words
    ), words
    assert not (out / "runs").exists()


def test_what_a_worker_that_had_to_be_killed_leaves_goes_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def meanwhile(*_: object) -> None:
        (tmp_path / "out" / "runs" / "run-left").mkdir(parents=True)
        raise KeyboardInterrupt

    monkeypatch.setattr("tyrecal.studies.pressure._state", meanwhile)
    assert run(*SWEEP[1:], "--steps", "2", "--output", str(tmp_path / "out")) == 130
    assert not (tmp_path / "out" / "runs").exists()


@pytest.mark.slow
@pytest.mark.parametrize("how", [pytest.param("nohup", marks=pytest.mark.slow), "hang up"])
def test_a_terminal_that_closes(how: str, tmp_path: Path) -> None:
    """It ends the command; under nohup it does not, which reads nothing from it."""
    ours, theirs = pty.openpty()
    os.set_inheritable(theirs, True)
    command = [*SWEEP, "--steps", "4", "--output", str(tmp_path / "out")]
    if how == "nohup":
        command = ["nohup", *command]
    # a session of its own whose terminal is ours: what closes there hangs it up
    session = f"""import os
os.setsid()
os.close(os.open({os.ttyname(theirs)!r}, os.O_RDWR))
os.execvp({command[0]!r}, {command!r})"""
    leader = [sys.executable, "-c", session]
    with (tmp_path / "said").open("wb") as log:
        process = subprocess.Popen(leader, stdin=theirs, stdout=log, stderr=theirs, cwd=tmp_path)
    os.close(theirs)
    while not list(tmp_path.glob("out/record/*/*.record")) and process.poll() is None:
        time.sleep(0.01)
    os.close(ours)
    assert process.wait(200) == (0 if how == "nohup" else 129)
    assert (tmp_path / "out" / "pressure_sweep.json").exists() == (how == "nohup")
    assert not (tmp_path / "out" / "runs").exists()


@pytest.mark.parametrize("how", ENDS, ids=lambda how: how.name)
@pytest.mark.parametrize("command", [["-m", "tyrecal"], ["the script"]], ids=lambda c: c[-1])
def test_while_the_tool_is_imported(
    how: signal.Signals, command: list[str], tmp_path: Path
) -> None:
    """From its first own line on: the first package that it wants is one that meets the signal."""
    (tmp_path / "click.py").write_text(f"import signal; signal.raise_signal({how.value})\n")
    if command == ["the script"]:
        command = [SCRIPT]
    done = subprocess.run(
        [sys.executable, *command, "validate", CASE],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )
    assert done.returncode == 128 + how
    assert done.stderr == f"\n{WORDS[how.name]}: nothing was changed\n" and not done.stdout


@pytest.mark.slow
def test_in_the_middle_of_code_that_is_made_as_text(tmp_path: Path) -> None:
    """As dataclasses are: Python remembers that, and ``python -m`` would end with the signal."""
    program = f"""
from tyrecal.cli import arguments, main
def load(*_): exec("import signal; signal.raise_signal(signal.SIGTERM)")
arguments.load = load
main.main(["modes", {CASE!r}])"""
    (tmp_path / "program.py").write_text(program)
    command = [sys.executable, "-m", "program"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (143, "")
    assert done.stderr == "\nterminated: nothing was changed\n"


@pytest.mark.slow
def test_when_the_command_is_done_nothing_counts_any_more(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import atexit, signal\natexit.register(signal.raise_signal, signal.SIGTERM)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    arguments = [sys.executable, "-m", "tyrecal", "validate", CASE, "--quiet"]
    done = subprocess.run(arguments, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("command", ["modes", "modes --no-store", "deck", "init 205/60R15"])
def test_nothing_was_changed_only_where_that_is_so(
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Ctrl-C when the first file is in its place, and before."""
    words = command.split()
    words += ["--no-pictures"] if "init" in words else [CASE, "--mesh", "coarse"]
    words += ["--output", str(tmp_path / "out.yaml")]
    plain = Path.replace

    def then_ctrl_c(path: Path, target: Path) -> None:
        plain(path, target)
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", then_ctrl_c)
    assert run(*words) == 130
    message = capsys.readouterr().err
    assert "nothing was changed" not in message and "the same command" in message
    assert any(tmp_path.iterdir())

    def at_once(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tyrecal.cli.arguments.load", at_once)
    monkeypatch.setattr("tyrecal.tyre.case.new_case.from_size", at_once)
    assert run(*words) == 130
    assert "interrupted: nothing was changed" in capsys.readouterr().err
    assert not CHANGED.is_set()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux")
@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(["effects"], marks=pytest.mark.slow),
        ["validate", "none.yaml"],
        pytest.param(["no-such"], marks=pytest.mark.slow),
    ],
)
def test_nobody_can_be_told(arguments: list[str]) -> None:
    """Both outputs full: no traceback could be seen, so the exit code says it."""
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "tyrecal", *arguments]
        assert subprocess.run(command, stdout=full, stderr=full).returncode == 2


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux")
def test_a_full_standard_output_is_told() -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "tyrecal", "effects"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "No space left on device" in done.stderr
    assert "standard output" in done.stderr


@pytest.mark.cluster
def test_a_batch_whose_workers_are_jobs(tmp_path: Path) -> None:
    """As SLURM ends the job in which the command runs; its own jobs end with it."""
    settings = tmp_path / "here.yaml"
    settings.write_text("queueing_system: local\nworkers: 1\nmemory: 1GB\n")
    cases = [CASE, str(CASES / "p235_75r17_narrow_rim.yaml")]
    command = [
        sys.executable,
        "-m",
        "tyrecal",
        "batch",
        *cases,
        "--studies",
        "fit,sweep-pressure",
        "--scheduler",
        str(settings),
        "--output",
        str(tmp_path / "out"),
    ]
    mark = f"MARK={tmp_path}"
    process = subprocess.Popen(
        command, env={**os.environ, "MARK": str(tmp_path)}, stderr=subprocess.PIPE, text=True
    )
    while not list(tmp_path.glob("out/record/*/*.record")) and process.poll() is None:
        time.sleep(0.05)
    process.terminate()
    words = process.communicate(timeout=200)[1]
    assert process.returncode == 143, words
    assert "terminated: finished evaluations" in words and "Traceback" not in words
    for _ in range(100):
        theirs = [
            each for each in Path("/proc").glob("[0-9]*/environ") if mark in environment(each)
        ]
        if not theirs:
            return
        time.sleep(0.1)
    raise AssertionError(f"still there: {theirs}")


def environment(path: Path) -> str:
    """Environment of a process; empty once it has ended."""
    try:
        return path.read_bytes().decode(errors="replace")
    except OSError:
        return ""
