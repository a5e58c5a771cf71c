"""Settings of the user: programs that solvers start, and defaults. A case says none of it."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path

import pytest

from tyrecal.errors import InputError
from tyrecal.simulate import settings
from tyrecal.simulate.evaluate.solver import find_solver
from tyrecal.simulate.settings import command_of, place, root

from .cli.test_cli import CASE, run
from .conftest import CASES

TOUCH = "from pathlib import Path; Path({!r}).touch(); raise SystemExit(3)"


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's settings file, not written yet."""
    path = tmp_path / "settings.yaml"
    monkeypatch.setenv("TYRECAL_SETTINGS", str(path))
    return path


def command_that_touches(path: Path) -> str:
    return shlex.join([sys.executable, "-c", TOUCH.format(str(path))])


@pytest.mark.parametrize("solver", ["calculix", "abaqus"])
def test_a_case_runs_no_program_of_its_own(
    solver: str, case_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = case_folder / "p235_75r17.yaml"
    options = json.dumps({"command": command_that_touches(tmp_path / "pwned")})
    text = case.read_text().replace("name: bundled", f"name: {solver}")
    case.write_text(text.replace("options: {}", f"options: {options}"))
    for command in (["validate"], ["modes", "--output", str(tmp_path / "out")]):
        assert run(command[0], str(case), *command[1:]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "solver.options.command" in line and "--solver-command" in line
    assert not (tmp_path / "pwned").exists()


@pytest.mark.parametrize("where", ["option", "variable", "file"])
@pytest.mark.parametrize("solver", ["calculix", "abaqus"])
def test_the_user_says_which_program(
    where: str, solver: str, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mark = tmp_path / "started"
    command, wrong = command_that_touches(mark), command_that_touches(tmp_path / "wrong")
    file.write_text(f"commands:\n  {solver}: {json.dumps(command if where == 'file' else wrong)}\n")
    if where != "file":
        monkeypatch.setenv("TYRECAL_SOLVER_COMMAND", command if where == "variable" else wrong)
    option = ["--solver-command", command] if where == "option" else []
    arguments = ["--solver", solver, "--mesh", "coarse", "--output", str(tmp_path / "out")]
    assert run("modes", CASE, *arguments, *option) == 3
    assert mark.exists() and not (tmp_path / "wrong").exists()


def test_a_batch_takes_the_option_too(tmp_path: Path) -> None:
    arguments = ["--solver", "calculix", "--mesh", "coarse", "--studies", "modes"]
    command = command_that_touches(tmp_path / "started")
    out = str(tmp_path / "out")
    assert run("batch", CASE, *arguments, "--solver-command", command, "--output", out) == 5
    assert (tmp_path / "started").exists()


def test_a_solver_without_a_program_takes_no_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match="starts no program"):
        find_solver("bundled", ["x"])
    monkeypatch.setenv("TYRECAL_SOLVER_COMMAND", "x")  # of another solver, perhaps
    assert find_solver("bundled").name == "bundled"


def test_a_relative_path_is_not_that_of_the_run_folder(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TYRECAL_SOLVER_COMMAND", "bin/ccx -x")
    assert command_of("calculix")[0] == [str(tmp_path / "bin/ccx"), "-x"]
    monkeypatch.delenv("TYRECAL_SOLVER_COMMAND")
    file.write_text("commands: {calculix: bin/ccx}\n")
    with pytest.raises(InputError, match="a name or a whole path"):
        command_of("calculix")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("jobs: 0", "line 1: jobs is 0: must be at least 1"),
        ("jobs: many", "line 1: jobs is many: must be a whole number"),
        ("jobs: 2\nsolvers: bundled", "solvers is bundled: is not a known key; did you mean"),
        ('commands: {calculix: "ccx \\0"}', "must hold no NUL character"),
        ("jobs: [", "not YAML"),
        ("commands:\n  calculix: ''", "commands.calculix is ''"),
        ("output: results", "must be a whole path"),
        ("", "empty"),
    ],
)
def test_a_wrong_file_is_one_sentence(
    text: str, words: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file.write_text(text)
    assert run("validate", CASE) == 2
    message = capsys.readouterr().err
    assert words in message and str(file) in message and message.count("\n") == 1
    assert run("solvers") == 0  # which says it, too
    assert words in " ".join(capsys.readouterr().out.split())


def test_a_file_that_is_named_must_be_there(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("validate", CASE) == 2 and "no such file" in capsys.readouterr().err


def test_defaults_of_options(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file.write_text(f"jobs: 2\nsolver: bundled\noutput: {tmp_path / 'studies'}\n")
    assert root() == tmp_path / "studies"
    study = ["--mesh", "coarse", "--quiet"]
    assert run("modes", str(CASES / "p235_75r17.yaml"), *study, "--no-pictures") == 0
    assert (tmp_path / "studies" / "p235_75r17" / "modes.json").exists()
    assert not capsys.readouterr().err  # nobody asked for two jobs, so nobody is told
    file.write_text("solver: no-such\n")
    assert run("modes", CASE, *study, "--output", str(tmp_path / "a")) == 2
    assert "'no-such' is not installed" in capsys.readouterr().err
    assert run("modes", CASE, *study, "--solver", "bundled", "--output", str(tmp_path / "a")) == 0


def test_solvers_and_doctor_say_what_is_in_force(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file.write_text("commands: {calculix: [/opt/ccx, -x]}\n")
    assert run("solvers") == 0
    output = " ".join(capsys.readouterr().out.split())
    assert f"calculix starts '/opt/ccx -x', from {file}" in output
    assert "abaqus starts 'abaqus', its default" in output and f"settings: {file}" in output
    assert run("doctor", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["settings"] == {"file": str(file), "there": True, "problem": None}
    assert {s["name"]: s["command"] for s in report["solvers"]}["calculix"] == ["/opt/ccx", "-x"]


def test_the_place_is_the_platforms(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("TYRECAL_SETTINGS")
    path = place()
    assert path and path.is_absolute() and path.name == "settings.yaml"
    assert "tyrecal" in path.parts
    monkeypatch.setenv("TYRECAL_SETTINGS", "")
    assert place() is None and settings.settings().commands == {}
