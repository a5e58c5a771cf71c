"""Mistakes as people type them: what is said, and that nothing is written.

Wrong cases through the command line: exit code 2, one sentence each, nothing written.
A slip of the hand is told what was probably meant, always in the same words.
"""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from tyrecal.studies.inference.check_units import far_off

from ..case import bad_cases
from ..conftest import CASES
from .test_cli import CASE, run

WHEELER = str(CASES / "p235_75r17_wheeler.csv")
MISTAKES = {  # what is typed: what is said
    "fit p235_75r17.yaml": "p235_75r17.yaml: there is no such file; did you mean 'cases/p235_",
    "fit case/p235_75r17.yaml": "no such file; did you mean 'cases/p235_75r17.yaml'?",
    "diagnose cases/p235_75r17.yaml --measured wheeler.csv": (
        "--measured wheeler.csv: there is no such file; did you mean 'cases/wheelers.csv'?"
    ),
    "diagnose CASE --measured WHEELER --effect rimwidth": (
        "--effect rimwidth: there is no such effect; did you mean 'rim_width'?"
    ),
    "diagnose CASE --measured WHEELER --without rimwidth": (
        "--without rimwidth: there is no such effect; did you mean 'rim_width'?"
    ),
    "diagnose CASE --measured WHEELER --toggled WHEELER rimwidth=0": (
        "'rimwidth=0': there is no effect 'rimwidth'; did you mean 'rim_width'?"
    ),
    "diagnose CASE --add rimwidth=0.005": "did you mean 'rim_width'?",
    "blind answer trials --effect rimwidth": "did you mean 'rim_width'?",
    "effects rimwidth": "there is no such effect; did you mean 'rim_width'?",
    "fit CASE --fix A_bolt": "--fix A_bolt: there is no such variable; did you mean 'A_belt'?",
    "modes CASE --solver bundeld": "is not installed; did you mean 'bundled'?",
    "modes CASE --set vibration_frequency_Hz=60": (
        "there is no 'vibration_frequency_Hz'; did you mean 'analysis.vibration_frequency_Hz'?"
    ),
    "modes CASE --set vibration_frequncy_Hz=60": "did you mean 'analysis.vibration_frequency_Hz'?",
    "modes CASE --set rim_width=0.005": "did you mean 'effects.rim_width'?",
    "modes CASE --set belt_1.angle_deg=68": "did you mean 'rebar_layers.belt_1.angle_deg'?",
    "modes CASE --set presure_kPa=200": "did you mean 'pressure_kPa'?",
    "modes CASE --set rim.holds=bead": (
        "rim.holds must be 'whole_bead' or 'bead_surface', got bead"
    ),
    "modes CASE --set rim.holds=null": "rim.holds must be 'whole_bead' or 'bead_surface', got null",
    "modes CASE --set pressure_kPa=null": "pressure_kPa must be a number, got null",
    "modes CASE --set C10=null": "C10 is null, must be a number",
    "modes CASE --set rim=null": "rim is not a number, it cannot be null",
    "modes CASE --set section.stations=null": (
        "section.stations is text, 'p235_75r17.csv'; --set takes numbers, true, false, null and"
        " words that the schema lists: edit line"
    ),
    "modes CASE --set name=other": "name is text",
    "validate minimal.yaml": "minimal.yaml, line 1: holds no tyre: write a case with",
    "modes minimal.yaml": "line 1: holds no tyre: write a case with 'tyrecal init SIZE'",
    "deck CASE --output full/x": "cannot write to 'full/x': Not a directory",
    "modes CASE --output full/x": "cannot write to 'full/x': Not a directory",
    "init 205/60R15 --output full/x.yaml": "cannot write to 'full': File exists",
    "measured import WHEELER --output full/x.csv": "cannot write to 'full/x.csv': Not a directory",
    "solvers --selftest abaqus --output full/x": "cannot write to 'full/x/plain': Not a directory",
    "batch CASE --output full/x": "cannot write to 'full/x': Not a directory",
    "store cases": "'cases': there is no evaluation store here (see",
    "store .": "'.': there is no evaluation store here; did you mean 'my'?",
    "deck CASE --loads-N 3000 --set road.loads_N.0=400": "road.loads_N.0=400: --loads-N give",
    "deck CASE --loads-N 100000 --output out": (
        "--loads-N 100000: usual is 100 to 34000 N, the load at which this tyre bottoms on its rim"
    ),
    "fit CASE --measured low.csv": (
        "low.csv, line 2: the pressure is 2.4 kPa: usual is 20 to 2000 kPa; did you mean 2.4 bar,"
        " 240 kPa?"
    ),
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The present folder, with cases in a folder, a file where a folder is meant, odd files."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cases").mkdir()
    for name in ("p235_75r17.yaml", "p235_75r17.csv"):
        shutil.copy(CASES / name, tmp_path / "cases")
    shutil.copy(WHEELER, tmp_path / "cases" / "wheelers.csv")
    (tmp_path / "full").touch()
    (tmp_path / "my" / "record").mkdir(parents=True)
    (tmp_path / "minimal.yaml").write_text("name: x\n")
    table = "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma\n"
    (tmp_path / "low.csv").write_text(f"{table}frequency_Hz,2,0,,,2.4,0,79.5,0.2\n")
    return tmp_path


