"""The program that the user names is the one that runs: command lines in words, whole paths."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest
from tyrecal_solvers.calculix.adapter import CalculiX

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.solver import find_solver, installed
from tyrecal.simulate.evaluate.store import key_of
from tyrecal.simulate.program import join_command, split_command
from tyrecal.simulate.settings import words
from tyrecal.tyre.load import load_case

from .cli.test_cli import CASE, run

# the first six of Microsoft's own table, "Parsing C command-line arguments", behind a program
ON_WINDOWS = {
    r'ccx "a b c" d e': ["ccx", "a b c", "d", "e"],
    r'ccx "ab\"c" "\\" d': ["ccx", 'ab"c', "\\", "d"],
    r'ccx a\\\b d"e f"g h': ["ccx", r"a\\\b", "de fg", "h"],
    r"ccx a\\\"b c d": ["ccx", r"a\"b", "c", "d"],
    r'ccx a\\\\"b c" d e': ["ccx", r"a\\b c", "d", "e"],
    r'ccx a"b"" c d': ["ccx", 'ab" c d'],
    r"C:\ccx\ccx.exe": [r"C:\ccx\ccx.exe"],
    r"C:\ccx\ccx.exe -x": [r"C:\ccx\ccx.exe", "-x"],
    r'"C:\Program Files\ccx\ccx.exe" -x': [r"C:\Program Files\ccx\ccx.exe", "-x"],
    r'C:\"Program Files"\ccx.exe -x': [r"C:\Program Files\ccx.exe", "-x"],
    r"\\server\share\ccx.exe -x": [r"\\server\share\ccx.exe", "-x"],
    r'"\\server\my share\ccx.exe" -x': [r"\\server\my share\ccx.exe", "-x"],
    r"C:/ccx/ccx.exe -x": ["C:/ccx/ccx.exe", "-x"],
    r"..\bin\abaqus.bat cpus=4": [r"..\bin\abaqus.bat", "cpus=4"],
    r'abaqus user="C:\my models\sub.for"': ["abaqus", r"user=C:\my models\sub.for"],
    r'abaqus "scratch=D:\tmp dir\\" cpus=4': ["abaqus", "scratch=D:\\tmp dir\\", "cpus=4"],
    "abaqus scratch=D:\\tmp\\": ["abaqus", "scratch=D:\\tmp\\"],
    "  abaqus \t cpus=4   -x  ": ["abaqus", "cpus=4", "-x"],
    "abaqus 'a b' \"\"": ["abaqus", "'a", "b'", ""],
    'abaqus "never closed -x': ["abaqus", "never closed -x"],
}
FOLDER = '"C:\\Program Files\\ccx\\" -x'


@pytest.mark.parametrize("line", ON_WINDOWS)
def test_windows_command_lines(line: str) -> None:
    """CommandLineToArgvW and C programs split them so; Python's own joining is the inverse."""
    assert split_command(line, windows=True) == ON_WINDOWS[line]
    again = join_command(ON_WINDOWS[line], windows=True)
    assert again == subprocess.list2cmdline(ON_WINDOWS[line])
    assert split_command(again, windows=True) == ON_WINDOWS[line]


def test_in_the_programs_name_a_backslash_is_a_letter() -> None:
    assert split_command(FOLDER, windows=True) == ["C:\\Program Files\\ccx\\", "-x"]
    assert split_command("", windows=True) == [""]


def test_elsewhere_a_shells_rules_hold() -> None:
    line = r"'/opt/my ccx/ccx' -x a\ b"
    assert split_command(line, windows=False) == ["/opt/my ccx/ccx", "-x", "a b"]
    assert join_command(["/opt/my ccx/ccx", "a b"], windows=False) == "'/opt/my ccx/ccx' 'a b'"
    with pytest.raises(ValueError, match="No closing quotation"):
        split_command("'a", windows=False)


def ccx(folder: Path, mark: Path, version: str = "9.99") -> Path:
    """A program that says that it ran, and its version, and fails."""
    folder.mkdir(exist_ok=True)
    program = folder / "ccx"
    program.write_text(f'#!/bin/sh\necho "This is Version {version}"\necho ran >> {mark}\nexit 7\n')
    program.chmod(0o755)
    return program


