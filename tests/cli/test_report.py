"""tyrecal report and --report: what they write, print and refuse."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tyrecal.simulate.evaluate import evaluator as door_module

from ..report.html import toy
from ..report.html.conftest import drawn_once as drawn_once
from ..studies.hertz import Hertz, coarser_case
from .test_cli import run


def timeless(page: Path) -> bytes:
    """The page without when its studies ran."""
    return re.sub(rb"\d{4}-\d\d-\d\d(( |%20)\d\d:\d\d( |%20)UTC)?", b"", page.read_bytes())


@pytest.mark.slow
def test_studies_write_it_and_the_command_writes_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fit, sweep and footprint of one folder on one page; by the command the same bytes."""
    case, out = str(coarser_case(tmp_path)), tmp_path / "out"
    options = ["--output", str(out), "--no-pictures", "--quiet"]
    fitted = ["--fitted", str(out / "fit.json")]
    assert run("fit", case, *options, "--report") in (0, 4)
    first = (out / "report.html").read_text()
    assert "P235/75R17 on an 8 inch rim" in first and "Shapes of the fitted tyre" in first
    assert run("sweep-pressure", case, *options, *fitted, "--steps", "2") == 0
    monkeypatch.setattr(door_module, "find_solver", lambda name, *command: Hertz())
    assert run("footprint", case, *options, *fitted, "--report", "--loads-N", "1000,4000") == 0
    page = timeless(out / "report.html")
    assert page.count(b"<svg ") > 4 and len(page) < 1_000_000
    (out / "report.html").unlink()
    assert capsys.readouterr().out == ""
    assert run("report", str(out)) == 0
    assert timeless(out / "report.html") == page
    assert f"{out}: fit, sweep-pressure, footprint" in capsys.readouterr().out


def test_modes_of_the_case_itself(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("modes", str(coarser_case(tmp_path)), "--output", str(out), "--report") == 0
    page = (out / "report.html").read_text()
    assert "Mode shapes" in page and "Not in it: results of fit" in page
    assert "[0,0]" in page and "Section" in page


@pytest.mark.slow
def test_several_folders(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folders = [str(toy.write(tmp_path / name, f"tyre {name}")) for name in ("one", "two")]
    page = tmp_path / "both.html"
    assert run("report", *folders, "--output", str(page), "--json") == 0
    printed = capsys.readouterr()
    summary = json.loads(printed.out)
    assert summary["bytes"] == page.stat().st_size and list(summary["found"]) == folders
    assert summary["found"][folders[0]][:2] == ["fit", "modes"] and str(page) in printed.err
    assert "tyre one and tyre two" in page.read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "Missing argument"),
        (["none"], "'none' does not exist"),
        (["file"], "'file' is a file; give a folder of results"),
        (["empty"], "'empty' holds no results of a study: fit, modes, sweep-pressure"),
        (["toy", "empty"], "'empty' holds no results"),
        (["batch"], "it is a folder of a batch: give the folders of the cases"),
        (["broken"], "'broken/fit.json' is damaged: it is no JSON"),
        (["toy", "--output", "file"], "'file' is not a page of tyrecal"),
        (["toy", "--output", "empty"], "'empty' is a folder; give a file"),
        (["toy", "--output", "nowhere/page.html"], "nowhere/page.html"),
    ],
)
def test_wrong_input(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    toy.write(Path("toy"))
    toy.write(Path("broken"))
    Path("broken/fit.json").write_text("{")
    Path("empty").mkdir()
    Path("batch").mkdir()
    Path("batch/batch.json").write_text("{}")
    Path("file").write_text("")
    assert run("report", *arguments) == 2
    printed = capsys.readouterr()
    assert words in printed.err and "Traceback" not in printed.err and printed.out == ""
    assert not list(tmp_path.glob("**/*.html"))


def test_damaged_results_beside_those_of_a_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The study's own results are written all the same."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "footprint.json").write_text("[1, 2")
    assert run("modes", str(coarser_case(tmp_path)), "--output", str(out), "--report") == 2
    assert "footprint.json' is damaged" in capsys.readouterr().err
    assert (out / "modes.json").exists() and not (out / "report.html").exists()


def test_the_command_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("report", "--help") == 0
    assert "tyrecal report p235_75r17" in capsys.readouterr().out
    for study in ("fit", "modes", "sweep-pressure", "footprint", "diagnose"):
        assert run(study, "--help") == 0
        assert "--report" in capsys.readouterr().out
