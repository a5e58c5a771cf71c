"""tyrecal doctor: what is there, what is missing, whether a known tyre comes out as recorded.

tyrecal solvers --selftest abaqus: what somebody with an ABAQUS runs for us.
"""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.bundled.job import run as solve
from tyrecal_solvers.language.text import read_keywords

from tyrecal.simulate.doctor import installation, self_check
from tyrecal.simulate.doctor.self_check import RECORDED_HZ

from .test_cli import run


def test_a_sound_installation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("doctor", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["ok"] and report["self_check"]["ok"] and report["self_check"]["seconds"] < 60
    assert {p["name"] for p in report["packages"]} >= {"numpy", "scipy", "click"}
    assert {s["name"] for s in report["solvers"]} >= {"abaqus", "bundled", "calculix"}
    assert report["machine"]["cores"] >= 1 and report["machine"]["memory_GB"] > 0.1
    assert report["records"] == []
    assert run("doctor") == 0
    assert "as recorded, within 0.1 %" in capsys.readouterr().out


def test_figures_that_are_not_the_recorded_ones(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(self_check.RECORDED_HZ, "[1,0]", 66.9)
    assert run("doctor", "--json") == 3
    printed = capsys.readouterr()
    assert "differ from the recorded ones" in printed.err
    (off,) = [m for m in json.loads(printed.out)["self_check"]["modes"] if m["label"] == "[1,0]"]
    assert off["deviation_percent"] == pytest.approx(100 * (66.7627 / 66.9 - 1), abs=1e-3)


def test_packages_that_are_missing_or_old(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    needs = ["numpy>=99", "no-such-package>=1", 'no-such-either>=2; extra == "more"']
    monkeypatch.setattr(installation, "requires", lambda name: needs)
    assert run("doctor") == 3
    printed = capsys.readouterr()
    assert "numpy must be >=99, it is " in printed.err
    assert "no-such-package must be >=1, it is not installed" in printed.err
    assert "missing no-such-either: pip install '.[more]' in a clone of tyrecal" in printed.out


def test_a_solver_that_does_not_answer(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("doctor", "--solver", "nastran") == 2
    assert "known: abaqus, bundled" in capsys.readouterr().err


def test_records_beside_results_and_shared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("modes", str(self_check.CASE), "--output", "mine", "--quiet") == 0
    assert run("doctor", "--json") == 0
    (record,) = json.loads(capsys.readouterr().out)["records"]
    assert (record["folder"], record["records"]) == ("mine/record", 1) and record["MB"] > 0
    assert run("doctor", "--json", "--store", "elsewhere") == 0
    (record,) = json.loads(capsys.readouterr().out)["records"]
    assert record["records"] == 0 and not Path("elsewhere").exists()


def test_pairs_of_decks_and_what_they_should_give(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The expected frequencies are of the decks as they are written, solved by themselves."""
    assert run("solvers", "--selftest", "abaqus", "--output", tmp_path, "--json") == 0
    paths = [Path(path) for path in json.loads(capsys.readouterr().out)]
    page = paths[0].read_text()
    for folder in ("plain", "angular"):
        assert {path.name for path in paths if path.parent == tmp_path / folder} == {
            *("inflate.inp", "modes.inp", "expected.csv")
        }
        first, second = (
            read_keywords((tmp_path / folder / f"{job}.inp").read_text())
            for job in ("inflate", "modes")
        )
        assert not findings(first) and not findings(second, first)
        layers = [k.get("GEOMETRY") for k in first if k.name == "REBAR LAYER"]
        assert ("ANGULAR" in layers) == (folder == "angular")
        rows = list(csv.DictReader((tmp_path / folder / "expected.csv").open()))
        solve(tmp_path / folder, "modes", "inflate")
        step = json.loads((tmp_path / folder / "modes.json").read_text())["steps"][-1]
        hertz = [mode["frequency_Hz"] for mode in step["modes"]]
        for row in rows:
            assert min(abs(float(row["frequency_Hz"]) / h - 1) for h in hertz) < 1e-5
            assert row["mode"].replace("axial", "lateral") in page
        if folder == "plain":
            frequencies = {row["mode"]: float(row["frequency_Hz"]) for row in rows}
            assert frequencies == {k: pytest.approx(v, rel=1e-4) for k, v in RECORDED_HZ.items()}
    for row in rows:  # of the angular layer by its readings; with one spacing it is the plain one
        mode = re.escape(row["mode"].replace("axial", "lateral"))
        line = re.findall(rf"^ *{mode} +([\d. ]+)", page, re.MULTILINE)[1]
        manual, one, radians, metres = map(float, line.split())
        assert manual == pytest.approx(float(row["frequency_Hz"]), abs=6e-4)
        assert one == pytest.approx(frequencies[row["mode"]], abs=6e-4)
        assert manual > 1.001 * one and one > 1.2 * radians > 1.2 * metres
