"""Bare `tyrecal sweep-pressure` and `tyrecal footprint`: the last fit here, or the only case."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import click
import pytest

from tyrecal.cli.default_case import default_case
from tyrecal.cli.options import Study
from tyrecal.cli.terminal import Terminal
from tyrecal.simulate.case_folder import owner
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .test_cli import run

STUDY = Study(Terminal())


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("p235_75r17.yaml", "p235_75r17.csv"):
        shutil.copy(CASES / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def fit(folder: Path, case: Path, started: str, good: bool = True) -> None:
    """Write the traces of a fit: its entry in run.json, and whether it converged."""
    folder.mkdir(exist_ok=True)
    loaded = load_case(case) if case.exists() else None
    entry = {**owner(folder, case, loaded), "command": "fit", "started": started, "finished": True}
    (folder / "run.json").write_text(json.dumps({"fit": entry}))
    (folder / "fit.json").write_text(json.dumps({"converged": good, "moved": good}))


def test_the_only_case_is_taken_and_named(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "jobs.yaml").write_text("queue: long\n")  # no case
    assert default_case(None, STUDY) == (Path("p235_75r17.yaml"), STUDY)
    assert capsys.readouterr().err == "p235_75r17.yaml, the only case here\n"


def test_several_cases_or_none_are_refused_with_a_list(here: Path) -> None:
    shutil.copy(here / "p235_75r17.yaml", here / "b.yaml")
    with pytest.raises(click.UsageError, match=r"several here: b\.yaml, p235_75r17\.yaml"):
        default_case(None, STUDY)
    for path in here.glob("*.yaml"):
        path.unlink()
    with pytest.raises(click.UsageError, match="no fit and no case here"):
        default_case(None, STUDY)


def test_the_last_fit_that_converged_is_taken_with_its_case(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = here / "b.yaml"
    shutil.copy(here / "p235_75r17.yaml", other)
    fit(here / "old", other, "2026-01-01T10:00:00+00:00")
    fit(here / "new", here / "p235_75r17.yaml", "2026-01-02T10:00:00+00:00")
    fit(here / "failed", other, "2026-01-03T10:00:00+00:00", good=False)
    fit(here / "gone", here / "none.yaml", "2026-01-03T10:00:00+00:00")
    case, study = default_case(None, STUDY)
    assert (case, study.fitted) == (Path("p235_75r17.yaml"), Path("new/fit.json"))
    assert study.output == Path("new")
    notes = capsys.readouterr().err
    assert "p235_75r17.yaml, with the fit in 'new'" in notes
    assert "failed" not in notes and "gone" not in notes
    old = replace(STUDY, fitted=Path("old/fit.json"))
    assert default_case(None, old) == (Path("b.yaml"), replace(old, output=Path("old")))
    assert default_case(other, STUDY) == (other, STUDY)


def test_a_fit_whose_case_is_not_at_its_place_needs_the_case(here: Path) -> None:
    fit(here / "results", here / "none.yaml", "2026-01-01T10:00:00+00:00")
    with pytest.raises(click.UsageError, match="the case of 'results' is not at its place"):
        default_case(None, replace(STUDY, fitted=Path("results")))


def test_a_case_of_an_own_deck_is_one(here: Path) -> None:
    (here / "p235_75r17.yaml").unlink()
    shutil.copytree(CASES / "ring_3d", here, dirs_exist_ok=True)
    assert default_case(None, STUDY)[0] == Path("ring.yaml")


@pytest.mark.slow
def test_the_users_card(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """fit, then the studies without a word more; both designs, in the fit's folder."""
    coarse = ["--mesh", "coarse", "--no-pictures"]
    assert run("fit", "p235_75r17.yaml", *coarse) == 0
    assert run("sweep-pressure", *coarse, "--steps", "2") == 0
    assert run("footprint", *coarse, "--loads-N", "300") == 0
    assert capsys.readouterr().err.count("p235_75r17.yaml, with the fit in 'p235_75r17'") == 2
    for name in ("pressure_sweep.json", "footprint.json"):
        rows = json.loads((here / "p235_75r17" / name).read_text())["rows"]
        assert {row["design"] for row in rows} == {"initial", "fitted"}
