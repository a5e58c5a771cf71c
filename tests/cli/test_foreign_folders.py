"""A folder of results from a stranger: nothing outside it is written, deleted or read.

A project that is moved, copied or renamed keeps its results: commands answer as before.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tyrecal.cli.output import refuse_other
from tyrecal.files import NotAFile, atomic_write, read_bytes, write_text
from tyrecal.simulate.case_folder import belongs_to, owner
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .test_cli import CASE, run

MODES = ("modes", CASE, "--mesh", "coarse", "--no-pictures")
WORDS = "precious"


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of results of `modes`, with its record."""
    folder = tmp_path_factory.mktemp("finished") / "out"
    assert run(*MODES, "--output", str(folder)) == 0
    return folder


@pytest.fixture
def folder(finished: Path, tmp_path: Path) -> Path:
    """A copy of it, of the same case."""
    return Path(shutil.copytree(finished, tmp_path / "out"))


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """A place that must stay unchanged: a file, and a folder with names that tyrecal deletes in its
    own folders."""
    place = tmp_path / "elsewhere"
    (place / "run-xyz").mkdir(parents=True)
    for name in ("victim", "run-xyz/file", "modes.json"):
        (place / name).write_text(WORDS)
    return place


def contents(place: Path) -> dict[str, str]:
    return {str(p.relative_to(place)): p.read_text() for p in place.rglob("*") if p.is_file()}


