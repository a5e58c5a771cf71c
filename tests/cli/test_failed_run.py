"""A run that fails leaves the results of an earlier one as they were, and says whose they are."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tyrecal.batch.case import Asked, CaseTask, run_case
from tyrecal.files import PREVIOUS, RESULTS
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.studies.pressure_range import PressureRange

from ..batch.support import vary
from ..conftest import CASES
from .test_cli import CASE, run


@pytest.fixture(autouse=True)
def _unable(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(evaluator: Evaluator, *question: object) -> None:
        raise EvaluationFailed("crashed", "the licence was eaten")

    monkeypatch.setattr(Evaluator, "evaluate", fails)
    monkeypatch.setattr(Evaluator, "press", fails)


def names(study: str) -> set[str]:
    """Files that a run of ``study`` may write, one of each kind."""
    return {name.replace("[0-9]*", "1").replace("*", "2") for name in RESULTS[study]}


def earlier(folder: Path, *studies: str) -> None:
    """Write the result files that runs of ``studies`` would have left."""
    folder.mkdir()
    for study in studies:
        for name in names(study):
            (folder / name).write_text("{}")


@pytest.mark.parametrize(
    ("study", "arguments"),
    [
        ("fit", ["fit", CASE]),
        ("modes", ["modes", CASE]),
        ("sweep-load", ["modes", CASE, "--sweep-load", "4000"]),
        ("sweep-pressure", ["sweep-pressure", CASE, "--steps", "2"]),
        ("footprint", ["footprint", CASE, "--loads-N", "4000"]),
    ],
)
def test_results_of_an_earlier_run_stay_and_are_told(
    study: str, arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    earlier(out, study, "diagnose")
    assert run(*arguments, "--output", str(out)) == 3
    left = {path.name for path in out.iterdir() if path.is_file()} - {".lock"}
    assert left == names("diagnose") | names(study) | {"run.json"}
    assert [path.name for path in out.iterdir() if path.is_dir()] == []
    assert all((out / name).read_text() == "{}" for name in names(study))
    assert json.loads((out / "run.json").read_text())[study]["finished"] is False
    words = f"results of '{study}' in '{out}' are those of an earlier run"
    assert words in capsys.readouterr().err
    for name in names("diagnose") | names(study):
        (out / name).unlink()
    assert run(*arguments, "--output", str(out)) == 3
    assert "earlier run" not in capsys.readouterr().err
    assert run("report", str(out)) == 2
    assert f"its last run, 'tyrecal {arguments[0]}', did not finish" in capsys.readouterr().err


@pytest.mark.parametrize("there", [True, False])
def test_results_of_an_earlier_run_in_a_batch(there: bool, tmp_path: Path) -> None:
    case = CASES / "p235_75r17.yaml" if there else tmp_path / "gone.yaml"
    out = tmp_path / "out"
    earlier(out, "modes", "fit")
    options = Asked(None, PressureRange(None, None, 2))
    report = run_case(CaseTask("a", case, out, ("modes",), options))
    assert report["studies"]["modes"]["status"] == "error"
    assert {path.name for path in out.iterdir()} == names("fit") | names("modes") | {"run.json"}
    assert json.loads((out / "run.json").read_text())["modes"]["finished"] is False


def test_results_of_a_run_that_is_done_take_the_place_of_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    earlier(out, "modes")
    monkeypatch.undo()
    assert run("modes", CASE, "--mesh", "coarse", "--no-pictures", "--output", str(out)) == 0
    assert json.loads((out / "modes.json").read_text())["modes"]
    assert {path.name for path in (out / PREVIOUS).iterdir()} == set(
        names("modes") - {"modes.json", "modes.csv", "modes_shapes.json"}
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("study", "more"),
    [
        ("fit", []),
        ("modes", ["--pictures"]),
        ("sweep-pressure", ["--steps", "2"]),
        ("footprint", ["--loads-N", "300"]),
    ],
)
def test_all_that_a_study_writes_is_known(
    study: str, more: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()
    case, out = vary(tmp_path / "case", 1)[0], tmp_path / "out"
    command = [study, str(case), *more, "--output", str(out)]
    for _ in range(2):  # again, and what was set aside is written again
        assert run(*command) == 0
        assert not (out / PREVIOUS).exists()
    files = {path for path in out.iterdir() if path.is_file()} - {out / "run.json", out / ".lock"}
    assert files == {file for pattern in RESULTS[study] for file in out.glob(pattern)}
    # over states, of unlabelled frequencies, with measured shapes
    other_fits = {"fit_states.csv", "fit_states.png", "fit_labels.csv", "fit_mac_*.png"}
    for pattern in {*RESULTS[study]} - other_fits:
        assert list(out.glob(pattern)) or "fitted" in pattern, pattern
