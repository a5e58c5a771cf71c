"""Conventions of every command: help with examples, options, exit codes, Ctrl-C, colours."""

from __future__ import annotations

import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest

from tyrecal.cli.main import COMMANDS, EXIT_CODES, cli

from ..conftest import CASES, ROOT
from .test_cli import run

CASE = str(CASES / "p235_75r17.yaml")
COARSE = ["--mesh", "coarse"]
TYRECAL = [sys.executable, "-m", "tyrecal"]


def commands() -> dict[str, click.Command]:
    """Every command by what is typed, those of groups too."""
    context = click.Context(cli)
    by_name: dict[str, click.Command] = {}
    for name in COMMANDS:
        command = cli.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            by_name |= {f"{name} {sub}": each for sub, each in command.commands.items()}
        else:
            by_name[name] = command
    return by_name


@pytest.mark.parametrize("name", commands())
def test_every_command_shows_an_example_and_has_the_options_of_all(name: str) -> None:
    command = commands()[name]
    text = (command.help or "").replace("\b", "")
    assert re.search(rf"^ *(eval \"\$\()?tyrecal {name}\b", text, re.M), text
    given = {option for param in command.params for option in param.opts}
    assert {"--json", "--quiet", "--verbose"} <= given
    for param in command.params:
        if isinstance(param, click.Option):
            assert param.help, param.opts


