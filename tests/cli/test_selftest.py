"""tyrecal solvers --selftest abaqus: what somebody with an ABAQUS runs for us."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest
from tyrecal_solvers.abaqus.check import findings
from tyrecal_solvers.bundled.job import run as solve
from tyrecal_solvers.language.text import read_keywords

from tyrecal.simulate.doctor.self_check import RECORDED_HZ

from .test_cli import run


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