@pytest.mark.parametrize("typed", MISTAKES)
def test_a_mistake(typed: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(here.rglob("*"))
    words = [{"CASE": CASE, "WHEELER": WHEELER}.get(word, word) for word in typed.split()]
    assert run(*words) == 2
    printed = capsys.readouterr()
    (line,) = printed.err.splitlines()
    assert line.startswith("error: ") and MISTAKES[typed] in line, line
    assert not printed.out and sorted(here.rglob("*")) == before


def test_a_target_ten_times_too_high_is_no_target(
    case_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = case_folder / "p235_75r17.yaml"
    path.write_text(path.read_text().replace("frequency_Hz: 79.5}", "frequency_Hz: 795}"))
    given = ["--mesh", "coarse", "--no-pictures", "--output", str(case_folder / "out")]
    assert run("fit", str(path), *given) == 2
    printed = capsys.readouterr()
    assert "[2,0] was measured at 795 Hz, 9 times the model's 88.77 Hz" in printed.err
    assert "mode and pressure, or did you mean 79.5 Hz?" in printed.err
    assert not printed.out and not (case_folder / "out" / "fit.json").exists()


def test_a_frequency_is_far_off_from_twice_the_models_on() -> None:
    assert not far_off("[2,0]", 199.0, 100.0) and not far_off("[2,0]", 51.0, 100.0)
    assert far_off("[2,0]", 201.0, 100.0).endswith("right unit, mode and pressure?")
    assert far_off("[2,0]", 9.1, 100.0).endswith("or did you mean 91 Hz?")


def test_numbers_that_are_set_are_listed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Path, value of the case, value used: on standard error, and not with --quiet."""
    given = ["C10=1.2e6", "A_belt=3e-7", "rim.free=true", "analysis.vibration_frequency_Hz=50"]
    options = [word for each in given for word in ("--set", each)]
    deck = ["deck", CASE, "--output", str(tmp_path / "out"), *options]
    assert run(*deck, "--json") == 0
    printed = capsys.readouterr()
    assert printed.err.splitlines() == [
        "--set: C10 (materials.rubber.C10_Pa) is 1e+06 in the case, 1.2e+06 here",
        "--set: A_belt (rebar_layers.belt_1.area_m2, rebar_layers.belt_2.area_m2) is 2.11868e-07 in"
        " the case, 3e-07 here",
        "--set: rim.free is false in the case, true here",
        "--set: analysis.vibration_frequency_Hz is null in the case, 50 here",
    ]
    assert "--set" not in printed.out
    assert run(*deck, "--quiet") == 0 and not capsys.readouterr().err


def snapshot(folder: Path) -> dict[str, bytes]:
    return {str(p): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


LARGE = {"many_values", "deep_nest"}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] * (name in LARGE))
        for name in sorted(bad_cases.BAD)
    ],
)
def test_a_wrong_case(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = bad_cases.write(name, tmp_path)
    before, here = snapshot(tmp_path), set(os.listdir())  # noqa: PTH208
    # one command for each case: all of them read it as any study does
    command = ("validate", "fit", "modes")[sorted(bad_cases.BAD).index(name) % 3]
    assert run(command, str(path)) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    lines = printed.err.splitlines()
    assert lines and all(line.startswith("error: ") for line in lines)
    assert "Traceback" not in printed.err
    assert snapshot(tmp_path) == before
    assert set(os.listdir()) == here  # noqa: PTH208


SLIPS = {  # what was typed: what is told
    "mode": "no command 'mode'; did you mean 'modes'?",
    "sweeep": "no command 'sweeep'; did you mean 'sweep'?",
    "pressure": "no command 'pressure'; did you mean 'sweep-pressure'?",
    "Diagnoze": "no command 'Diagnoze'; did you mean 'diagnose'?",
    "xyzzy": "no command 'xyzzy'; known: init, validate,",
    "modes --jbs 2 x.yaml": "no option '--jbs'; did you mean '--jobs'? (see 'tyrecal modes",
    "modes --xyzzy x.yaml": "no option '--xyzzy' (see 'tyrecal modes --help')\n",
    "modes": "Missing argument 'CASE'.",
    "modes nothere.yaml": "nothere.yaml: there is no such file\n",
    f"modes {CASES / 'p235_75r1.yaml'}": f"no such file; did you mean '{CASE}'?",
    f"validate {CASES / 'p235_75r17'}": f"no such file; did you mean '{CASE}'?",
    f"modes {CASES}": f"{CASES}: is a folder, must be a case file\n",
    f"sweep-pressure {CASE} --fitted nothere.json": "--fitted nothere.json: there is no such file",
    f"sweep-pressure {CASE} --fitted {CASES}": f"no fit.json in the folder '{CASES}'",
}


@pytest.mark.parametrize("typed", SLIPS)
def test_a_slip(
    typed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line that begins with "error: "."""
    monkeypatch.chdir(tmp_path)
    assert run(*typed.split()) == 2
    printed = capsys.readouterr()
    (message,) = printed.err.splitlines()
    assert message.startswith("error: ") and SLIPS[typed] in f"{message}\n"
    assert not printed.out
    assert not list(tmp_path.iterdir())


def test_a_long_folder_makes_no_two_names_alike(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neighbouring files are compared by their names alone, however much of the path is the
    same."""
    folder = tmp_path / ("a" * 60)
    (folder / "cases").mkdir(parents=True)
    (folder / ".pre-commit-config.yaml").write_text("repos: []\n")
    assert run("modes", f"{folder / 'cases'}") == 2
    assert (
        capsys.readouterr().err == f"error: {folder / 'cases'}: is a folder, must be a case file\n"
    )


@pytest.mark.parametrize("typed", [["help"], ["help", "fit"]])
def test_help_is_help(typed: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*typed) == 0
    help_text = capsys.readouterr().out
    assert run(*typed[1:], "--help") == 0
    assert capsys.readouterr().out.split() == help_text.split()


@pytest.mark.slow
def test_a_results_folder_is_no_case_but_its_fit_is_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`modes my` where my.yaml has results in the folder my; `--fitted my` is its fit.json."""
    monkeypatch.chdir(tmp_path)
    for name in ("p235_75r17.yaml", "p235_75r17.csv"):
        (tmp_path / name).write_bytes((CASES / name).read_bytes())
    assert run("fit", "p235_75r17.yaml", "--mesh", "coarse", "--no-pictures", "--quiet") == 0
    assert run("modes", "p235_75r17") == 2
    assert "is a folder, must be a case file; did you mean 'p235_75r17.yaml'?" in (
        capsys.readouterr().err
    )
    swept = ["--steps", "2", "--mesh", "coarse", "--no-pictures", "--json", "--no-store"]
    for fitted in ("p235_75r17", "p235_75r17/fit.json"):
        assert run("sweep-pressure", "p235_75r17.yaml", "--fitted", fitted, *swept) == 0
        rows = json.loads(capsys.readouterr().out)["rows"]
        assert {row["design"] for row in rows} == {"initial", "fitted"}
