"""tyrecal sweep-pressure: against the reference, whatever fails, the same bytes every time."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.tyre.case.identity import tyre_sha256
from tyrecal.tyre.load import load_case

from ..conftest import CASES, ROOT
from ..solvers import test_abaqus
from .test_cli import CASE, run

REFERENCE = json.loads((ROOT / "tests/data/reference.json").read_text())["sections"]
RESULTS = ("pressure_sweep.json", "pressure_sweep.csv", "pressure_sweep.png")
VARIABLES = ("A_belt", "A_carcass", "C10")
coarse = test_abaqus.coarse


def key(mode: dict[str, Any]) -> str:
    return ",".join(str(mode[k]) for k in ("c", "m", "kind") if mode[k] is not None)


def result(out: Path) -> dict[str, Any]:
    return json.loads((out / "pressure_sweep.json").read_text())


def fit_of(point: dict[str, Any], path: Path, case: Path | str = CASE) -> str:
    """A fit.json that ended at a point of the reference, with the reference's frequencies."""
    modes = []
    for text, frequency in point["modes"].items():
        c, m, *kind = text.split(",")
        modes.append(
            {"c": int(c), "m": int(m), "kind": kind[0] if kind else None, "fitted_Hz": frequency}
        )
    fit = {
        "variables": {v: {"value": point[v]} for v in VARIABLES},
        "fixed": {},
        "modes": modes,
        "pressure_kPa": point["pressure_kPa"],
        "provenance": {"tyre_sha256": tyre_sha256(load_case(case)), "mesh": "default"},
    }
    path.write_text(json.dumps(fit))
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name == "p235_75r17" else pytest.mark.slow)
        for name in sorted(REFERENCE)
    ],
)
def test_both_designs_against_the_reference(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every mode at 100, 160, 200, 240, 320 kPa (fitted: 240) within 0.2 % (0.5 % asked for)."""
    fit = fit_of(REFERENCE[name][1], tmp_path / "fit.json", CASES / f"{name}.yaml")
    out = tmp_path / "out"
    assert (
        run("sweep-pressure", str(CASES / f"{name}.yaml"), "--output", str(out), "--fitted", fit)
        == 0
    )
    sweep = result(out)
    assert [row["pressure_kPa"] for row in sweep["rows"]] == [*range(100, 321, 20)] * 2
    compared = 0
    for design, points in (("initial", [0, 2, 3, 4, 5]), ("fitted", [1])):
        for point in (REFERENCE[name][i] for i in points):
            (row,) = (
                row
                for row in sweep["rows"]
                if (row["design"], row["pressure_kPa"]) == (design, point["pressure_kPa"])
            )
            modes = {key(mode): mode["frequency_Hz"] for mode in row["modes"]}
            assert set(modes) == {*point["modes"], "4,1"}
            for text, frequency in point["modes"].items():
                assert modes[text] == pytest.approx(frequency, rel=2e-3), (design, text)
                compared += 1
    assert compared == 6 * 9
    for findings in sweep["findings"]:
        assert all(m["rises"] and m["curvature"] == "concave" for m in findings["modes"])
        assert all(each["grows_with_c"] for each in findings["families"])
        assert findings["disagreements"] == [] and findings["least_mac"] > 0.9
    output = capsys.readouterr().out
    assert "fitted: every mode rises from 100 to 320 kPa" in output
    assert "fitted: labels follow the shapes throughout" in output
    lines = (out / "pressure_sweep.csv").read_text().splitlines()
    assert len(lines) == 1 + 2 * 12 * 10
    assert lines[0] == "design,pressure_kPa,c,m,kind,multiplicity,frequency_Hz,d_ln_f_d_ln_p"


@pytest.mark.slow
def test_exact_slopes_are_those_of_the_frequencies(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Between 199 and 201 kPa, against the difference of the logarithms: 1e-5."""
    arguments = ["--from-kPa", "199", "--to-kPa", "201", "--steps", "3", "--no-pictures"]
    assert run("sweep-pressure", CASE, "--output", str(tmp_path), *arguments, "--json") == 0
    sweep = json.loads(capsys.readouterr().out)
    assert sweep == result(tmp_path) and sweep["slopes"] == "exact"
    assert not (tmp_path / "pressure_sweep.png").exists()
    below, at, above = ({key(m): m for m in row["modes"]} for row in sweep["rows"])
    for text, mode in at.items():
        rise = math.log(above[text]["frequency_Hz"] / below[text]["frequency_Hz"])
        assert mode["d_ln_f_d_ln_p"] == pytest.approx(rise / math.log(201 / 199), rel=1e-5), text


@pytest.mark.slow
def test_a_solver_in_three_dimensions_without_slopes(
    coarse: Callable[..., Path], tmp_path: Path
) -> None:
    """Shapes on rings, pairs apart and turned; slopes by differences near the exact ones."""
    case, sweeps = str(coarse()), {}
    for solver in ("abaqus", "bundled"):
        out = tmp_path / solver
        assert (
            run(
                "sweep-pressure",
                case,
                "--solver",
                solver,
                "--output",
                str(out),
                "--quiet",
                "--from-kPa",
                "200",
                "--to-kPa",
                "240",
                "--steps",
                "3",
            )
            == 0
        )
        sweeps[solver] = result(out)
    assert (sweeps["abaqus"]["slopes"], sweeps["bundled"]["slopes"]) == ("differences", "exact")
    for theirs, ours in zip(sweeps["abaqus"]["rows"], sweeps["bundled"]["rows"], strict=True):
        modes = {key(mode): mode for mode in theirs["modes"]}
        for mode in ours["modes"]:
            other = modes[key(mode)]
            assert other["frequency_Hz"] == pytest.approx(mode["frequency_Hz"], rel=1e-6)
            assert other["d_ln_f_d_ln_p"] == pytest.approx(mode["d_ln_f_d_ln_p"], rel=0.02)
            assert other["multiplicity"] == mode["multiplicity"]
    (findings,) = sweeps["abaqus"]["findings"]
    assert findings["disagreements"] == [] and findings["least_mac"] > 0.99


@pytest.mark.slow
def test_jobs_and_the_record_change_no_byte(tmp_path: Path) -> None:
    fit = fit_of(REFERENCE["p235_75r17"][1], tmp_path / "fit.json")
    arguments = ["sweep-pressure", CASE, "--fitted", fit, "--steps", "3", "--quiet", "--output"]
    one, two = tmp_path / "one", tmp_path / "two"
    assert run(*arguments, str(one)) == 0
    assert run(*arguments, str(two), "--jobs", "2") == 0
    first = {name: (one / name).read_bytes() for name in RESULTS}
    assert {name: (two / name).read_bytes() for name in RESULTS} == first
    for out in (one, two):
        facts = json.loads((out / "run.json").read_text())["sweep-pressure"]
        assert (facts["solver_runs"], facts["answered_from_record"]) == (
            7,
            0,
        )  # a nominal tyre's, too
        assert facts["command"] == "sweep-pressure" and not (out / "runs").exists()
    lost = next(one.glob("record/*/*.record"))
    lost.unlink()  # as if the first run had been killed before it
    assert run(*arguments, str(one), "--jobs", "2") == 0
    assert {name: (one / name).read_bytes() for name in RESULTS} == first
    facts = json.loads((one / "run.json").read_text())["sweep-pressure"]
    assert (facts["solver_runs"], facts["answered_from_record"]) == (1, 6)


# has no equilibrium much beyond 350 kPa
SOFT = ["--set", "A_carcass=1e-8", "--set", "C10=1e5", "--allow-unusual"]


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [pytest.param("1", marks=pytest.mark.slow), "2"])
def test_a_pressure_that_fails_costs_no_other(
    jobs: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    ends = ["--from-kPa", "100", "--to-kPa", "400", "--steps", "3", "--jobs", jobs]
    assert run("sweep-pressure", CASE, "--output", str(out), *SOFT, *ends) == 3
    printed, sweep = capsys.readouterr(), result(out)
    assert [row["pressure_kPa"] for row in sweep["rows"]] == [100, 250]
    (failed,) = sweep["failed"]
    assert (failed["pressure_kPa"], failed["cause"]) == (400, "no_equilibrium")
    (kept,) = (out / "runs").iterdir()
    assert re.search(r"error: initial, 400 kPa: inflation stopped at 35\d\.", printed.err)
    assert str(kept) in printed.err and "1 of 3 evaluations failed" in printed.err
    assert "from 100 to 250 kPa" in printed.out
    assert (out / "pressure_sweep.png").exists()
    assert kept.name not in (out / "pressure_sweep.json").read_text()


@pytest.mark.slow
def test_a_failure_amid_the_sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Findings go on over the gap: the bows of uneven steps are still those of concave curves."""
    evaluate = Evaluator.evaluate

    def moody(evaluator: Evaluator, question: Question) -> Evaluation:
        if question.values.get("pressure_kPa") == 140:
            raise EvaluationFailed("timed_out", "ran out of time")
        return evaluate(evaluator, question)

    monkeypatch.setattr(Evaluator, "evaluate", moody)
    arguments = ["--output", str(tmp_path), "--to-kPa", "180", "--steps", "5", "--quiet"]
    assert run("sweep-pressure", CASE, *arguments) == 3
    sweep = result(tmp_path)
    assert [row["pressure_kPa"] for row in sweep["rows"]] == [100, 120, 160, 180]
    assert sweep["failed"] == [
        {"design": "initial", "pressure_kPa": 140, "cause": "timed_out", "words": "ran out of time"}
    ]
    assert {mode["curvature"] for mode in sweep["findings"][0]["modes"]} == {"concave"}


@pytest.mark.slow
def test_nothing_is_written_where_every_pressure_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    ends = ["--from-kPa", "400", "--to-kPa", "450", "--steps", "2", "--mesh", "coarse"]
    assert run("sweep-pressure", CASE, "--output", str(out), *SOFT, *ends) == 3
    assert capsys.readouterr().err.count("inflation stopped at") == 2
    assert not [name for name in RESULTS if (out / name).exists()]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--from-kPa", "320", "--to-kPa", "100"], "less than --to-kPa 100"),
        (["--from-kPa", "200", "--to-kPa", "200"], "less than --to-kPa 200"),
        (["--from-kPa", "-10"], "above 0"),
        (["--from-kPa", "0"], "above 0"),
        (["--from-kPa", "nan"], "must be a number in kPa"),
        (["--to-kPa", "inf"], "must be a number in kPa"),
        (["--to-kPa", "5000"], "usual is 50 to 1200 kPa"),
        (["--to-kPa", "high"], "--to-kPa high: must be a number in kPa, as in 240"),
        (["--steps", "1"], "--steps 1: must be a whole number, 2 to 10000, as in 12"),
        (["--steps", "2.5"], "must be a whole number, 2 to 10000"),
        (["--set", "pressure_kPa=200"], "--from-kPa"),
        (["--set", "A_bolt=1"], "A_belt"),
        (["--fitted", "no_such.json"], "there is no such file"),
        (["--fitted", CASE], "not the fit.json"),
        (["--solver", "nastran"], "bundled"),
        (["--mesh", "finest"], "refined"),
    ],
)
def test_wrong_options(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("sweep-pressure", CASE, "--output", str(out), *arguments) == 2
    printed = capsys.readouterr()
    assert words in printed.err and "Traceback" not in printed.err and printed.out == ""
    assert not out.exists()


def test_a_fit_of_another_case_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = "p235_75r17_narrow_rim"
    fit = fit_of(REFERENCE[other][1], tmp_path / "fit.json", CASES / f"{other}.yaml")
    out = tmp_path / "out"
    assert run("sweep-pressure", CASE, "--output", str(out), "--fitted", fit) == 2
    assert "is a fit of another tyre" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.slow
def test_a_fit_is_taken_as_it_is_written(tmp_path: Path) -> None:
    """The real fit.json, in the same folder; the sweep passes through its frequencies."""
    out = ["--output", str(tmp_path), "--quiet", "--mesh", "coarse"]
    assert run("fit", CASE, *out, "--fix", "A_belt", "--no-pictures") == 0
    assert (
        run(
            "sweep-pressure",
            CASE,
            *out,
            "--fitted",
            str(tmp_path / "fit.json"),
            "--from-kPa",
            "220",
            "--to-kPa",
            "240",
            "--steps",
            "2",
        )
        == 0
    )
    fit = json.loads((tmp_path / "fit.json").read_text())
    last = result(tmp_path)["rows"][-1]
    frequencies = {key(mode): mode["frequency_Hz"] for mode in last["modes"]}
    assert (last["design"], last["pressure_kPa"]) == ("fitted", 240)
    for mode in fit["modes"]:
        assert frequencies[key(mode)] == pytest.approx(mode["fitted_Hz"], rel=1e-9)
    assert result(tmp_path)["designs"]["fitted"]["A_belt"] == fit["fixed"]["A_belt"]


def test_the_command_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("sweep-pressure", "--help") == 0
    assert "--from-kPa" in capsys.readouterr().out
