"""Frequencies without labels on the command line: told, fitted, reported."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import Label, paired_labels
from tyrecal.studies.fit.targets import target_labels
from tyrecal.tyre.case import with_level
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .test_cli import run

Modes = dict[Label | None, float]
CASE = str(CASES / "p235_75r17.yaml")
TRUTH = {"A_belt": 2.6e-7, "A_carcass": 2.5e-7, "C10": 7e5}
MISSING = (Label(2, 1), Label(3, 1))
FOREIGN_Hz = 24.0


@pytest.fixture(scope="module")
def modes() -> Modes:
    """The coarse mesh's at TRUTH, less some, and a frequency that is no mode, rising."""
    case = with_level(load_case(CASE), "coarse")
    paired = paired_labels(Evaluator(TyreDesign(case)).evaluate(Question(TRUTH)).modes)
    wanted = [*target_labels(case)]
    hertz: Modes = {None: FOREIGN_Hz}
    for mode in sorted(paired, key=lambda mode: mode.frequency_Hz):
        if mode.label in wanted and mode.label not in MISSING:
            hertz[mode.label] = round(mode.frequency_Hz, 3)
    return hertz


@pytest.fixture(scope="module")
def unlabelled(modes: Modes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("unlabelled") / "unlabelled.csv"
    lines = [f"{f},{0.005 * f:.3f},240" for f in modes.values()]
    path.write_text("\n".join(["frequency_Hz,sigma_Hz,pressure_kPa", *lines]) + "\n")
    return path


@pytest.mark.slow
def test_a_fit_to_frequencies_without_labels(
    modes: Modes, unlabelled: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of the tyre are found and fitted; told in the terminal, the file and on the page."""
    given = [CASE, "--mesh", "coarse", "--output", str(tmp_path)]
    more = ["--measured", str(unlabelled), "--no-pictures", "--report"]
    assert run("fit", *given, *more) == 0
    shown = capsys.readouterr().out
    result = json.loads((tmp_path / "fit.json").read_text())
    assigned = {
        each["frequency_Hz"]: each["c"] is not None and Label(each["c"], each["m"], each["kind"])
        for each in result["labels"]["frequencies"]
    }
    assert assigned == {f: label or False for label, f in modes.items()}
    assert len(result["modes"]) == len(modes) - 1
    for name, truth in TRUTH.items():
        assert result["variables"][name]["value"] == pytest.approx(truth, rel=1e-3)
    words = "Labels of frequencies without a label"
    assert words in shown and words in (tmp_path / "report.html").read_text()

    fit = str(tmp_path / "fit.json")
    assert run("measured", "label", *given, str(unlabelled), "--fitted", fit, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "labels.json").read_text())
    assert [each["probability"] > 0.5 for each in printed["labels"]["frequencies"]] == [True] * len(
        modes
    )
    kept = read_measurements(tmp_path / "labelled.csv")
    assert {each.label: each.value for each in kept} == {k: v for k, v in modes.items() if k}


def test_labels_are_asked_for_where_they_are_needed(
    unlabelled: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Other commands and files that need labels are refused with the command that finds them;
    nothing is labelled twice."""
    labelled = ["--measured", str(CASES / "p235_75r17_wheeler.csv"), "--output", str(tmp_path)]
    for more in (["--repeats", str(unlabelled)], ["--toggled", str(unlabelled), "spindle_tilt=0"]):
        assert run("diagnose", CASE, *labelled, *more) == 2
        assert "tyrecal measured label" in capsys.readouterr().err
    other = str(CASES / "p235_75r17_wheeler.csv")
    assert run("measured", "label", CASE, other, "--output", str(tmp_path)) == 2
    assert "every frequency has a label" in capsys.readouterr().err
