"""tyrecal modes --load-N and --sweep-load: what they write, what they refuse, what they keep."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tyrecal.report.figure import save
from tyrecal.report.frequencies import draw_load_sweep
from tyrecal.studies.loaded_result import LoadRow, LoadSweep

from ..bundled import support
from ..studies.hertz import coarser_case
from .test_cli import CASE, run


@pytest.mark.slow
def test_one_load_the_record_and_a_load_out_of_reach(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """modes.json as the interface has it, the same bytes from the record; a sweep that ends early
    keeps the loads below."""
    case, out = str(coarser_case(tmp_path)), tmp_path / "out"
    arguments = ["modes", case, "--output", str(out), "--load-N", "300"]
    assert run(*arguments) == 0
    first = (out / "modes.json").read_bytes()
    result = json.loads(first)
    assert (result["load_N"], result["pressure_kPa"]) == (300, 240) and result["mass_kg"] > 10
    assert len(result["modes"]) == 10
    assert {mode["multiplicity"] for mode in result["modes"]} == {1}
    pitch = [m for m in result["modes"] if (m["c"], m["m"], m["symmetry"]) == (1, 1, "symmetric")]
    assert pitch[0]["frequency_Hz"] > pitch[0]["sliding_Hz"] + 10 and 0 < pitch[0]["grip_mm"] < 2
    assert "[1,1] symmetric at 300 N has" in result["findings"]["words"][0]
    assert "antisymmetric" in capsys.readouterr().out
    shapes = (out / "modes_shapes.json").read_bytes()
    assert run(*arguments, "--json", "--report") == 0
    assert json.loads(capsys.readouterr().out) == result
    assert (out / "modes.json").read_bytes() == first
    assert (out / "modes_shapes.json").read_bytes() == shapes
    assert "Mode shapes under 300 N" in (out / "report.html").read_text()
    facts = json.loads((out / "run.json").read_text())["modes"]
    assert (facts["solver_runs"], facts["answered_from_record"]) == (0, 3)  # the nominal tyre too
    sweep = ["modes", case, "--output", str(out), "--sweep-load", "0,300,300000", "--allow-unusual"]
    support.bears(monkeypatch, 1000.0)
    assert run(*sweep) == 3
    message = capsys.readouterr().err
    assert "error: initial, 300000 N: " in message and "mm down to the rim)" in message
    result = json.loads((out / "load_sweep.json").read_text())
    assert [row["load_N"] for row in result["rows"]] == [0, 300]
    assert result["failed"][0]["load_N"] == 300000
    lines = (out / "load_sweep.csv").read_text().splitlines()
    assert len(lines) == 1 + 2 * 10 and lines[0].startswith("design,load_N,deflection_m,c,m,kind")
    assert (out / "load_sweep.png").stat().st_size > 10000


def test_a_tyre_that_no_load_is_borne_by(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    support.bears(monkeypatch, 0.0)
    out = tmp_path / "out"
    arguments = ["modes", str(coarser_case(tmp_path)), "--output", str(out), "--load-N", "300000"]
    assert run(*arguments, "--allow-unusual") == 3
    printed = capsys.readouterr()
    assert "no equilibrium between 0 and" in printed.err and "Traceback" not in printed.err
    assert not (out / "modes.json").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--load-N", "0"], "--load-N 0: must be a load above 0"),
        (["--load-N", "-5"], "above 0"),
        (["--load-N", "nan"], "must be a number in N, as in 4000"),
        (["--sweep-load", "0"], "needs a load above 0"),
        (["--sweep-load", "1000,500"], "loads must rise"),
        (["--sweep-load", "500,0"], "above 0"),
        (["--sweep-load", "much"], "--sweep-load much: must be numbers in N"),
        (["--sweep-load", "500", "--load-N", "500"], "not both"),
        (["--load-N", "500", "--fitted", CASE], "is not the fit.json"),
        (["--load-N", "500", "--pictures"], "--pictures goes with"),
        (["--wheel", "held"], "--wheel goes with --load-N"),
        (["--load-N", "500", "--solver", "calculix"], "cannot find modes of a tyre on a road"),
    ],
)
def test_wrong_options(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("modes", CASE, "--output", str(out), *arguments) == 2
    printed = capsys.readouterr()
    assert words in printed.err and "Traceback" not in printed.err and printed.out == ""
    assert not out.exists()


def test_a_picture_of_both_designs(tmp_path: Path) -> None:
    """Overtones, one load only, members that are missing: drawn all the same."""
    mode = {
        "c": 2,
        "m": 0,
        "kind": None,
        "frequency_Hz": 80.0,
        "symmetry": "symmetric",
        "overlap": 1.0,
        "spanned": 1.0,
    }
    rows = [
        {"design": "initial", "load_N": 0.0, "deflection_m": 0.0, "modes": [mode]},
        {"design": "fitted", "load_N": 9.0, "deflection_m": 0.0, "modes": [mode, mode | {"m": 2}]},
    ]
    save(draw_load_sweep([LoadRow(**row) for row in rows]), tmp_path / "both.png")
    assert (tmp_path / "both.png").read_bytes()[:4] == b"\x89PNG"
    assert len(LoadSweep(rows=rows, failed=[], findings=[]).csv().splitlines()) == 4


def test_the_command_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("modes", "--help") == 0
    help_text = capsys.readouterr().out
    assert "--load-N" in help_text and "--sweep-load" in help_text and "--load-N 4000" in help_text