def link(path: Path, target: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    path.symlink_to(target)


@pytest.mark.parametrize("name", [".report.html.partial", "report.html"])
def test_a_report_writes_through_no_link(name: str, folder: Path, elsewhere: Path) -> None:
    link(folder / name, elsewhere / "victim")
    run("report", str(folder))
    assert contents(elsewhere)["victim"] == WORDS
    assert name == "report.html" or not (folder / "report.html").is_symlink()


@pytest.mark.parametrize(
    ("name", "code"),
    [
        (".modes.json.partial", 0),
        (".run.json.partial", 0),
        ("modes.json", 0),
        ("run.json", 2),
        ("runs", 2),
        ("previous", 2),
        ("record", 2),
    ],
)
def test_a_study_follows_no_link(
    name: str, code: int, folder: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ours = name in ("runs", "previous", "record")
    link(folder / name, elsewhere if ours else elsewhere / "victim")
    before = contents(elsewhere)
    assert run(*MODES, "--output", str(folder)) == code
    assert contents(elsewhere) == before
    if code:
        assert f"{folder / name}' is a link" in capsys.readouterr().err


def test_the_folder_itself_may_be_a_link(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "linked").symlink_to(folder)
    (folder / "modes.json").unlink()
    assert run(*MODES, "--output", str(tmp_path / "linked")) == 0
    assert (folder / "modes.json").is_file()


def test_decks_are_written_through_no_link(tmp_path: Path, elsewhere: Path) -> None:
    out = tmp_path / "decks"
    out.mkdir()
    link(out / "modes.inp", elsewhere / "victim")
    assert run("deck", CASE, "--mesh", "coarse", "--output", str(out)) == 0
    assert contents(elsewhere)["victim"] == WORDS
    assert "*FREQUENCY" in (out / "modes.inp").read_text()


def test_a_batch_follows_no_link_to_a_cases_folder(
    tmp_path: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "batch"
    out.mkdir()
    link(out / Path(CASE).stem, elsewhere)
    before = contents(elsewhere)
    arguments = ("--mesh", "coarse", "--studies", "modes", "--output", str(out))
    assert run("batch", CASE, *arguments) == 2
    assert contents(elsewhere) == before and "is a link" in capsys.readouterr().err


SPECIAL: dict[str, Callable[[Path], Any]] = {
    "pipe": os.mkfifo,
    "endless": lambda path: path.symlink_to("/dev/zero"),
    "folder": Path.mkdir,
    "nested": lambda path: path.write_text("[" * 100_000),
    "huge": lambda path: (path.touch(), os.truncate(path, 10**12)),
}


@pytest.mark.parametrize("kind", SPECIAL)
@pytest.mark.parametrize("name", ["fit.json", "run.json", "fit_history.csv", "diagnosis.md"])
def test_a_report_reads_only_files(
    name: str, kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / name).unlink(missing_ok=True)
    SPECIAL[kind](folder / name)
    code = run("report", str(folder))
    if kind == "nested" and name != "fit.json":
        assert code == 0  # words, a table without a row, facts of no run
    else:
        assert code == 2 and str(folder / name) in capsys.readouterr().err


def test_a_report_tells_nothing_of_other_files(folder: Path, elsewhere: Path) -> None:
    link(folder / "diagnosis.md", elsewhere / "victim")
    assert run("report", str(folder)) == 2 and not (folder / "report.html").exists()


@pytest.mark.parametrize("kind", ["pipe", "endless", "folder"])
def test_the_facts_of_a_run_are_a_file(
    kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "run.json").unlink()
    SPECIAL[kind](folder / "run.json")
    assert run(*MODES, "--output", str(folder)) == 2
    assert str(folder / "run.json") in capsys.readouterr().err


@pytest.mark.parametrize("kind", SPECIAL)
@pytest.mark.parametrize(
    "command",
    [
        ("sweep-pressure", CASE, "--steps", "2", "--fitted"),
        ("diagnose", CASE, "--measured"),
        ("measured", "import"),
        ("init", "235/75R17", "--output", "case.yaml", "--section"),
    ],
    ids=lambda words: words[0],
)
def test_what_the_user_names_must_be_a_file(
    command: tuple[str, ...],
    kind: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    SPECIAL[kind](tmp_path / "given.csv")
    monkeypatch.chdir(tmp_path)
    assert run(*command, str(tmp_path / "given.csv")) == 2
    assert "given.csv" in capsys.readouterr().err


def test_another_cases_name_reaches_no_terminal_raw(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "run.json").write_text(json.dumps({"modes": {"case": "\x1b]0;title\x07\x1b[31m"}}))
    assert run(*MODES, "--output", str(folder)) == 2
    err = capsys.readouterr().err
    assert "title" in err and "\x1b]" not in err and "\x07" not in err


def test_whole_files_are_new_and_leftovers_go(tmp_path: Path, elsewhere: Path) -> None:
    path = tmp_path / "result.json"
    leftover = tmp_path / f".result.json.{'0' * 16}.partial"
    leftover.symlink_to(elsewhere / "victim")
    with atomic_write(path) as partial:
        assert partial.is_file() and not partial.is_symlink() and not leftover.is_symlink()
        partial.write_text("new")
    assert path.read_text() == "new" and contents(elsewhere)["victim"] == WORDS
    link(path, elsewhere / "victim")
    write_text(path, "newer")
    assert path.read_text() == "newer" and contents(elsewhere)["victim"] == WORDS


def test_reading_is_bounded(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"x" * 1000)
    assert len(read_bytes(tmp_path / "file", 1000)) == 1000
    with pytest.raises(NotAFile, match="is larger than"):
        read_bytes(tmp_path / "file", 999)
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "none")
    refuse_other(tmp_path, tmp_path / "any.yaml")  # no run.json, nothing to say


COARSE = ("--mesh", "coarse", "--no-pictures")
SWEEP = ("sweep-pressure", *COARSE, "--steps", "2", "--json")
COMMANDS = (  # none names a case
    SWEEP,
    (*SWEEP, "--from-kPa", "200"),
    (*SWEEP, "--set", "A_belt=3e-7"),
    (*SWEEP, "--fitted", "tyre"),
    (*SWEEP, "--fitted", "tyre/fit.json", "--output", "tyre"),
    (*SWEEP, "--fitted", "tyre", "--output", "sweeps/last"),
    ("footprint", *COARSE, "--loads-N", "300", "--json"),
    ("footprint", *COARSE, "--loads-N", "300", "--compare", "fitted", "--json"),
    ("store", "tyre", "--verify", "--json"),
    ("footprint", *COARSE, "--loads-N", "300", "--fitted", "tyre/fit.json", "--json"),
)
MOVES: dict[str, Callable[[Path, Path], object]] = {
    "copied": shutil.copytree,
    "renamed": lambda old, new: old.rename(old.with_name(new.name)),
    "moved": lambda old, new: (new.parent.mkdir(), shutil.move(old, new)),
}


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The present folder, with a case in a folder of its own."""
    folder = tmp_path / "project"
    (folder / "cases").mkdir(parents=True)
    shutil.copy(CASES / "p235_75r17.yaml", folder / "cases/tyre.yaml")
    shutil.copy(CASES / "p235_75r17.csv", folder / "cases")
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.slow
def test_ten_commands_without_a_case(
    project: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each after one of the moves: `test_another_case_stays_another_one` tries every move."""

    def answers(commands: tuple[tuple[str, ...], ...]) -> list[tuple[str, str]]:
        """Results and first note of each command."""
        texts = []
        for words in commands:
            assert run(*words) == 0, words
            printed = capsys.readouterr()
            texts.append((printed.out, printed.err.partition(";")[0]))
        return texts

    assert run("fit", "cases/tyre.yaml", *COARSE, "--quiet") == 0
    before = answers(COMMANDS)
    assert sum(note == "cases/tyre.yaml, with the fit in 'tyre'" for _, note in before) == 9
    for k, (name, move) in enumerate(MOVES.items()):
        place = project.parent / ("elsewhere/deep" if name == "moved" else name)
        move(project, place)
        project = place
        monkeypatch.chdir(place)
        assert answers(COMMANDS[k::3]) == before[k::3], name


def entries(folder: Path, *paths: Path) -> list[dict[str, str]]:
    """Entries in run.json of studies of these cases with their results in ``folder``."""
    folder.mkdir(exist_ok=True)
    return [owner(folder, path, load_case(path)) for path in paths]


def edited(case: Path, old: str, new: str) -> None:
    text = case.read_text()
    assert old in text
    case.write_text(text.replace(old, new))


@pytest.mark.parametrize("move", MOVES.values(), ids=MOVES)
def test_another_case_stays_another_one(
    move: Callable[[Path, Path], object], project: Path
) -> None:
    """A case of the same tyre is another one, too: its targets may differ."""
    case, other = project / "cases/tyre.yaml", project / "cases/other.yaml"
    shutil.copy(case, other)
    facts = entries(project / "tyre", case)
    move(project, project.parent / "new/project")
    here = next(path for path in project.parent.rglob("tyre") if path.is_dir())
    cases = here.parent / "cases"
    assert belongs_to(facts, here, cases / "tyre.yaml")
    assert not belongs_to(facts, here, cases / "other.yaml")


def test_where_no_case_is_at_its_place_the_tyre_decides(project: Path) -> None:
    case, folder = project / "cases/tyre.yaml", project / "tyre"
    facts = entries(folder, case)
    away = shutil.move(folder, project.parent / "away")
    renamed = case.rename(case.with_name("renamed.yaml"))
    assert belongs_to(facts, away, renamed)
    facts += entries(away, renamed)
    copy = Path(shutil.copy(renamed, case.with_name("copy.yaml")))
    assert belongs_to(facts, away, renamed) and not belongs_to(facts, away, copy)
    renamed.rename(case)
    assert belongs_to(facts, away, case) and belongs_to(facts, away, copy)
    edited(case, "angle_deg: 70", "angle_deg: 69")
    assert not belongs_to(facts, away, case)  # of the name, and another tyre


def test_an_edited_case_keeps_its_folder(project: Path) -> None:
    case, folder = project / "cases/tyre.yaml", project / "tyre"
    facts = entries(folder, case)
    edited(case, "angle_deg: 70", "angle_deg: 69")
    assert belongs_to(facts, folder, case)


def test_folders_of_an_older_tyrecal(project: Path) -> None:
    """Their entries have the case's whole path and no hash."""
    case = project / "cases/tyre.yaml"
    assert belongs_to([{"case": str(case)}], project / "tyre", case)
    moved = project.rename(project.with_name("moved"))
    assert belongs_to([{"case": str(case)}], moved / "tyre", moved / "cases/tyre.yaml")
    assert not belongs_to([{"case": str(case)}], moved / "tyre", CASES / "p235_75r17.yaml")


def test_a_batch_that_is_moved_goes_on(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("batch", "cases/tyre.yaml", "--studies", "modes", "--mesh", "coarse", "--output")
    assert run(*words, "nightly") == 0
    (project / "nightly").rename(project / "weekly")
    assert run(*words, "weekly") == 0
    facts = json.loads((project / "weekly/run.json").read_text())["batch"]["cases"]["tyre"]
    assert facts["answered"] is True
