"""``tyrecal init``: cases that validate, load, run, keep their comments; nothing written over."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from tyrecal.tyre.load import load_case
from tyrecal.tyre.resolve import resolved
from tyrecal.tyre.values import with_values

from ..conftest import CASES
from ..tyre.test_outline import curves, write_outline
from .test_cli import run

QUICK = ("--mesh", "coarse", "--quiet", "--no-store")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_case_from_a_size(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("init", "205/60r15 91V") == 0
    assert "outer diameter 627.0 mm, section width 208.6 mm" in capsys.readouterr().out
    names = {f"205_60r15.{e}" for e in ("yaml", "csv", "png")}
    assert {p.name for p in here.iterdir()} == names | {"case.schema.json"}
    assert (here / "205_60r15.png").read_bytes().startswith(b"\x89PNG")
    assert run("validate", "205_60r15.yaml") == 0
    text = (here / "205_60r15.yaml").read_text()
    assert text.count("#") > 20 and max(map(len, text.splitlines())) < 125
    yaml = YAML()
    yaml.preserve_quotes, yaml.width = True, 1000
    with (here / "again.yaml").open("w") as file:
        yaml.dump(yaml.load(text), file)
    assert _words(here / "again.yaml") == _words(here / "205_60r15.yaml")
    assert run("modes", "205_60r15.yaml", *QUICK) == 0
    modes = json.loads((here / "205_60r15" / "modes.json").read_text())["modes"]
    assert sum(m["multiplicity"] for m in modes if m["c"] < 4 or m["m"] == 0) == 16


def _words(path: Path) -> list[str]:
    """Lines are broken where either writer likes."""
    return path.read_text().replace(" null ", " ").split()  # as YAML also has it: nothing


@pytest.mark.slow
def test_fit_says_what_to_add_and_runs_when_it_is(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("init", "205/60R15", "--no-pictures", "--quiet") == 0
    assert run("fit", "205_60r15.yaml", *QUICK) == 2
    error = capsys.readouterr().err
    assert "no targets" in error and "targets: {modes:" in error and error.count("\n") == 1
    path = here / "205_60r15.yaml"
    before, mark, block = path.read_text().partition("# targets:\n")
    lines = (mark + block).splitlines()
    stop = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    uncommented = [line.removeprefix("# ") for line in lines[:stop]]
    path.write_text(before + "\n".join(uncommented + lines[stop:]) + "\n")
    assert run("fit", "205_60r15.yaml", *QUICK, "--no-pictures") == 0
    fit = json.loads((here / "205_60r15" / "fit.json").read_text())
    assert len(fit["modes"]) == 5 and fit["objective_unit"] == "sigma"
    assert fit["objective_Hz"] < 0.5 * fit["initial_objective_Hz"]


def test_gauges_that_the_engineer_knows(here: Path) -> None:
    options = [
        "--crown-mm",
        "15",
        "--sidewall-mm",
        "7",
        "--bead-mm",
        "14",
        "--belt-width-mm",
        "150",
    ]
    options += ["--rim-width-in", "6.5", "--pressure-kPa", "230", "--no-pictures", "--quiet"]
    assert run("init", "205/60R15", *options, "--output", "cases/mine.yaml") == 0
    case = load_case(here / "cases" / "mine.yaml")
    assert case.case.pressure_kPa == 230
    points = case.section.points
    thickness = np.hypot(*(points[-1] - points[0]).T)
    widest, rim = int(np.argmax(points[1, :, 1])), int(np.flatnonzero(case.section.rigid)[0])
    assert thickness[[0, widest, rim]] == pytest.approx([0.015, 0.007, 0.014], abs=1e-6)
    assert 2 * points[-1, :, 1].max() == pytest.approx(0.2086 + 0.2 * 0.0254, abs=1e-4)


def test_what_to_do_next_can_be_typed(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("init", "205/60R15", "--no-pictures", "--output", "my tyres/Größe 1.yaml") == 0
    (line,) = [x for x in capsys.readouterr().out.splitlines() if x.startswith("next: tyrecal ")]
    assert run(*shlex.split(line.removeprefix("next: tyrecal ")), *QUICK) == 0


def test_light_trucks_have_two_plies_of_carcass(here: Path) -> None:
    assert run("init", "31x10.50R15LT", "--no-pictures", "--quiet") == 0
    case = load_case(here / "31x10_50r15lt.yaml").case
    plies = ["carcass_1", "carcass_2", "carcass_1_turn_up", "carcass_2_turn_up"]
    assert case.variables["A_carcass"].sets == [f"rebar_layers.{ply}.area_m2" for ply in plies]
    assert case.pressure_kPa == 350


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["205/60D15"], "bias-ply"),
        (["nonsense"], "not a tyre size"),
        (["205/60R15", "--crown-mm", "90"], "usual is 3 to 50 mm"),
        (["205/60R15", "--crown-mm", "90", "--allow-unusual"], "crown must be between"),
        (["205/60R15", "--rim-width-in", "12"], "rim width must be between"),
        (["205/60R15", "--pressure-kPa", "3000"], "usual is 50 to 1200 kPa"),
        (["205/60R15", "--pressure-kPa", "-3", "--allow-unusual"], "pressure_kPa"),
        (["205/60R15", "--output", "case.txt"], "must name a case file"),
        (["--section", "own.csv", "--crown-mm", "12"], "--section"),
        ([], "give a SIZE"),
    ],
)
def test_one_sentence_and_nothing_written(
    arguments: list[str], words: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(CASES / "205_60r15.csv", here / "own.csv")
    assert run("init", *arguments) == 2
    error = capsys.readouterr().err
    assert words in error and "Traceback" not in error
    assert {p.name for p in here.iterdir()} == {"own.csv"}


@pytest.mark.slow
def test_no_file_is_written_over(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("205_60r15.yaml", "205_60r15.csv", "205_60r15.png"):
        (here / name).write_text("mine")
        assert run("init", "205/60R15") == 2
        assert f"'{name}' exists already" in capsys.readouterr().err
        assert [p.read_text() for p in here.iterdir()] == ["mine"]
        (here / name).unlink()
    (here / "205_60r15.yaml").write_text("mine")
    assert run("init", "205/60R15", "--force", "--no-pictures", "--quiet") == 0
    assert run("validate", "205_60r15.yaml") == 0


def test_a_station_table_gives_the_same_mesh(here: Path) -> None:
    shutil.copy(CASES / "205_60r15.csv", here / "own.csv")
    options = ["--section", "own.csv", "--no-pictures", "--quiet"]
    assert run("init", "205/60R15", *options, "--output", "mine.yaml") == 0
    mine, theirs = load_case(here / "mine.yaml"), load_case(CASES / "205_60r15.yaml")
    theirs = with_values(theirs, {"effects.carcass_turn_up": 0.0})
    assert mine.case.section.stations == "own.csv"
    one, other = resolved(mine).mesh, resolved(theirs).mesh
    assert (one.solids, one.cords, one.rim) == (other.solids, other.cords, other.rim)
    assert np.array(list(one.nodes.values())) == pytest.approx(
        np.array(list(other.nodes.values())), abs=1e-12
    )
    assert run("init", *options) == 0  # without a size, named by the file
    assert load_case(here / "own.yaml").case.name == "own"


def test_a_table_of_lines_with_other_names(here: Path) -> None:
    text = (CASES / "p235_75r17.csv").read_text()
    (here / "lines").mkdir()
    (here / "lines" / "scan.csv").write_text(text.replace("ply_", "body_").replace("crown", "top"))
    options = ["--section", "lines/scan.csv", "--no-pictures", "--quiet"]
    assert run("init", "P235/75R17", *options) == 0
    case = load_case(here / "p235_75r17.yaml").case
    assert (here / "scan.csv").exists() and case.rebar_layers["carcass"].line == "body"
    assert {"top", "bead"} < case.mesh.levels["default"].elements.keys()


@pytest.mark.slow
def test_an_outline(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_outline(here / "scan.csv", curves())
    options = ["--section", "scan.csv", "--belt-width-mm", "150", "--output", "mine.yaml"]
    assert run("init", "205/60R15", *options, "--quiet") == 0
    loaded = load_case(here / "mine.yaml")
    assert loaded.case.section.outline and loaded.case.section.outline.belt_width_m == 0.15
    assert run("modes", "mine.yaml", *QUICK) == 0
    # its numbers can be set, and the section follows
    wider = with_values(loaded, {"section.outline.belt_width_m": 0.16})
    edges = [np.nanmax(case.section.points[2, :, 1]) for case in (loaded, wider)]
    assert edges[1] - edges[0] == pytest.approx(0.005, rel=0.2)
    with pytest.raises(ValueError, match="the belt must be between"):
        with_values(loaded, {"section.outline.belt_width_m": 0.5})
    text = (here / "mine.yaml").read_text()
    for old, new, words in (
        ("belt_width_m: 0.15", "belt_width_m: 0.5", "the belt must be between"),
        ("belt_width_m: 0.15", "belt_width_m: wide", "must be a number"),
        ("file: scan.csv", "file: ../scan.csv", "inside the case's folder"),
        ("  outline:", "  stations: scan.csv\n  outline:", "must be absent with stations"),
    ):
        (here / "wrong.yaml").write_text(text.replace(old, new, 1))
        capsys.readouterr()
        assert run("validate", "wrong.yaml") == 2
        assert words in capsys.readouterr().err


def test_a_wrong_file_is_told_by_its_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = (CASES / "205_60r15.csv").read_text().splitlines()
    rows[7] = rows[7].replace(",0", ",maybe", 1).replace(",crown,", ",crown,x", 1)
    (here / "own.csv").write_text("\n".join(rows))
    assert run("init", "205/60R15", "--section", "own.csv") == 2
    error = capsys.readouterr().err
    assert error.startswith("error: own.csv, line 8: ") and error.count("\n") == 1
    assert [p.name for p in here.iterdir()] == ["own.csv"]
