"""tyrecal doctor: what is there, what is missing, whether a known tyre comes out as recorded."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tyrecal.simulate.doctor import installation, self_check

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
