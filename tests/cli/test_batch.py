"""tyrecal batch: one bad case costs itself only; interrupted, resumed, compared, the same bytes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import xmlschema

from tyrecal.batch.run import names_of
from tyrecal.cli import progress
from tyrecal.cli.progress import seconds_left
from tyrecal.studies import STUDIES, result_types
from tyrecal.studies.result import Result

from ..batch.support import (
    entry,
    few_effects,
    measured_elsewhere,
    nearly_certain,
    poison,
    report,
    vary,
)
from ..conftest import ROOT
from .test_after_a_good_fit import contents, unmoved
from .test_cli import run

SCHEMA = xmlschema.XMLSchema(ROOT / "tests/data/junit.xsd")
SWEEP = ["--from-kPa", "180", "--to-kPa", "240", "--steps", "2"]


def batched(cases: list[Path], out: Path, *arguments: str) -> int:
    return run("batch", *map(str, cases), "--output", str(out), *arguments)


def result(out: Path) -> dict[str, Any]:
    return json.loads((out / "batch.json").read_text())


def facts(out: Path, name: str) -> dict[str, Any]:
    return json.loads((out / "run.json").read_text())["batch"]["cases"][name]


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Three tyres; the second cannot stand."""
    paths = vary(tmp_path_factory.mktemp("cases"), 3)
    poison(paths[1])
    return paths


