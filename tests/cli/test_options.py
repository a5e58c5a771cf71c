"""Every option of every command: given twice, and with a value that cannot be.

Completion as it is typed: each shell on a terminal, the line that it makes of words and Tab.
"""

from __future__ import annotations

import fcntl
import os
import pty
import shutil
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click
import pytest

from ..conftest import CASES
from .test_cli import CASE, run
from .test_conventions import commands

COMMANDS = commands()
NUMBERS = click.types.FloatParamType | click.types.IntParamType


def values_of(kind: click.ParamType, folder: Path) -> list[str]:
    """Two values of a type; files and folders that must be there are in ``folder``."""
    if isinstance(kind, click.Choice):
        return [*map(str, kind.choices)]
    if isinstance(kind, NUMBERS):
        low = getattr(kind, "min", None) or 0
        half = low + (getattr(kind, "max", None) or low + 100) / 2
        return [
            f"{half:.0f}" if isinstance(kind, click.types.IntParamType) else f"{half:g}",
            f"{low + 1:g}",
        ]
    if isinstance(kind, click.Path) and kind.exists:
        for name in ("one", "two"):
            path = folder / name
            path.touch() if kind.file_okay else path.mkdir(exist_ok=True)
        return [str(folder / "one"), str(folder / "two")]
    return ["one", "two"]


def needed(command: click.Command, folder: Path) -> list[str]:
    """The arguments and options that a command requires, as words."""
    words = []
    for param in command.params:
        if param.required:
            words += [*param.opts[:1]] if isinstance(param, click.Option) else []
            words += values_of(param.type, folder)[:1]
    return words


@pytest.mark.parametrize("name", COMMANDS)
def test_given_twice(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With two values both act, or the command is refused and names both; one value is taken."""
    command = COMMANDS[name]
    others = needed(command, tmp_path)

    def parsed(*words: str) -> object:
        return command.make_context(name, [*others, *words]).params[option.name]

    for option in command.params:
        if not isinstance(option, click.Option):
            continue
        flag, opposite = option.opts[0], [*option.secondary_opts, option.opts[0]][0]
        values = [
            values_of(kind, tmp_path) for kind in getattr(option.type, "types", [option.type])
        ]
        one, two = ([] if option.is_flag else [pair[k] for pair in values] for k in (0, -1))
        again = parsed(flag, *one, flag, *one)
        if option.multiple:
            both = parsed(flag, *one, flag, *two)
            assert len(again) == len(both) == 2 and again[0] == again[1] == both[0] != both[1]
            continue
        assert again == parsed(flag, *one)
        if (flag, one) != (opposite, two):
            assert run(*name.split(), *others, flag, *one, opposite, *two) == 2, flag
            (line,) = capsys.readouterr().err.splitlines()
            assert all(word in line for word in (flag, opposite, *one, *two)), line


def impossible(kind: click.ParamType, folder: Path) -> tuple[str, str]:
    """A value that a type refuses, and words of what would be right; none where it takes all."""
    if isinstance(kind, click.Choice):
        return "something", f"must be {kind.choices[0]!s}"
    if isinstance(kind, NUMBERS):
        return "2,4", "must be a "
    if isinstance(kind, click.Path) and kind.exists:
        return "nothere", "there is no such fi" if kind.file_okay else "there is no such fo"
    if isinstance(kind, click.Path) and not kind.dir_okay:
        return str(folder), "is a folder, must be a file"
    if isinstance(kind, click.Path) and not kind.file_okay:
        return str(folder / "file"), "is a file, must be a folder"
    return "", ""


@pytest.mark.parametrize("name", COMMANDS)
def test_a_value_that_cannot_be(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each option answers it by what it must be, and no click's words remain."""
    (tmp_path / "file").touch()
    for option in COMMANDS[name].params:
        kinds = getattr(option.type, "types", [option.type])
        value, right = impossible(kinds[0], tmp_path)
        if not value or not isinstance(option, click.Option):
            continue
        words = [value, *["x"] * (len(kinds) - 1)]
        given = [*name.split(), *needed(COMMANDS[name], tmp_path), option.opts[0], *words]
        assert run(*given) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"error: {option.opts[0]} {value}: ") and right in line, line


