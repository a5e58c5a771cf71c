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

CASE = str(CASES / "p235_75r17.yaml")
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
def test_a_number_that_is_off_is_selected_and_a_fit_that_frees_it_recovers_it(
    case_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Sidewalls of the real tyre, thicker by three standard deviations; the selection of a second
    run is answered from the store."""
    path = case_folder / "p235_75r17.yaml"
    path.write_text(path.read_text().replace("known_from: size_code", "known_from: exact"))
    case = tyrecal.load_case(path, mesh="coarse")
    lines = ["quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"]
    for pressure in (180.0, 300.0):
        off = tyrecal.with_values(case, {"effects.sidewall_gauge": 0.09, "pressure_kPa": pressure})
        for mode in tyrecal.evaluate_modes(off):
            place = f"{mode.label.c},{mode.label.m},{mode.label.kind or ''},,{pressure:g},0"
            hertz = mode.frequency_Hz
            lines.append(f"frequency_Hz,{place},{hertz!r},{1e-3 * hertz!r}")
    data = tmp_path / "data.csv"
    data.write_text("\n".join(lines) + "\n")
    out = ["--mesh", "coarse", "--measured", str(data), "--output", str(tmp_path / "out")]
    assert run("sensitivities", str(path), *TWO, *out, "--no-pictures") == 0
    assert "Free sidewall_gauge: chi2" in capsys.readouterr().out
    content = json.loads((tmp_path / "out/sensitivities.json").read_text())
    (step,) = content["selection"]["steps"]
    assert step["sets"] == ["effects.sidewall_gauge"] and step["p_value"] < 1e-3
    assert step["shift_in_sd"] == pytest.approx(3, abs=0.5)
    assert content["provenance"]["measured_sha256"]

    free = ["--free", "effects.sidewall_gauge", "--no-pictures", "--method", "gauss-newton"]
    assert run("fit", str(path), *out, *free) == 0
    fit = json.loads((tmp_path / "out/fit.json").read_text())
    assert fit["freed"]["sidewall_gauge"]["shift_in_sd"] == pytest.approx(3, abs=0.3)
    assert fit["variables"]["C10"]["value"] == pytest.approx(1e6, rel=0.05)
    given = ["--fitted", str(tmp_path / "out"), "--by", "C10", "--no-pictures"]
    assert run("sensitivities", str(path), *out, *given) == 0
    facts = json.loads((tmp_path / "out/run.json").read_text())["sensitivities"]
    assert facts["solver_runs"] == 1 and facts["answered_from_record"] > 5
    content = json.loads((tmp_path / "out/sensitivities.json").read_text())
    hertz = content["quantity_values"]["frequency_Hz [2,0]"]
    at = {m["pressure_kPa"]: m["fitted_Hz"] for m in fit["modes"] if (m["c"], m["m"]) == (2, 0)}
    assert content["design"] == "fitted" and at[180.0] < hertz < at[300.0]


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


def test_a_file_of_the_case_that_selects_nothing_costs_no_table(
    case_folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its frequencies have no labels; only a file that the user names is refused for that."""
    path = case_folder / "p235_75r17.yaml"
    text = path.read_text()
    targets = text[text.index("targets:") : text.index("uncertainties:")]
    path.write_text(text.replace(targets, "targets: {file: d.csv}\n\n"))
    head = "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"
    (case_folder / "d.csv").write_text(f"{head}\nfrequency_Hz,,,,,240,0,37.1,0.2\n")
    out = ["--output", str(tmp_path / "out"), "--no-pictures"]
    assert run("sensitivities", str(path), *COARSE, *TWO, *out) == 0
    text = capsys.readouterr().out
    assert "No numbers are selected to free: " in text and "line 2: the frequency has no" in text


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