@pytest.fixture(scope="module")
def done(cases: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All studies but the footprint, and a baseline."""
    out = tmp_path_factory.mktemp("done")
    baseline = ["--baseline", str(out / "baseline.json"), "--write-baseline"]
    options = ["--studies", "sweep-pressure,fit,modes", "--junit", str(out / "junit.xml"), *SWEEP]
    assert batched(cases, out, *options, *baseline) == 5
    return out


@pytest.mark.slow
def test_a_poisoned_case_costs_itself_only(done: Path) -> None:
    report = result(done)
    assert report["counts"] == {"cases": 3, "error": 1, "failed": 0, "drifted": 0, "good": 2}
    assert report["studies"] == ["fit", "modes", "sweep-pressure"]
    bad = report["cases"][1]
    assert bad["name"] == "tyre_01" and bad["verdict"] == "error"
    assert bad["studies"]["fit"]["cause"] == "unstable"
    assert "not positive definite" in bad["studies"]["fit"]["words"]
    assert bad["studies"]["sweep-pressure"]["status"] == "skipped"
    SCHEMA.validate(str(done / "junit.xml"))
    assert set(json.loads((done / "baseline.json").read_text())["cases"]) == {"tyre_00", "tyre_02"}


def test_each_case_has_the_results_of_the_commands(
    done: Path, cases: list[Path], tmp_path: Path
) -> None:
    own = ["--output", str(tmp_path), "--no-pictures", "--quiet", "--store", str(done / "record")]
    assert run("fit", str(cases[0]), *own) == 0
    assert run("modes", str(cases[0]), *own) == 0
    fitted = ["--fitted", str(tmp_path / "fit.json")]
    assert run("sweep-pressure", str(cases[0]), *own, *fitted, *SWEEP) == 0
    for file in (
        "fit.json",
        "fit.csv",
        "fit_history.csv",
        "modes.json",
        "pressure_sweep.json",
        "pressure_sweep.csv",
    ):
        assert (done / "tyre_00" / file).read_bytes() == (tmp_path / file).read_bytes(), file
    assert run("modes", str(cases[0]), "--output", str(done / "tyre_00"), "--quiet") == 0  # its own


@pytest.mark.slow
def test_a_batch_samples_as_the_command_does(tmp_path: Path) -> None:
    case = nearly_certain(*vary(tmp_path / "cases", 1))
    out, own = tmp_path / "out", tmp_path / "own"
    expected = {0: 0, 5: 4}  # good, or in doubt: a box that could not grow
    status = batched([case], out, "--studies", "sample")
    options = ["--output", str(own), "--no-pictures", "--quiet", "--store", str(out / "record")]
    assert run("sample", str(case), *options) == expected[status]
    for file in ("sample.json", "sample.csv", "sample_draws.csv"):
        assert (out / case.stem / file).read_bytes() == (own / file).read_bytes(), file
    numbers = result(out)["cases"][0]["studies"]["sample"]["quantities"]
    sample = json.loads((own / "sample.json").read_text())
    assert numbers["median C10"] == sample["variables"]["C10"]["median"]
    (row,) = [r for r in sample["predicted"] if r["c"] == 4 and r["m"] and r["pressure_kPa"] == 240]
    assert numbers["predicted_Hz 240 kPa [4,1]"] == row["frequency_Hz"]


def test_a_batch_fits_to_the_file_that_a_case_names(tmp_path: Path) -> None:
    """As the command does with --measured; again where the file has changed; what needs such a file
    says so of a case without one."""
    case, other = vary(tmp_path / "cases", 2)
    other.write_text(case.read_text())
    file, out, own = measured_elsewhere(case), tmp_path / "out", tmp_path / "own"
    assert batched([case], out, "--studies", "fit") == 0
    given = ["--measured", str(file), "--output", str(own), "--store", str(out / "record")]
    assert run("fit", str(other), *given, "--no-pictures", "--quiet") == 0
    assert (out / case.stem / "fit.json").read_bytes() == (own / "fit.json").read_bytes()
    before = json.loads((own / "fit.json").read_text())
    assert before["provenance"]["targets"] == file.name and before["objective_unit"] == "sigma"
    file.write_text(file.read_text().replace("31.7", "32.7"))
    assert batched([case], out, "--studies", "fit") == 0
    after = result(out)["cases"][0]["studies"]["fit"]["quantities"]["objective"]
    assert after != before["objective_Hz"]
    assert batched([other], tmp_path / "lacking", "--studies", "diagnose") == 5
    lacking = result(tmp_path / "lacking")["cases"][0]["studies"]["diagnose"]
    assert (lacking["status"], lacking["cause"]) == ("error", "input")
    assert "targets: {file: measured.csv}" in lacking["words"]


@pytest.mark.slow
def test_a_batch_diagnoses_as_the_command_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With three effects of the catalogue."""
    case = nearly_certain(*vary(tmp_path / "cases", 1))
    measured_elsewhere(case)
    few_effects(monkeypatch)
    out, own = tmp_path / "out", tmp_path / "own"
    options = ["--studies", "diagnose", "--baseline", str(tmp_path / "b.json"), "--write-baseline"]
    assert batched([case], out, *options, "--junit", str(out / "junit.xml")) == 0
    command = ["--output", str(own), "--no-pictures", "--quiet", "--store", str(out / "record")]
    assert run("diagnose", str(case), *command) == 0  # the case names what was measured
    for file in ("diagnosis.json", "diagnosis.md", "diagnosis_section.json"):
        assert (out / case.stem / file).read_bytes() == (own / file).read_bytes(), file
    diagnosis = json.loads((own / "diagnosis.json").read_text())
    (entry,) = result(out)["cases"][0]["studies"].values()
    assert (entry["verdict"], entry["effect"]) == (diagnosis["verdict"], diagnosis["effect"])
    assert entry["quantities"]["gap_rms_percent"] == diagnosis["gap"]["rms_percent"]
    assert entry["quantities"]["probability none"] == diagnosis["probabilities"]["none"]
    value = diagnosis["calibrated"]["without"]["C10"]["value"]
    assert entry["quantities"]["calibrated C10"] == value
    SCHEMA.validate(str(out / "junit.xml"))
    assert (
        f"diagnose: {diagnosis['verdict']}: {diagnosis['words']}" in (out / "junit.xml").read_text()
    )


def test_the_numbers_are_those_of_the_files(done: Path) -> None:
    numbers = result(done)["cases"][0]["studies"]
    fit = json.loads((done / "tyre_00/fit.json").read_text())
    assert numbers["fit"]["quantities"]["objective"] == fit["objective_Hz"]
    assert numbers["fit"]["quantities"]["variable C10"] == fit["variables"]["C10"]["value"]
    mode = fit["modes"][4]
    name = f"fitted_Hz [{mode['c']},{mode['m']}]"
    assert numbers["fit"]["quantities"][name] == mode["fitted_Hz"]
    sweep = json.loads((done / "tyre_00/pressure_sweep.json").read_text())
    row = sweep["rows"][-1]
    mode = next(m for m in row["modes"] if (m["c"], m["m"]) == (2, 0))
    assert (
        numbers["sweep-pressure"]["quantities"]["frequency_Hz fitted 240 kPa [2,0]"]
        == (mode["frequency_Hz"])
    )


def test_again_it_is_answered_and_says_the_same_with_other_jobs(
    done: Path, cases: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--studies", "fit,modes,sweep-pressure", *SWEEP]
    before = (done / "batch.json").read_bytes()
    assert batched(list(reversed(cases)), done, *options) == 5
    assert (done / "batch.json").read_bytes() == before
    assert all(facts(done, f"tyre_0{i}")["answered"] for i in range(3))
    capsys.readouterr()
    elsewhere = ["--store", str(done / "record"), "--jobs", "2"]
    assert batched(cases, tmp_path, *options, *elsewhere, "--json", "--quiet") == 5
    assert (tmp_path / "batch.json").read_bytes() == before
    assert facts(tmp_path, "tyre_00")["solver_runs"] == 0
    assert facts(tmp_path, "tyre_00")["answered_from_record"] > 0
    assert json.loads(capsys.readouterr().out) == json.loads(before)


@pytest.mark.slow
def test_what_changed_is_studied_again(tmp_path: Path) -> None:
    (case,) = vary(tmp_path / "c", 1)
    out = tmp_path / "out"
    modes = ["--studies", "modes", "--quiet"]
    assert batched([case], out, *modes) == 0
    assert batched([case], out, *modes, "--mesh", "coarse") == 0  # the same by another name
    run_facts = facts(out, "tyre_00")
    assert (run_facts["solver_runs"], run_facts["answered_from_record"]) == (0, 1)
    case.write_text(case.read_text().replace("pressure_kPa: 240.0", "pressure_kPa: 210.0"))
    assert batched([case], out, *modes) == 0
    assert facts(out, "tyre_00")["solver_runs"] == 1
    (out / "tyre_00/modes.json").write_text("{}")  # somebody's hand in the results
    assert batched([case], out, *modes) == 0
    assert facts(out, "tyre_00")["answered_from_record"] == 1
    (out / "tyre_00/finished.json").write_text("{}")
    assert batched([case], out, *modes) == 0
    assert "answered" not in facts(out, "tyre_00")


@pytest.mark.slow
def test_a_fit_that_converged_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that gives up stands in a folder of its own, and answers a second time, too."""
    (case,) = vary(tmp_path / "c", 1)
    out = tmp_path / "out"
    fit = ["--studies", "fit", "--quiet"]
    assert batched([case], out, *fit) == 0
    good = contents(out / "tyre_00")
    assert set(good) == {"fit.json", "fit.csv", "fit_variables.csv", "fit_history.csv"}
    case.write_text(case.read_text().replace("frequency_Hz: 31.7", "frequency_Hz: 31.8"))
    for answered in (False, True):
        with monkeypatch.context() as patch:
            unmoved(patch)
            assert batched([case], out, *fit) == 5
        assert contents(out / "tyre_00") == good
        ran = json.loads((out / "tyre_00/run.json").read_text())["fit"]
        assert ran["results"] == "not_converged" and ran["finished"]
        entry = json.loads((out / "tyre_00/not_converged/fit.json").read_text())
        assert entry["moved"] is False
        assert ("answered" in facts(out, "tyre_00")) == answered
    (out / "tyre_00/finished.json").unlink()
    assert batched([case], out, *fit) == 0
    assert contents(out / "tyre_00") != good
    assert "results" not in json.loads((out / "tyre_00/run.json").read_text())["fit"]


def test_drift_is_said_and_ends_in_5(
    cases: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good, baseline = [cases[0], cases[2]], tmp_path / "baseline.json"
    modes = ["--studies", "modes", "--store", str(tmp_path / "store")]
    modes += ["--baseline", str(baseline)]
    assert batched(good, tmp_path / "a", *modes) == 2  # there is none yet
    assert batched(good, tmp_path / "a", *modes, "--write-baseline") == 0
    assert batched(good, tmp_path / "a", *modes) == 0
    kept = json.loads(baseline.read_text())
    numbers = kept["cases"]["tyre_02"]["modes"]
    numbers["frequency_Hz [2,0]"] *= 1.01
    kept["cases"]["gone"] = {"modes": {}}
    baseline.write_text(json.dumps(kept))
    capsys.readouterr()
    junit = ["--junit", str(tmp_path / "ci/junit.xml")]
    assert batched(good, tmp_path / "a", *modes, *junit) == 5
    output = capsys.readouterr().out
    assert "[2,0]" in output and "-0.99 %" in output and "0.001 %" in output
    assert "not in this batch: gone" in output and "1 drifted, 1 good" in output
    (drifted,) = result(tmp_path / "a")["baseline"]["drifted"]
    assert drifted["case"] == "tyre_02" and drifted["baseline"] == numbers["frequency_Hz [2,0]"]
    assert 'type="drift"' in (tmp_path / "ci/junit.xml").read_text()
    SCHEMA.validate(str(tmp_path / "ci/junit.xml"))
    kept["tolerances"]["modes/frequency_Hz [2,0]"] = {"relative": 0.02}
    baseline.write_text(json.dumps(kept))
    assert batched(good, tmp_path / "a", *modes) == 0


@pytest.mark.slow
def test_a_footprint_in_a_batch(tmp_path: Path) -> None:
    (case,) = vary(tmp_path / "c", 1)
    out = tmp_path / "out"
    assert batched([case], out, "--studies", "footprint", "--loads-N", "300") == 0
    (entry,) = result(out)["cases"][0]["studies"].values()
    (row,) = json.loads((out / "tyre_00/footprint.json").read_text())["rows"]
    assert entry["quantities"]["area_m2 initial 300 N"] == row["area_m2"] > 0
    assert (out / "tyre_00/footprint.csv").exists()


@pytest.mark.slow
def test_interrupted_and_resumed(tmp_path: Path) -> None:
    cases = vary(tmp_path / "c", 10)
    command = [sys.executable, "-m", "tyrecal", "batch", *map(str, cases), "--studies", "modes"]
    plain = tmp_path / "plain"
    assert subprocess.run([*command, "--quiet", "--output", plain]).returncode == 0
    out = tmp_path / "out"
    process = subprocess.Popen(
        [*command, "--jobs", "2", "--output", out],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not list(out.glob("*/finished.json")) and process.poll() is None:
        time.sleep(0.005)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of them
    assert "interrupted" in process.communicate()[1]
    assert process.returncode == 130
    finished = {path.parent.name for path in out.glob("*/finished.json")}
    assert finished and not (out / "batch.json").exists()
    assert subprocess.run([*command, "--quiet", "--output", out]).returncode == 0
    assert (out / "batch.json").read_bytes() == (plain / "batch.json").read_bytes()
    assert {f"tyre_0{i}" for i in range(10) if facts(out, f"tyre_0{i}").get("answered")} == finished


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.yaml"], "none.yaml"),
        (["CASE", "CASE"], "given twice"),
        (["CASE", "--studies", "fit,mode"], "no such study; did you mean 'modes'?"),
        (["CASE", "--write-baseline"], "needs --baseline"),
        (["CASE", "--steps", "1"], "--steps"),
        (["CASE", "--from-kPa", "300", "--to-kPa", "200"], "--from-kPa"),
        (["CASE", "--loads-N", "2,1"], "loads must rise"),
        (["CASE", "--scheduler", "tcp://localhost:1", "--jobs", "2"], "--jobs"),
        (["CASE", "--scheduler", "settings.yaml"], "settings.yaml"),
        (["CASE", "--baseline", "none.json"], "none.json"),
    ],
)
def test_wrong_input_ends_in_2_and_a_sentence(
    arguments: list[str],
    words: str,
    cases: list[Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    given = [str(cases[0]) if word == "CASE" else word for word in arguments]
    assert run("batch", *given) == 2
    message = capsys.readouterr().err
    assert words in message and "Traceback" not in message


def test_a_folder_of_another_case_is_refused(tmp_path: Path) -> None:
    modes = ["--studies", "modes", "--quiet"]
    for name, code in (("a", 0), ("b", 2)):
        assert batched(vary(tmp_path / name, 1), tmp_path / "out", *modes) == code


def test_a_renamed_batch_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cases, modes = vary(tmp_path / "a", 1), ["--studies", "modes"]
    assert batched(cases, tmp_path / "out", *modes) == 0
    assert "1 case: 1 good\n" in capsys.readouterr().out
    (tmp_path / "out").rename(tmp_path / "kept")
    assert batched(cases, tmp_path / "kept", *modes) == 0
    assert facts(tmp_path / "kept", "tyre_00")["answered"]


def test_wrong_cases_are_errors_of_theirs(tmp_path: Path) -> None:
    first, second, third = vary(tmp_path / "c", 3)
    first.write_text(first.read_text().replace("format: 1", "format: 9"))
    second.write_text(second.read_text().replace("name: bundled", "name: none"))
    options = ["--studies", "modes", "--quiet", "--mesh", "fine"]
    assert batched([first, second, third], tmp_path / "out", *options) == 5
    entries = [case["studies"]["modes"] for case in result(tmp_path / "out")["cases"]]
    assert {each["cause"] for each in entries} == {"input"}
    assert "tyre_00.yaml, line 3" in entries[0]["words"]
    assert "mesh level 'fine' is not one of the case's" in entries[2]["words"]
    assert batched([second], tmp_path / "out", "--quiet") == 5
    (entry,) = result(tmp_path / "out")["cases"][0]["studies"].values()
    assert "solver 'none' is not installed" in entry["words"]
    assert str(tmp_path) not in json.dumps([entry, *entries])


def test_names_tell_cases_apart() -> None:
    assert names_of([Path("x/a.yaml"), Path("b.yaml")]) == ["a", "b"]
    assert names_of([Path("x/a.yaml"), Path("y/z/a.yaml")]) == ["x/a", "y/z/a"]
    with pytest.raises(ValueError, match="twice"):
        names_of([Path("x/a.yaml"), Path("x/a.yaml")])


def test_studies_that_run_by_name_have_a_run() -> None:
    for name, kind in result_types().items():
        own = kind.run.__func__ is not Result.run.__func__  # type: ignore[attr-defined]
        assert own == STUDIES[name].runs_by_name and kind.study == name


def test_time_left_counts_what_ran(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert seconds_left(10.0, 5, 20) == 40.0
    assert seconds_left(10.0, 0, 20) is None
    monkeypatch.setattr(progress.time, "monotonic", iter([0.0, 1.0, 60.0, 70.0]).__next__)
    with progress.BatchProgress(4, quiet=False, verbose=False) as shown:
        shown.notify({**report("a", fit=entry()), "facts": {"answered": True}})
        shown.notify(report("b", fit=entry()))
        shown.notify(report("c", fit=entry("error")))
    assert capsys.readouterr().err.splitlines() == [
        "2/4 b: good; 2:00 left",
        "3/4 c: fit: error; 1 not good, 0:35 left",
    ]
