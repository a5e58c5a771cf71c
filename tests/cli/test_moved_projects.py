"""A project that is moved, copied or renamed keeps its results: commands answer as before."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tyrecal.simulate.case_folder import belongs_to, owner
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .test_cli import run

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
