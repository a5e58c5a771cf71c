"""--dry-run of every study: it states how often the solver would run, and nothing is written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tyrecal.simulate.evaluate.evaluator import Evaluator

from ..conftest import CASES
from .test_cli import run
from .test_conventions import CASE, COARSE, commands

MEASURED = str(CASES / "p235_75r17_wheeler.csv")
STUDIES = {  # of each command with --dry-run: the words that a run needs
    "fit": ["fit", CASE],
    "modes": ["modes", CASE, "--load-N", "4000"],
    "sweep-pressure": ["sweep-pressure", CASE],
    "sweep": ["sweep", CASE, "--latin-hypercube", "7"],
    "footprint": ["footprint", CASE],
    "sensitivities": ["sensitivities", CASE, "--of", "contact_area", "--measured", MEASURED],
    "frf": ["frf", CASE],
    "stiffness": ["stiffness", CASE],
    "effects": ["effects", "--case", CASE],
    "sample": ["sample", CASE, "--measured", MEASURED],
    "diagnose": ["diagnose", CASE, "--measured", MEASURED],
    "plan": ["plan", CASE],
    "blind power": ["blind", "power", CASE],
    "measured sensors": ["measured", "sensors", CASE, "--place", "8"],
    "measured label": ["measured", "label", CASE, "unlabelled.csv"],
}
# whose number of runs does not depend on what they find
COUNTED = {
    "modes": ["modes", CASE, "--set", "pressure_kPa=200"],
    "sweep-pressure": ["sweep-pressure", CASE, "--steps", "3", "--no-pictures"],
    "sweep": ["sweep", CASE, "C10=9e5:1.1e6:3", "pressure_kPa=240:280:2", "--no-pictures"],
    "sensitivities": ["sensitivities", CASE, "--by", "C10,pressure_kPa", "--no-pictures"],
    "effects": ["effects", "rim_width", "--case", CASE, "--no-pictures"],
}


def test_every_study_has_it() -> None:
    with_option = {
        name
        for name, command in commands().items()
        if any("--dry-run" in param.opts for param in command.params)
    }
    assert with_option == {*STUDIES}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name, marks=[pytest.mark.slow] * (name in ("sample", "diagnose", "blind power"))
        )
        for name in STUDIES
    ],
)
def test_it_states_runs_and_time_and_does_nothing(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither the solver runs nor does the folder, or the one for results, get any file."""
    monkeypatch.chdir(tmp_path)
    table = tmp_path / "unlabelled.csv"
    table.write_text("label,frequency_Hz,sigma_Hz,pressure_kPa,load_N,rim\n,66.1,0.3,240,0,\n")
    for way in ("evaluate", "press"):
        monkeypatch.setattr(Evaluator, way, lambda *_: pytest.fail("the solver runs"))
    assert run(*STUDIES[name], *COARSE, "--dry-run", "--json") == 0
    plan = json.loads(capsys.readouterr().out)
    assert plan["runs"] > 0 and plan["seconds"] > 0
    assert run(*STUDIES[name], *COARSE, "--dry-run") == 0
    printed = capsys.readouterr().out
    assert f"{plan['runs']} run" in printed and "in the solver" in printed
    assert [*tmp_path.iterdir()] == [table]


@pytest.mark.slow
@pytest.mark.parametrize("name", COUNTED)
def test_as_many_runs_as_it_states(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [*COUNTED[name], *COARSE, "--output", str(tmp_path / "out")]
    assert run(*words, "--dry-run", "--json") == 0
    stated = json.loads(capsys.readouterr().out)["runs"]
    assert run(*words, "--quiet") == 0
    (entry,) = json.loads((tmp_path / "out/run.json").read_text()).values()
    assert entry["solver_runs"] == stated