@pytest.fixture(scope="module")
def design() -> TyreDesign:
    return TyreDesign(load_case(CASE))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The present folder, with a ccx; another is the first on the path, home has a third."""
    monkeypatch.chdir(tmp_path)
    ccx(tmp_path, tmp_path / "mine")
    ccx(tmp_path / "bin", tmp_path / "other", "1.11")
    ccx(tmp_path / "home", tmp_path / "homes")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("TYRECAL_SETTINGS", "")
    return tmp_path


def test_the_named_program_gives_version_and_answers(here: Path) -> None:
    """Its whole path is in run.json."""
    options = ["--solver", "calculix", "--solver-command", "./ccx", "--output", "out"]
    assert run("modes", CASE, "--mesh", "coarse", *options) == 3
    assert (here / "mine").read_text() == "ran\nran\n" and not (here / "other").exists()
    facts = json.loads((here / "out" / "run.json").read_text())["modes"]
    assert (facts["solver"], facts["solver_command"]) == ("calculix 9.99", [str(here / "ccx")])


@pytest.mark.parametrize(
    ("command", "path", "program"),
    [
        ("./ccx -x", None, "ccx"),
        ("bin/ccx -x", None, "bin/ccx"),
        ("~/ccx -x", None, "home/ccx"),
        ("ccx -x", None, "bin/ccx"),
        ("ccx -x", ".", "ccx"),
        ("ccx -x", "", "ccx"),
        ("ccx -x", "home/../bin", "bin/ccx"),
    ],
)
def test_a_program_is_found_once_for_all_who_run_it(
    command: str,
    path: str | None,
    program: str,
    here: Path,
    design: TyreDesign,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The option and the variable set the program here and in worker processes, wherever these
    are."""
    if path is not None:
        monkeypatch.setenv("PATH", f"{path}{os.pathsep}{os.environ['PATH']}")
    whole = [str(here / program), "-x"]
    assert words(command, "--solver-command") == whole
    monkeypatch.setenv("TYRECAL_SOLVER_COMMAND", command)
    assert find_solver("calculix").command == whole  # type: ignore[attr-defined]
    assert {each["name"]: each["command"] for each in installed()}["calculix"] == whole
    worker = Evaluator(design, "calculix").worker()
    monkeypatch.chdir("/")
    monkeypatch.setenv("TYRECAL_SOLVER_COMMAND", "another")
    assert worker.solver.command == whole  # type: ignore[attr-defined]


def test_an_adapters_own_program_is_found_too(here: Path) -> None:
    assert find_solver("calculix").command == [str(here / "bin" / "ccx")]  # type: ignore[attr-defined]


def test_a_settings_file_names_no_relative_path(here: Path) -> None:
    for command in ("./ccx", "bin/ccx -x", ["./ccx"]):
        with pytest.raises(InputError, match="must be a name or a whole path"):
            words(command, "settings.yaml", here=False)
    assert words("~/ccx", "settings.yaml", here=False) == [str(here / "home" / "ccx")]


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("no-such-ccx", "no folder of PATH holds the program 'no-such-ccx'"),
        ("./no-such-ccx", "there is no program '{here}/no-such-ccx'"),
        ("./plain", "'{here}/plain' is not executable"),
        ("./bin", "there is no program '{here}/bin'"),
    ],
)
def test_a_program_that_is_not_there(
    command: str, why: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The sentence states which program was sought, where, and what to do; no run folder is
    left."""
    (here / "plain").touch()
    options = ["--solver", "calculix", "--solver-command", command, "--output", "out"]
    assert run("modes", CASE, "--mesh", "coarse", *options) == 3
    assert capsys.readouterr().err == (
        f"error: solver 'calculix': {why.format(here=here)}; install it or give --solver-command"
        " PATH ('tyrecal solvers' shows what each starts)\n"
    )
    assert not list(here.glob("out/runs/*")) and not (here / "out" / "modes.json").exists()


def test_answers_of_another_program_are_not_taken_from_the_record(here: Path) -> None:
    """The file distinguishes two builds of the same version, its place does not."""
    (here / "run").mkdir()
    (here / "run" / "a.inp").write_text("a deck")

    def key(*command: str) -> str:
        solver = CalculiX()
        solver.command = list(command)
        return key_of(here / "run", solver)

    patched, same = here / "patched", here / "same"
    original = ccx(here / "there", here / "mark", "2.20")
    same.write_bytes(original.read_bytes())
    patched.write_text(original.read_text().replace("exit 7", "exit 8"))
    for program in (patched, same):
        program.chmod(0o755)
    assert key(str(original)) == key(str(same)) != key(str(patched))
    assert key(str(original), "-x") != key(str(original))
