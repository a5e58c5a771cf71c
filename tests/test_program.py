"""Programs of solvers: the one that the user names runs, by settings and command lines."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from tyrecal_solvers.calculix.adapter import CalculiX

from tyrecal.errors import InputError
from tyrecal.simulate import settings
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import solver
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.solver import find_solver, installed
from tyrecal.simulate.evaluate.store import key_of
from tyrecal.simulate.program import join_command, split_command
from tyrecal.simulate.settings import command_of, place, root, words
from tyrecal.tyre.load import load_case

from .cli.test_cli import CASE, run
from .conftest import CASES

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


@pytest.mark.parametrize(
    ("started_by", "wanted"),
    [
        (([], ""), ("ccx", "default")),
        ((["ccx_2.21", "-i"], "settings.toml"), (["ccx_2.21", "-i"], "settings.toml")),
    ],
)
def test_a_command_and_who_set_it(
    started_by: tuple[list[str], str], wanted: tuple[object, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(solver, "command_of", lambda name: started_by)
    monkeypatch.setenv("PATH", "")  # whether ccx is installed here must not matter
    facts = {each["name"]: each for each in solver.installed()}
    calculix, bundled = facts["calculix"], facts["bundled"]
    command = calculix["command"]
    assert calculix["command_from"] == wanted[1]
    assert command == wanted[0] or Path(command[0]).name == wanted[0]
    assert bundled["command"] is None and bundled["command_from"] is None
    assert bundled["problem"] is None and "modes" in bundled["capabilities"]


def test_a_broken_solver_is_named_where_it_is_used_and_listed_with_its_problem(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The solver's module lacks it, or it cannot be made."""
    bundled = EntryPoint("bundled", "tyrecal_solvers.bundled.adapter:Bundled", solver.GROUP)
    entries = [
        bundled,
        EntryPoint("absent", "tyrecal.version:Absent", solver.GROUP),
        EntryPoint("odd", "builtins:bytearray.fromhex", solver.GROUP),
    ]
    monkeypatch.setattr(solver, "entry_points", lambda group: entries)
    problems = {each["name"]: each["problem"] for each in solver.installed()}
    assert problems.pop("bundled") is None
    for name, problem in problems.items():
        assert f"solver '{name}' of '" in problem and "cannot be loaded (" in problem
        with pytest.raises(InputError, match=f"solver '{name}' of .* cannot be loaded"):
            solver.find_solver(name)
    assert solver.find_solver("bundled").name == "bundled"


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