def test_every_module_of_a_command_is_listed() -> None:
    files = (ROOT / "tyrecal/cli").glob("*.py")
    modules = {path.stem for path in files if "\ndef command(" in path.read_text()}
    assert modules == {name.replace("-", "_") for name in COMMANDS}


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        (0, ["validate", CASE]),
        (2, ["validate", "none.yaml"]),
        (2, ["modes", CASE, "--mesh", "finest"]),
        (2, ["modes", CASE, "--no-such-option"]),
        (2, ["no-such-command"]),
        (2, ["solvers", "--quiet", "--verbose"]),
        pytest.param(
            3,
            [
                "modes",
                CASE,
                *COARSE,
                "--pressure-kPa",
                "1900",
                "--set",
                "A_carcass=1e-8",
                "--allow-unusual",
            ],
            marks=pytest.mark.slow,
        ),
        (3, ["modes", CASE, *COARSE, "--solver", "abaqus"]),
        (
            4,
            [
                "fit",
                CASE,
                *COARSE,
                "--no-pictures",
                "--set",
                "A_belt=1.1e-7",
                "--fix",
                "C10",
                "--fix",
                "A_carcass",
            ],
        ),
    ],
)
def test_exit_codes(
    code: int,
    arguments: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    if code == 4:  # the objective is least at the start: nothing moves
        from tyrecal.studies.fit import build_result

        monkeypatch.setattr(build_result, "MIN_STEP", float("inf"))
    assert run(*arguments) == code
    assert "Traceback" not in capsys.readouterr().err
    assert code in EXIT_CODES


@pytest.mark.slow
@pytest.mark.parametrize("options", [[], ["--json"]])
def test_a_reader_that_leaves_early_costs_no_result(options: list[str], tmp_path: Path) -> None:
    """As with `tyrecal fit CASE | head -3`: pictures are drawn, the run finishes all the same."""
    reader, writer = os.pipe()
    os.close(reader)
    fit = ["fit", CASE, *COARSE, "--output", str(tmp_path), *options]
    done = subprocess.run([*TYRECAL, *fit], stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert done.returncode == 0 and "Error" not in done.stderr, done.stderr
    assert json.loads((tmp_path / "run.json").read_text())["fit"]["finished"] is True
    assert (tmp_path / "fit_shapes.json").exists() and (tmp_path / "fit_modes.png").exists()


def test_exit_codes_are_told_alike() -> None:
    table = (
        (ROOT / "cases/README.md").read_text().partition("| exit code |")[2].partition("\n\n")[0]
    )
    shown = re.findall(r"^\| (\d[\d, ]*) \|", table, re.M)
    assert [int(code) for cell in shown for code in cell.split(",")] == list(EXIT_CODES)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [pytest.param("1", marks=pytest.mark.slow), "2"])
def test_ctrl_c_leaves_what_was_done_and_says_how_to_go_on(jobs: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [
        *TYRECAL,
        "sweep-pressure",
        CASE,
        *COARSE,
        "--steps",
        "40",
        "--jobs",
        jobs,
        "--no-pictures",
        "--output",
        str(out),
    ]
    process = subprocess.Popen(
        command, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    while len(list(out.glob("record/*/*.record"))) < 3 and process.poll() is None:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to all processes
    words = process.communicate(timeout=200)[1]
    assert process.returncode == 130, words
    assert (
        "interrupted: " in words and "same command again to resume" in words and str(out) in words
    )
    assert "Traceback" not in words
    before = len(list(out.glob("record/*/*.record")))  # the nominal tyre's among them
    assert 3 <= before < 40
    assert subprocess.run([*command, "--quiet"], check=False).returncode == 0
    facts = json.loads((out / "run.json").read_text())["sweep-pressure"]
    assert facts["answered_from_record"] == before and facts["solver_runs"] == 41 - before
    assert not list(out.glob("runs/*"))


def test_ctrl_c_without_a_record_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from tyrecal.simulate.evaluate.evaluator import Evaluator

    def stopped(evaluator: Evaluator, question: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Evaluator, "evaluate", stopped)
    assert run("modes", CASE, "--output", str(tmp_path), "--no-store") == 130
    assert "no evaluation is stored (--no-store)" in capsys.readouterr().err
    assert run("modes", CASE, "--output", str(tmp_path)) == 130
    assert "again to resume" in capsys.readouterr().err


def on_a_terminal(*arguments: str, **environment: str) -> str:
    """Output of a command to standard error on a terminal."""
    ours, theirs = pty.openpty()
    plain = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    process = subprocess.Popen(
        [*TYRECAL, *arguments],
        stdout=subprocess.DEVNULL,
        stderr=theirs,
        env={**plain, "TERM": "xterm-256color", "COLUMNS": "100", **environment},
    )
    os.close(theirs)
    output = b""
    try:
        while piece := os.read(ours, 65536):
            output += piece
    except OSError:  # the other end is closed
        pass
    process.wait()
    os.close(ours)
    return output.decode()


@pytest.mark.slow
def test_progress_is_on_terminals_only(tmp_path: Path) -> None:
    command = ["sweep-pressure", CASE, *COARSE, "--steps", "3", "--no-pictures", "--output"]
    output = on_a_terminal(*command, str(tmp_path / "a"))
    assert "3/3" in output and "\x1b[" in output
    shown = re.findall(r"(\d)/3 (.*?)\s*\r", re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", output))
    assert shown and "left" in output
    for done, clock in shown:  # nothing is left before something is done, nor after all is
        left = ", 0:\\d\\d left" if done in "12" else ""
        assert re.fullmatch(rf"0:\d\d elapsed{left}", clock), clock
    assert "3/3" not in on_a_terminal(*command, str(tmp_path / "b"), "--quiet")
    done = subprocess.run(
        [*TYRECAL, *command, str(tmp_path / "c")], capture_output=True, text=True, check=True
    )
    assert done.stderr == "sweep ...\n" and "\x1b" not in done.stdout


@pytest.mark.slow
def test_loads_show_on_the_bar(tmp_path: Path) -> None:
    output = on_a_terminal(
        "footprint",
        CASE,
        "--mesh",
        "coarse",
        "--loads-N",
        "300,500",
        "--output",
        str(tmp_path),
        "--no-pictures",
    )
    assert "footprint, load 2 of 2" in output and "1/1" in output


@pytest.mark.parametrize(
    ("environment", "red"),
    [pytest.param({}, True, marks=pytest.mark.slow), ({"NO_COLOR": "1"}, False)],
)
def test_colours(environment: dict[str, str], red: bool) -> None:
    output = on_a_terminal("validate", "none.yaml", **environment)
    assert "error: " in output and ("\x1b[31m" in output) == red


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("val", ["validate"]),
        ("fit cases/p235_75r17_", ["cases/p235_75r17_narrow_rim.yaml"]),
        ("fit cases/p235_75r17.yaml --solver b", ["bundled"]),
        ("fit cases/p235_75r17.yaml --fix A", ["A_belt", "A_carcass"]),
        ("fit cases/p235_75r17.yaml --mesh ref", ["refined"]),
        ("modes cases/p235_75r17.yaml --set A_b", ["A_belt="]),
        (
            "modes cases/p235_75r17.yaml --set rim.ref",
            ["rim.reference_point_m.r=", "rim.reference_point_m.z="],
        ),
        ("modes cases/p235_75r17.yaml --set effects.cap", ["effects.cap_ply="]),
        ("effects bead_f", ["bead_filler"]),
        ("diagnose cases/p235_75r17.yaml --effect tread_", ["tread_density", "tread_wear"]),
        ("diagnose cases/p235_75r17.yaml --add rim", ["rim_width="]),
        ("modes no_such.yaml --set A", []),
        ("completion z", ["zsh"]),
    ],
)
def test_completion(
    words: str,
    expected: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("COMP_WORDS", f"tyrecal {words}")
    monkeypatch.setenv("COMP_CWORD", str(len(words.split())))
    monkeypatch.setenv("_TYRECAL_COMPLETE", "bash_complete")
    run()
    items = capsys.readouterr().out.split()
    assert [item.partition(",")[2] for item in items] == expected
    assert all(item.startswith("plain,") for item in items)


def test_names_that_a_shell_would_run_are_not_offered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of a stranger's case, which nobody has judged yet."""
    case = tmp_path / "odd.yaml"
    case.write_text(Path(CASE).read_text().replace("  A_belt:", '  "$(touch x)":'))
    monkeypatch.setenv("_TYRECAL_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", f"tyrecal modes {case} --set ")
    monkeypatch.setenv("COMP_CWORD", "4")
    run()
    offered = capsys.readouterr().out
    assert "plain,A_carcass=" in offered and "touch" not in offered


def test_the_scripts_of_the_shells(capsys: pytest.CaptureFixture[str]) -> None:
    for shell, mark in (("bash", "complete -o"), ("zsh", "compdef"), ("fish", "complete --no")):
        assert run("completion", shell, "--json") == 0
        script = json.loads(capsys.readouterr().out)["script"]
        assert mark in script and "_TYRECAL_COMPLETE" in script


def test_cases_that_need_quotes_are_left_to_the_shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Bash puts a completion in the line as it is: $(...) would run."""
    (tmp_path / "$(touch x).yaml").touch()
    monkeypatch.setenv("_TYRECAL_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", f"tyrecal fit {tmp_path}/")
    monkeypatch.setenv("COMP_CWORD", "2")
    run()
    assert capsys.readouterr().out == f"file,{tmp_path}/\n"


def test_version() -> None:
    import tyrecal

    done = subprocess.run([*TYRECAL, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"tyrecal, version {tyrecal.__version__}"