NUMBERS_AND_WORDS = {
    "modes CASE --pressure-kPa 4kN": "must be a number in kPa, as in 240 or 2.4bar",
    "modes CASE --pressure-kPa nan": "must be a number in kPa, as in 240 or 2.4bar",
    "modes CASE --load-N 4bar": "must be a number in N, as in 4000 or 4kN",
    "modes CASE --jobs 0": "must be a whole number, 1 to 256, as in 1",
    "sample CASE --draws 2.5": "must be a whole number, 1000 to 10000000, as in 100000",
    "diagnose CASE --split-percent nan": "must be a number in percent, 0 to 20, as in 0.3",
    "plan CASE --pressure-kPa 0": "must be a number in kPa, above 0, as in 240 or 2.4bar",
    "init 205/60R15 --rim-width-in 7x": "must be a number in inches, above 0, as in 7.5 or 190mm",
    "store . --prune big": "must be a number in MB, 0 or more, as in 100",
    "modes CASE --wheel hold": "must be held or free-along-load; did you mean 'held'?",
    "modes CASE --sweep-load 1,2bar": "must be numbers in N, as in 3000,5000 or 3kN,5kN",
}


@pytest.mark.parametrize("typed", NUMBERS_AND_WORDS)
def test_what_a_value_must_be(typed: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = typed.replace("CASE", CASE).split()
    assert run(*words) == 2
    where = " ".join(words[-2:])
    assert f"error: {where}: {NUMBERS_AND_WORDS[typed]} (see" in capsys.readouterr().err


def test_a_whole_number_may_be_written_with_an_exponent() -> None:
    """As `tyrecal sample` itself writes how many draws are enough."""
    context = COMMANDS["sample"].make_context("sample", [CASE, "--draws", "2.4e+05"])
    assert context.params["draws"] == 240_000


@pytest.mark.parametrize(
    ("command", "flag", "name"),
    [
        ("sensitivities", "--by", "by"),
        ("sensitivities", "--of", "kinds"),
        ("fit", "--fix", "fix"),
        ("diagnose", "--effect", "effects"),
        ("diagnose", "--without", "without"),
    ],
)
def test_names_may_be_in_a_list_with_commas(command: str, flag: str, name: str) -> None:
    """Commas separate no part of a name; the option may be repeated, too."""
    words = [CASE, flag, "a.b.0,c", flag, " d ,"]
    assert COMMANDS[command].make_context(command, words).params[name] == ("a.b.0", "c", "d")


def test_settings_and_environment_are_not_the_second_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TYRECAL_STORE", "there")
    given = [CASE, "--jobs", "3", "--store", "here"]
    context = COMMANDS["modes"].make_context("modes", given, default_map={"jobs": 2})
    assert context.params["jobs"] == 3 and context.params["store"] == Path("here")


def test_store_and_no_store_exclude_each_other(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("modes", "none.yaml", "--store", "a", "--no-store") == 2
    assert "--store or --no-store, not both" in capsys.readouterr().err
    monkeypatch.setenv("TYRECAL_STORE", "there")
    assert run("modes", "none.yaml", "--no-store") == 2
    assert "no such file" in capsys.readouterr().err


def test_every_command_that_draws_offers_the_formats() -> None:
    """The same commands have --pictures and --figure-format."""
    from tyrecal.cli.main import cli

    def names(group: click.Group, flag: str) -> set[str]:
        context, offering = click.Context(group), set()
        for name in group.list_commands(context):
            each = group.get_command(context, name)
            assert each is not None
            offering |= names(each, flag) if isinstance(each, click.Group) else set()
            offering |= {name} if any(flag in option.opts for option in each.params) else set()
        return offering

    drawing = names(cli, "--pictures")
    assert {"fit", "modes", "diagnose", "init", "import"} <= drawing
    assert drawing == names(cli, "--figure-format")


def test_numbers_that_are_the_default_are_told() -> None:
    for name, command in commands().items():
        for each in command.params:
            if isinstance(each, click.Option) and type(each.default) in (int, float):
                assert each.show_default or "default" in str(each.help), (name, each.opts)


def test_pictures_are_drawn_unless_they_are_not_wanted() -> None:
    """`modes` alone draws on demand."""
    defaults = {
        name: parameter.default
        for name, command in commands().items()
        for parameter in command.params
        if parameter.name == "pictures"
    }
    assert "fit" in defaults and "init" in defaults
    assert {name for name, default in defaults.items() if not default} == {"modes"}


def test_a_picture_in_another_format(tmp_path: Path) -> None:
    target = tmp_path / "t.yaml"
    assert run("init", "205/60R15", "--output", str(target), "--figure-format", "svg") == 0
    assert {path.suffix for path in tmp_path.iterdir()} == {".yaml", ".csv", ".json", ".svg"}
    assert "carcass" in target.with_suffix(".svg").read_text()


def test_pictures_of_an_earlier_format_are_set_aside(tmp_path: Path) -> None:
    from tyrecal.files import results

    for name in ("convergence.svg", "fit_section.pdf", "fit_modes.svg", "footprint.svg"):
        (tmp_path / name).touch()
    stale = {path.name for path in results(tmp_path, "fit")}
    assert stale == {"convergence.svg", "fit_section.pdf", "fit_modes.svg"}


CTRL_T, CTRL_U = b"\x14", b"\x15"
START = {
    "bash": ["bash", "--norc", "--noprofile", "-i"],
    "zsh": ["zsh", "-f", "-i"],
    "fish": ["fish", "--no-config", "-i"],
}
SET_UP = {  # as the command's help says; and Ctrl-T writes the line to a file
    "bash": """eval "$(tyrecal completion bash)"; bind -x '"\\C-t": echo "$READLINE_LINE" >line'""",
    "zsh": 'autoload -Uz compinit; compinit -u -D; eval "$(tyrecal completion zsh)"; '
    'tell() { echo -E - "$BUFFER" >line }; zle -N tell; bindkey "^T" tell',
    "fish": "tyrecal completion fish | source; bind \\ct 'commandline >line'",
}
TYPED = {
    "tyrecal val": "tyrecal validate ",
    "tyrecal fit a": "tyrecal fit a,b.yaml ",
    "tyrecal fit deep": "tyrecal fit deep/case.yaml ",
    "tyrecal fit my": r"tyrecal fit my\ tyre.yaml ",
    'tyrecal fit "my t': 'tyrecal fit "my tyre.yaml" ',
    "tyrecal fit ./a": "tyrecal fit ./a,b.yaml ",
    "tyrecal fit a,b.yaml --solver b": "tyrecal fit a,b.yaml --solver bundled ",
    r"tyrecal modes my\ tyre.yaml --set A_b": r"tyrecal modes my\ tyre.yaml --set A_belt=",
    "tyrecal modes a,b.yaml --set A_belt=": "tyrecal modes a,b.yaml --set A_belt=",
    "tyrecal modes a,b.yaml --set rim.ref": "tyrecal modes a,b.yaml --set rim.reference_point_m.",
    "tyrecal effects bead_f": "tyrecal effects bead_filler ",
    "tyrecal report dee": "tyrecal report deep/",
}


@contextmanager
def terminal(shell: str, folder: Path) -> Iterator[int]:
    """The shell in the folder: the other end of its terminal."""
    ours, theirs = pty.openpty()
    there = {"HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "XDG_DATA_HOME": str(folder)}
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    process = subprocess.Popen(
        START[shell],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        cwd=folder,
        env={**os.environ, **there, "PATH": path, "TERM": "xterm"},
        start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )
    os.close(theirs)
    os.set_blocking(ours, False)
    try:
        yield ours
    finally:
        process.kill()
        process.wait()
        os.close(ours)


def words_after(end: int, keys: bytes, answer: Path) -> str:
    """Words that the shell writes to the file after these keys."""
    os.write(end, keys)
    output, until = b"", time.monotonic() + 60
    while not (answer.exists() and answer.read_bytes().endswith(b"\n")):
        assert time.monotonic() < until, output.decode(errors="replace")
        try:  # else the shell waits for its words to be read
            output += os.read(end, 65536)
        except BlockingIOError:
            time.sleep(0.01)
    text = answer.read_text().removesuffix("\n")
    answer.unlink()
    return text


@pytest.mark.slow
@pytest.mark.parametrize(
    "shell",
    [pytest.param(shell, marks=() if shell == "bash" else pytest.mark.slow) for shell in START],
)
def test_lines_are_completed(shell: str, tmp_path: Path) -> None:
    if not shutil.which(shell):
        pytest.skip(f"no {shell} here")
    (tmp_path / "deep").mkdir()
    for name in ("my tyre.yaml", "a,b.yaml", "deep/case.yaml"):
        shutil.copy(CASES / "p235_75r17.yaml", tmp_path / name)
    with terminal(shell, tmp_path) as end:
        assert words_after(end, f"{SET_UP[shell]}; echo up >up\n".encode(), tmp_path / "up") == "up"
        for typed, line in TYPED.items():
            keys = CTRL_U + typed.encode() + b"\t" + CTRL_T
            completed = words_after(end, keys, tmp_path / "line")
            assert completed in (line, f"{line} ")  # a space after NAME= of bash and zsh
