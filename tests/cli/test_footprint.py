"""tyrecal footprint: what it writes, what it refuses, what it keeps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tyrecal.simulate.evaluate import evaluator as door_module

from ..conftest import ROOT
from ..studies.hertz import Hertz, coarse_case
from .test_cli import CASE, run
from .test_sweep_pressure import REFERENCE, fit_of

TWO = ["--loads-N", "1000,4000"]


@pytest.fixture
def hertz(monkeypatch: pytest.MonkeyPatch) -> type[Hertz]:
    """Footprints by a formula, for what is not the solver's business."""
    monkeypatch.setattr(door_module, "find_solver", lambda name, *command: Hertz())
    return Hertz


def result(out: Path) -> dict[str, Any]:
    return json.loads((out / "footprint.json").read_text())


@pytest.mark.slow
def test_both_designs(
    hertz: type[Hertz], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fit = fit_of(REFERENCE["p235_75r17"][1], tmp_path / "fit.json")
    out = tmp_path / "out"
    assert run("footprint", CASE, "--output", str(out), *TWO, "--fitted", fit) == 0
    footprints = result(out)
    assert [(row["design"], row["load_N"]) for row in footprints["rows"]] == [
        ("initial", 1000),
        ("initial", 4000),
        ("fitted", 1000),
        ("fitted", 4000),
    ]
    assert set(footprints["rows"][0]) == {
        "design",
        "load_N",
        "deflection_m",
        "area_m2",
        "length_m",
        "width_m",
        "mean_pressure_Pa",
        "peak_pressure_Pa",
        "vertical_stiffness_N_per_m",
    }
    assert {path.name for path in out.iterdir() if path.suffix} - {".lock"} == {
        "run.json",
        "footprint.json",
        "footprint_patches.json",
        "footprint.csv",
        "footprint.png",
        *(
            f"footprint_{name}{rest}"
            for name in ("initial", "fitted")
            for rest in (".png", "_1000N.vtu", "_4000N.vtu")
        ),
    }
    printed = capsys.readouterr()
    plan, progress = printed.err.splitlines()
    assert "2 designs x 1 state x 2 loads: 4 runs" in plan and progress == "footprint ..."
    assert "the fitted tyre's area is larger" in printed.out
    facts = json.loads((out / "run.json").read_text())["footprint"]
    assert (facts["command"], facts["solver_runs"]) == ("footprint", 2)


def test_json_record_and_pictures(
    hertz: type[Hertz], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["footprint", CASE, "--output", str(tmp_path), *TWO, "--no-pictures", "--json"]
    assert run(*arguments) == 0
    first = (tmp_path / "footprint.json").read_bytes()
    assert json.loads(capsys.readouterr().out) == json.loads(first)
    assert run(*arguments) == 0
    assert (tmp_path / "footprint.json").read_bytes() == first
    facts = json.loads((tmp_path / "run.json").read_text())["footprint"]
    assert (facts["solver_runs"], facts["answered_from_record"]) == (0, 1)
    assert not list(tmp_path.glob("*.png")) and not list(tmp_path.glob("*.vtu"))


@pytest.mark.slow
def test_which_designs_and_loads(hertz: type[Hertz], tmp_path: Path) -> None:
    """The case's own loads; the fit of the results folder where a comparison asks for it."""
    out = tmp_path / "out"
    out.mkdir()
    arguments = ["footprint", CASE, "--output", str(out), "--no-pictures", "--quiet"]
    assert run(*arguments) == 0
    loads = [500, 1000, 2000, 3000, 4000, 5000, 6000, 8000]
    assert [row["load_N"] for row in result(out)["rows"]] == loads
    fit_of(REFERENCE["p235_75r17"][1], out / "fit.json")
    for names in ("initial", "fitted", "fitted,initial"):
        assert run(*arguments, *TWO, "--compare", names) == 0
        assert list(result(out)["designs"]) == names.split(",")
    assert run(*arguments, *TWO, "--pressure-kPa", "200") == 0
    assert result(out)["pressure_kPa"] == {"initial": 200}


def test_a_load_out_of_reach_keeps_those_below(
    hertz: type[Hertz], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        run(
            "footprint",
            CASE,
            "--output",
            str(tmp_path),
            "--loads-N",
            "4000,30000,40000",
            "--allow-unusual",
        )
        == 3
    )
    printed, footprints = capsys.readouterr(), result(tmp_path)
    assert [row["load_N"] for row in footprints["rows"]] == [4000]
    (failed,) = footprints["failed"]
    assert (failed["load_N"], failed["cause"]) == (30000, "no_equilibrium")
    (kept,) = (tmp_path / "runs").iterdir()
    assert "error: initial, 30000 N: the rim is on the road" in printed.err
    assert str(kept) in printed.err and kept.name not in (tmp_path / "footprint.json").read_text()
    assert (tmp_path / "footprint_initial_4000N.vtu").exists()


def test_nothing_is_written_where_no_load_is_reached(
    hertz: type[Hertz], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("footprint", CASE, "--output", str(tmp_path), "--loads-N", "30000") == 3
    assert "initial, 30000 N: the rim is on the road" in capsys.readouterr().err
    assert not list(tmp_path.glob("footprint*"))


@pytest.mark.slow
def test_jobs_and_the_record_change_no_byte(tmp_path: Path) -> None:
    """The bundled solver, both designs."""
    case, out = str(coarse_case(tmp_path)), [tmp_path / "one", tmp_path / "two"]
    assert run("fit", case, "--output", str(out[0]), "--no-pictures", "--quiet") in (0, 4)
    arguments = [
        "footprint",
        case,
        "--fitted",
        str(out[0] / "fit.json"),
        "--loads-N",
        "3000",
        "--quiet",
        "--output",
    ]
    assert run(*arguments, str(out[0])) == 0
    assert run(*arguments, str(out[1]), "--jobs", "2") == 0
    names = sorted(path.name for path in out[1].glob("footprint*"))
    assert len(names) == 3 + 3 + 2
    assert all((out[0] / name).read_bytes() == (out[1] / name).read_bytes() for name in names)
    before = {name: (out[1] / name).read_bytes() for name in names}
    assert run(*arguments, str(out[1])) == 0
    assert {name: (out[1] / name).read_bytes() for name in names} == before
    facts = json.loads((out[1] / "run.json").read_text())["footprint"]
    assert (facts["solver_runs"], facts["answered_from_record"]) == (0, 2)
    initial, fitted = result(out[1])["rows"]
    assert initial["area_m2"] != fitted["area_m2"]
    assert 80e-4 < initial["area_m2"] < 140e-4


@pytest.mark.slow
def test_more_than_the_tyre_can_bear(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The bundled solver's sentence, and the load that it had reached."""
    out = tmp_path / "out"
    case = coarse_case(tmp_path)
    loads = ["--loads-N", "2000,200000", "--no-pictures", "--allow-unusual"]
    assert run("footprint", str(case), "--output", str(out), *loads) == 3
    assert [row["load_N"] for row in result(out)["rows"]] == [2000]
    message = capsys.readouterr().err
    assert "error: initial, 200000 N: " in message and "mm down to the rim)" in message


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--loads-N", "-500"], "above 0"),
        (["--loads-N", "0"], "above 0"),
        (["--loads-N", "nan"], "must be numbers in N"),
        (["--loads-N", "1000,inf"], "must be numbers in N"),
        (["--loads-N", "1000,500"], "500 after 1000, loads must rise"),
        (["--loads-N", "1000,1000"], "loads must rise"),
        (["--loads-N", "heavy"], "--loads-N heavy: must be numbers in N, as in 3000,5000"),
        (["--loads-N", "1000,"], "--loads-N 1000,: must be numbers"),
        (["--loads-N", ""], "must be numbers in N"),
        (["--compare", "initial,final"], "--compare final: there is no such design"),
        (["--compare", "initial,initial"], "twice"),
        (["--compare", "initial,fitted"], "there is no"),
        (["--fitted", "no_such.json"], "--fitted no_such.json: there is no such file"),
        (["--fitted", CASE], "not the fit.json"),
        (["--set", "road.friction=-1"], "at least 0"),
        (["--set", "road.element_angles_deg.0=-3"], "greater than 0"),
        (["--set", "A_bolt=1"], "A_belt"),
        (["--pressure-kPa", "nan"], "must be a number in kPa"),
        (["--mesh", "finest"], "refined"),
    ],
)
def test_wrong_options(
    arguments: list[str],
    words: str,
    hertz: type[Hertz],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    assert run("footprint", CASE, "--output", str(out), *arguments) == 2
    printed = capsys.readouterr()
    assert words in printed.err and "Traceback" not in printed.err and printed.out == ""
    assert not out.exists()


@pytest.mark.parametrize("solver", ["abaqus", "calculix"])
def test_solvers_without_a_road(
    solver: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("footprint", CASE, "--output", str(out), "--solver", solver) == 2
    message = capsys.readouterr().err
    assert (
        message.count("\n") == 1 and f"solver '{solver}' cannot press a tyre on a road" in message
    )
    assert not out.exists()


def test_the_decks_alone(hertz: type[Hertz], tmp_path: Path) -> None:
    assert run("deck", CASE, "--output", str(tmp_path), "--quiet", *TWO) == 0
    assert {path.name for path in tmp_path.glob("*.inp")} == {"inflate.inp", "press.inp"}
    assert "\n900002, 1, -4000\n" in (tmp_path / "press.inp").read_text()
    assert run("deck", CASE, "--output", str(tmp_path), "--loads-N", "2,1") == 2


def test_the_command_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("footprint", "--help") == 0
    assert "--loads-N" in capsys.readouterr().out
    assert "tyrecal footprint" in (ROOT / "README.md").read_text()
