"""tyrecal plan: files and words; its old name; what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tyrecal.studies.inference.effect_ranges import effect_ranges

from ..cli.test_cli import run
from ..cli.test_diagnose import coarse  # noqa: F401  the main case with a coarse mesh

EFFECTS = ["spindle_lateral", "cavity_air"]


@pytest.mark.slow
def test_a_plan_in_files_and_by_its_old_name(
    coarse: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    only = lambda case, evaluator, ids=None: effect_ranges(case, evaluator, EFFECTS)
    monkeypatch.setattr("tyrecal.studies.plan.laboratory.effect_ranges", only)
    out, store = tmp_path / "out", ["--store", str(tmp_path / "store")]
    given = ["--pressure-kPa", "160", "--pressure-kPa", "240", "--hours", "3", *store]
    assert run("plan", str(coarse), *given, "--sensors", "9", "--output", str(out), "--report") == 0
    plan = json.loads((out / "plan.json").read_text())
    assert {each["id"] for each in plan["effects"]} == {*EFFECTS}
    assert plan["steps"][-1]["total_hours"] <= 3 and len(plan["sensors"]) == 9
    for each in plan["effects"]:
        assert len(each["chance"]) == len(plan["steps"])
        assert each["largest_lambda"] >= 25 or each["named_from"] is None
    assert all(0 < v["after_percent"] < v["before_percent"] for v in plan["variables"])
    page = (out / "plan.md").read_text()
    assert all(step["what"] in page for step in plan["steps"]) and "## Sensors" in page
    assert 'id="plan"' in (out / "report.html").read_text() or (out / "plan_chances.png").exists()
    capsys.readouterr()
    old = tmp_path / "old"
    assert run("blind", "power", str(coarse), *given, "--output", str(old)) == 0
    assert "tyrecal plan" in capsys.readouterr().err
    assert not json.loads((old / "plan.json").read_text()).get("sensors")
    short = ["--hours", "0.5", *store, "--output", str(tmp_path / "short")]
    assert run("plan", str(coarse), *given[:4], *short) == 2
    assert "one set of functions takes 1 h" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--step-hours", "mounting=2"], "'mounting' is no step; did you mean 'mount'?"),
        (["--step-hours", "mount"], "must be STEP=HOURS"),
        (["--step-hours", "mount=-1"], "must be STEP=HOURS"),
    ],
)
def test_what_it_refuses(
    coarse: Path,  # noqa: F811
    tmp_path: Path,
    given: list[str],
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run("plan", str(coarse), "--output", str(tmp_path / "out"), *given) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out" / "plan.json").exists()
