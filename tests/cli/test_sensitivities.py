"""tyrecal sensitivities: files, the screen's numbers, a batch, and what is refused."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

import tyrecal
from tyrecal.studies.sensitivities.result import SensitivitiesResult

from ..conftest import CASES
from .test_cli import run

CASE, DATA = str(CASES / "p235_75r17.yaml"), str(CASES / "p235_75r17_wheeler.csv")
COARSE = ("--mesh", "coarse")
TWO = ("--by", "C10", "--by", "rebar_layers.belt_1.angle_deg")


def test_the_screen_has_the_numbers_of_the_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("sensitivities", CASE, *COARSE, *TWO, "--output", str(tmp_path)) == 0
    text = capsys.readouterr().out
    rows = list(csv.DictReader((tmp_path / "sensitivities.csv").open()))
    assert len(rows) == 20 and {row["per"] for row in rows} == {"", "degree"}
    shown = re.search(r"^C10 +(.*)$", text, re.M)
    of_C10 = {row["quantity"]: float(row["value"]) for row in rows if row["by"] == "C10"}
    in_plane = ["[0,0] torsional", *(f"[{c},0]" for c in (1, 2, 3, 4))]
    assert shown and [float(x) for x in shown[1].split()] == [
        round(of_C10[f"frequency_Hz {label}"], 3) for label in in_plane
    ]
    assert "rebar_layers.belt_1.angle_deg, per degree" in text and "[0,0] lateral" in text
    content = json.loads((tmp_path / "sensitivities.json").read_text())
    assert [str(row["value"]) for row in content["rows"]] == [row["value"] for row in rows]
    assert content["provenance"]["mesh"] == "coarse" and content["selection"] is None
    assert (tmp_path / "sensitivities.png").stat().st_size > 10_000


@pytest.mark.slow
def test_measurements_select_numbers_and_a_second_run_is_answered_from_the_store(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["sensitivities", CASE, *COARSE, *TWO, "--measured", DATA, "--no-pictures"]
    for _ in range(2):
        assert run(*command, "--output", str(tmp_path), "--report") == 0
    text = capsys.readouterr().out
    assert json.loads((tmp_path / "run.json").read_text())["sensitivities"]["solver_runs"] == 0
    content = json.loads((tmp_path / "sensitivities.json").read_text())
    selection = content["selection"]
    assert selection["steps"] == [] and selection["next_p_value"] > 0.05
    assert (
        f"Free no number: no gain is better than chance at 5% (chi2 {selection['chi2']:.4g}" in text
    )
    assert f"With an exact section chi2 would be {selection['chi2_exact_section']:.4g}" in text
    assert content["provenance"]["measured_sha256"]
    assert "<h2>Sensitivities</h2>" in (tmp_path / "report.html").read_text()


@pytest.mark.slow
def test_a_batch_and_python_give_the_same_numbers(tmp_path: Path) -> None:
    options = [*COARSE, "--studies", "sensitivities", "--output", str(tmp_path / "b")]
    assert run("batch", CASE, *options) == 0
    (entry,) = json.loads((tmp_path / "b/batch.json").read_text())["cases"]
    numbers = entry["studies"]["sensitivities"]["quantities"]
    case = tyrecal.load_case(CASE, mesh="coarse")
    result = tyrecal.run("sensitivities", case, by="C10", of="frequency")
    assert isinstance(result, SensitivitiesResult) and len(result.rows) == 10
    for row in result.rows:
        key = f"sensitivity {row.quantity} by C10"
        assert numbers[key] == pytest.approx(row.value, rel=1e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--by", "C11"], "there is no 'C11'; did you mean 'C10'?"),
        (["--of", "area"], "there is no quantity 'area'"),
        (["--loads-N", "3000"], "give --of a quantity on the road"),
        (["--of", "contact_area", "--loads-N", "3,x"], "must be numbers in N"),
        (["--solver", "calculix"], "gives no exact sensitivities of this case"),
        (["--measured", str(CASES / "205_60r15_both.csv")], "the frequency has no label, c and m"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_runs(
    options: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("sensitivities", CASE, *COARSE, *options, "--output", str(out)) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line and not out.exists()
