"""tyrecal sample: files, words, the same bytes again, and what is refused."""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import pytest

from ..batch.support import nearly_certain
from ..conftest import CASES
from .test_cli import run

CASE, DATA = str(CASES / "p235_75r17.yaml"), str(CASES / "p235_75r17_wheeler.csv")
COARSE = ["--mesh", "coarse", "--draws", "60000"]
FILES = ("sample.json", "sample.csv", "sample_draws.csv", "sample_corner.png")

pytestmark = pytest.mark.numbers


@pytest.mark.slow
def test_a_sample_of_two_processes_in_files_and_the_same_bytes_from_the_record(
    case_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With an exact section: its fields would ask for twice as many designs."""
    case, out = case_folder / "p235_75r17.yaml", tmp_path / "out"
    case.write_text(case.read_text().replace("known_from: size_code", "known_from: exact"))
    command = ["sample", str(case), "--measured", DATA, *COARSE, "--at-kPa", "200"]
    assert run(*command, "--output", str(out), "--json", "--jobs", "2") == 0
    printed = capsys.readouterr()
    sample = json.loads((out / "sample.json").read_text())
    assert json.loads(printed.out) == sample and "stage 3 of 4, sample" in printed.err
    assert sample["provenance"]["measured_sha256"] and sample["provenance"]["mesh"] == "coarse"
    assert set(sample["variables"]) == {"A_belt", "A_carcass", "C10"}
    for v in sample["variables"].values():
        assert v["lower"] < v["low"] < v["median"] < v["high"] < v["upper"]
        assert v["high"] - v["low"] == pytest.approx(2 * 1.645 * v["standard_error"], rel=0.3)
    assert {row["pressure_kPa"] for row in sample["predicted"]} == {200.0, 240.0}
    measured = [row for row in sample["predicted"] if row["measured_Hz"]]
    assert len(measured) == 9 and {row["pressure_kPa"] for row in measured} == {240.0}
    assert any((row["c"], row["m"]) == (4, 1) for row in sample["predicted"])
    for row in sample["predicted"]:
        assert row["low"] < row["frequency_Hz"] < row["high"]
    emulator = sample["emulator"]
    assert 40 <= emulator["evaluations"] <= 80 and emulator["stated_error"] < 5e-3
    assert emulator["evaluations_of_all"] == emulator["evaluations"] + emulator["failed"]
    draws = list(csv.DictReader((out / "sample_draws.csv").open()))
    assert len(draws) == sample["chains"]["kept"] > 1000
    runs = json.loads((out / "run.json").read_text())["sample"]
    assert runs["solver_runs"] > 40 and not (out / "runs").exists()

    bytes_ = {name: (out / name).read_bytes() for name in FILES}
    assert run(*command, "--output", str(out), "--report") == 0
    printed = capsys.readouterr()
    assert {name: (out / name).read_bytes() for name in FILES} == bytes_
    assert json.loads((out / "run.json").read_text())["sample"]["solver_runs"] == 0
    assert "A_carcass" in printed.out and "third out-of-plane bending" in printed.out
    assert "off by less than" in printed.out
    page = (out / "report.html").read_text()
    assert "<h2>Sample</h2>" in page and "90 % of the draws" in page
    assert "A_belt, mm²</text>" in page


@pytest.mark.slow
def test_targets_without_a_sigma_have_that_of_the_fit(
    case_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A case of one variable needs few designs."""
    shared = ["--store", str(tmp_path / "store"), "--mesh", "coarse"]
    fit, out = tmp_path / "fit", tmp_path / "out"
    path = nearly_certain(case_folder / "p235_75r17.yaml")
    before, after = path.read_text().split("  A_belt:\n")
    path.write_text(before + after[after.index("  C10:\n") :])
    case = str(path)
    assert run("fit", case, *shared, "--no-pictures", "--output", str(fit)) == 0
    command = ["sample", case, *shared, "--draws", "5000", "--no-pictures"]
    assert run(*command, "--output", str(out)) == 0  # it draws on until they are enough
    noise = json.loads((fit / "fit.json").read_text())["noise_Hz"]
    sample = json.loads((out / "sample.json").read_text())
    assert sample["noise_Hz"] == noise and not (out / "sample_corner.png").exists()
    assert f"the targets state no sigma: {noise:.2f} Hz" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--draws", "10"], "--draws 10: must be a whole number, 1000 to 10000000, as in 100000"),
        (["--at-kPa", "2.4"], "--at-kPa 2.4: usual is 50 to 1200 kPa"),
        (["--measured", "no.csv"], "--measured no.csv: there is no such file"),
        (["--measured", "mass.csv"], "no frequency of the unloaded tyre"),
        (["--measured", "high.csv", "--mesh", "coarse", "--no-store"], "is it the right unit"),
        (["--seed", "-1"], "--seed -1: must be a whole number, 0 to"),
    ],
)
def test_what_is_refused(
    given: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    head = Path(DATA).read_text().splitlines()[0]
    Path("mass.csv").write_text(f"{head}\nmass_kg,,,,,,,12.8,0.1\n")
    Path("high.csv").write_text(f"{head}\nfrequency_Hz,2,0,,,240,0,200.0,1.0\n")
    assert run("sample", CASE, *given) == 2
    message = capsys.readouterr().err
    assert words in message and "Traceback" not in message


PRESSED = """\
  P: {sets: [pressure_kPa], start: 240.0, lower: 100.0, upper: 400.0}

"""


@pytest.mark.parametrize(
    ("variables", "words"),
    [("variables:\n" + PRESSED, "sets pressure_kPa"), ("", "there is nothing to sample")],
)
def test_cases_that_cannot_be_sampled_leave_no_folder(
    variables: str, words: str, case_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = case_folder / "p235_75r17.yaml", case_folder / "out"
    before, _, rest = path.read_text().partition("variables:")
    path.write_text(before + variables + rest[rest.index("targets:") :])
    assert run("sample", str(path), "--measured", DATA, "--output", str(out)) == 2
    assert words in capsys.readouterr().err and not out.exists()


def test_a_missing_emcee_is_one_sentence_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "emcee", None)
    assert run("sample", CASE, "--output", str(tmp_path / "out")) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1 and "pip install '.[sample]'" in message
    assert not (tmp_path / "out").exists()
