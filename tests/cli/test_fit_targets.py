"""tyrecal fit with targets on the road, over several states, and without labels."""

from __future__ import annotations

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from tyrecal_solvers.bundled.adapter import Bundled

from tyrecal.measured.tables import read_measurements
from tyrecal.report import pictures
from tyrecal.report.convergence import draw_convergence
from tyrecal.report.figure import save
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import evaluator as door_module
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import Label, paired_labels
from tyrecal.studies.fit.problem import Problem
from tyrecal.studies.fit.targets import target_labels
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import TyreState

from ..batch.support import nearly_certain
from ..conftest import CASES
from ..fit.pressed import AREA_0, STIFFNESS_0, Elastic
from ..studies.hertz import coarse_case
from .test_cli import run

FOOTPRINT = f"""  footprint:
    - {{load_N: 4000, contact_area_m2: {1.05 * AREA_0!r}, sigma_m2: {0.02 * AREA_0!r}}}
    - {{load_N: 3500, vertical_stiffness_N_per_m: {0.9 * STIFFNESS_0!r}, sigma_N_per_m: 5.0e+3}}
uncertainties:"""


@pytest.fixture
def elastic(monkeypatch: pytest.MonkeyPatch) -> type[Elastic]:
    """Footprints by a formula, modes by the bundled solver."""
    monkeypatch.setattr(door_module, "find_solver", lambda name, *command: Elastic())
    return Elastic


@pytest.fixture
def case(case_folder: Path) -> str:
    """The main case with two footprint targets, and a sigma for one mode."""
    path = case_folder / "p235_75r17.yaml"
    text = path.read_text().replace("\nuncertainties:", f"\n{FOOTPRINT}", 1)
    path.write_text(text.replace("31.7}", "31.7, sigma_Hz: 0.5}", 1))
    return str(path)


def found(out: Path, name: str = "fit") -> dict[str, Any]:
    return json.loads((out / f"{name}.json").read_text())


def test_what_it_writes(
    elastic: type[Elastic],
    case: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out, drawn = tmp_path / "out", []
    monkeypatch.setattr(pictures, "draw_fit", lambda *arguments: drawn.append(arguments))
    assert run("fit", case, "--output", str(out)) == 0
    *_, history, fit, _ = drawn[0]
    save(draw_convergence(history, fit.objective_unit), out / "convergence.png")
    assert fit.objective_unit == "sigma" and (out / "convergence.png").stat().st_size > 10_000
    printed, result = capsys.readouterr().out, found(out)
    assert [(row["load_N"], row["quantity"]) for row in result["footprint"]] == [
        (4000, "contact_area_m2"),
        (3500, "vertical_stiffness_N_per_m"),
    ]
    assert set(result["footprint"][0]) == {
        "load_N",
        "quantity",
        "initial",
        "fitted",
        "target",
        "sigma",
        "deviation_percent",
    }
    assert "4000 N" in printed and "contact area, cm²" in printed and "131.9" in printed
    assert "3500 N" in printed and "vertical stiffness, N/mm" in printed and "270.0" in printed
    assert "deviations in sigmas" in printed and "equation (1)" not in printed
    rows = list(csv.DictReader((out / "fit.csv").open()))
    assert len(rows) == 11 and rows[0]["c"] == "0" and rows[0]["load_N"] == ""
    assert float(rows[9]["fitted"]) == result["footprint"][0]["fitted"] and rows[9]["c"] == ""

    # the footprint study presses what the fit pressed
    arguments = ["footprint", case, "--output", str(out), "--no-pictures", "--quiet"]
    assert run(*arguments, "--fitted", str(out / "fit.json")) == 0
    rows = {(row["design"], row["load_N"]): row for row in found(out, "footprint")["rows"]}
    assert (4000 in {load for _, load in rows}) and (3500 in {load for _, load in rows})
    area, stiffness = result["footprint"]
    for design in ("initial", "fitted"):
        assert rows[design, 4000]["area_m2"] == area[design]
        assert rows[design, 3500]["vertical_stiffness_N_per_m"] == stiffness[design]


@pytest.mark.slow
def test_run_again_from_the_record(elastic: type[Elastic], case: str, tmp_path: Path) -> None:
    arguments = ["fit", case, "--output", str(tmp_path), "--no-pictures", "--quiet"]
    assert run(*arguments) == 0
    first, runs = (tmp_path / "fit.json").read_bytes(), found(tmp_path, "run")["fit"]["solver_runs"]
    assert run(*arguments) == 0
    again = found(tmp_path, "run")["fit"]
    assert (tmp_path / "fit.json").read_bytes() == first
    assert (again["solver_runs"], again["answered_from_record"] >= runs) == (0, True)


@pytest.mark.parametrize("solver", ["abaqus", "calculix"])
def test_a_solver_without_a_road(
    solver: str, case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run("fit", case, "--output", str(out), "--solver", solver) == 2
    message = capsys.readouterr().err
    assert (
        message.count("\n") == 1 and f"solver '{solver}' cannot press a tyre on a road" in message
    )
    assert not out.exists()


def test_too_few_targets(
    elastic: type[Elastic], case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = Path(case)
    text = path.read_text()
    begin, end = text.index("  modes:\n    - {c"), text.index("  footprint:")
    path.write_text(f"{text[:begin]}{text[end:]}")
    arguments = ["fit", case, "--output", str(tmp_path / "out"), "--no-pictures"]
    assert run(*arguments) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1 and "2 targets cannot determine 3 free variables" in message
    assert run(*arguments, "--fix", "A_belt", "--quiet") == 0


@pytest.mark.slow
def test_jobs_change_no_bit(tmp_path: Path) -> None:
    """The bundled solver, one after the other and two at a time; its slopes are those of
    neighbours."""
    path = coarse_case(tmp_path)
    text = path.read_text().replace("[6, 6, 6, 12, 30, 120]", "[10, 14, 36, 120]")
    text = text.replace("120]}", "120], loads_N: [1000]}", 1).replace("4000", "1000")
    text = text.replace(
        "crown: 4, upper_sidewall: 3, lower_sidewall: 3",
        "crown: 3, upper_sidewall: 2, lower_sidewall: 2",
    )
    path.write_text(text.replace("\nuncertainties:", f"\n{FOOTPRINT.replace('3500', '1000')}", 1))
    path.write_text(path.read_text().replace("load_N: 4000", "load_N: 1000"))
    case = load_case(path)
    held = {"A_belt": 2.118683e-7, "A_carcass": 4.208352e-7}
    points = []
    for jobs, solver in ((1, None), (2, None), (2, Differences())):
        problem = Problem(case, Evaluator(TyreDesign(case), _solver=solver), held, jobs=jobs)
        points.append(problem.evaluate(problem.start()))
    assert (points[0].others == points[1].others).all()
    assert (points[0].jacobian == points[1].jacobian).all()
    assert (points[0].others == points[2].others).all()
    assert points[0].jacobian == pytest.approx(points[2].jacobian, rel=1e-2)
    assert 0.001 < points[0].others[0] < 0.02 and points[0].jacobian[-1, 0] > 0


class Differences(Bundled):
    """The bundled solver, did it not tell how a footprint changes."""

    capabilities = Bundled.capabilities - {"footprint_gradients"}


TRUTH = {"A_belt": 2.6e-7, "A_carcass": 2.5e-7, "C10": 7e5}


STATES = {"": TyreState(), "pressure_kPa: 160, rim: free": TyreState(160.0, 0.0, "free")}


OTHERS = "  mass: {mass_kg: 12.7, sigma_kg: 0.1}\n"


def edited(folder: Path, modes: str) -> Path:
    """The main case with other targets."""
    shutil.copy(CASES / "p235_75r17.csv", folder)
    text = (CASES / "p235_75r17.yaml").read_text()
    start = text.index("  modes:\n", text.index("\ntargets:"))
    end = text.index("\n\n", start)
    path = folder / "states.yaml"
    path.write_text(text[:start] + "  modes:\n" + modes + OTHERS + text[end:])
    return path


@pytest.fixture(scope="module")
def case_in_states(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the coarse mesh's own modes at TRUTH in two states."""
    model: LoadedCase = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
    evaluator, lines = Evaluator(TyreDesign(model)), []
    wanted = {(t.c, t.m, t.kind) for t in model.case.targets.modes}
    for words, state in STATES.items():
        for mode in paired_labels(evaluator.evaluate(Question(state.design(model, TRUTH))).modes):
            label = (mode.label.c, mode.label.m, mode.label.kind)
            if label in wanted:
                keys = f"c: {label[0]}, m: {label[1]}, frequency_Hz: {mode.frequency_Hz:.6f}"
                kind = f", kind: {label[2]}" if label[2] else ""
                own = f", {words}" if words else ""
                lines.append(f"    - {{{keys}, sigma_Hz: 0.2{kind}{own}}}\n")
    return edited(tmp_path_factory.mktemp("states"), "".join(lines))


@pytest.mark.slow
def test_a_case_holds_targets_in_several_states(case_in_states: Path, tmp_path: Path) -> None:
    """Fitted, reported; what each state was stands in the results."""
    given = [
        str(case_in_states),
        "--mesh",
        "coarse",
        "--no-pictures",
        "--report",
        "--output",
        str(tmp_path),
    ]
    assert run("fit", *given) == 0
    fit = json.loads((tmp_path / "fit.json").read_text())
    for name, truth in TRUTH.items():
        assert fit["variables"][name]["value"] == pytest.approx(truth, rel=0.02)
    assert [m["rim"] for m in fit["modes"]] == ["fixed"] * 9 + ["free"] * 9
    state = fit["provenance"]["state"]
    assert state == {"pressure_kPa": [160, 240], "load_N": 0, "rim": ["fixed", "free"]}
    assert fit["mass"]["fitted"] == pytest.approx(fit["mass_kg"])
    page = (tmp_path / "report.html").read_text()
    assert "160 kPa" in page and "rim free" in page
    shapes = json.loads((tmp_path / "fit_shapes.json").read_text())
    assert shapes["pressure_kPa"] == 240


@pytest.mark.slow
def test_other_studies_take_such_a_case(case_in_states: Path, tmp_path: Path) -> None:
    """Sweeps with the fitted design, pictures, batches, modes and draws."""
    case_in_states = nearly_certain(
        Path(shutil.copytree(case_in_states.parent, tmp_path / "cases")) / case_in_states.name
    )
    common = ["--mesh", "coarse", "--output", str(tmp_path)]
    assert run("validate", str(case_in_states)) == 0
    assert run("fit", str(case_in_states), *common, "--jobs", "2") == 0
    assert (tmp_path / "fit_states.png").exists()
    ends = ["--from-kPa", "160", "--to-kPa", "240", "--steps", "2"]
    common.append("--no-pictures")
    assert (
        run("sweep-pressure", str(case_in_states), *ends, "--fitted", str(tmp_path), *common) == 0
    )
    assert run("modes", str(case_in_states), *common) == 0
    few = ["--draws", "2000"]  # which it says: 4
    assert run("sample", str(case_in_states), *few, *common) in (0, 4)
    drawn = json.loads((tmp_path / "sample.json").read_text())
    assert {row["pressure_kPa"] for row in drawn["predicted"]} >= {240.0}
    assert run("report", str(tmp_path)) == 0


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("rim: springs", "targets.modes.0.rim is springs: has no springs in this case: give a"),
        ("rim: loose", "targets.modes.0.rim is loose"),
        ("load_N: 4000", "must be symmetric or antisymmetric (about the patch) under load_N"),
        ("symmetry: symmetric", "targets.modes.0.symmetry is symmetric: must be absent without"),
        (
            "load_N: 4000, symmetry: symmetric",
            "sigma_Hz is missing: must be given for a mode under load_N",
        ),
        ("pressure_kPa: 2.4", "usual is 50 to 1200 kPa"),
    ],
)
def test_mistakes_are_told_with_their_line(
    target: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = f"    - {{c: 2, m: 0, frequency_Hz: 79.5, {target}}}\n" + "".join(
        f"    - {{c: {c}, m: 0, frequency_Hz: 99.5}}\n" for c in (3, 4)
    )
    path = edited(tmp_path, lines)
    assert run("validate", str(path)) == 2
    printed = capsys.readouterr()
    line = path.read_text().splitlines().index(lines.splitlines()[0]) + 1
    assert (
        f"{path}, line {line}" in printed.out + printed.err
        or f":{line}" in printed.out + printed.err
    )
    assert words in printed.out + printed.err


def test_the_same_mode_twice_in_one_state_is_a_mistake(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    twice = "    - {c: 2, m: 0, frequency_Hz: 79.5, pressure_kPa: 160, rim: free}\n"
    once = "    - {c: 2, m: 0, frequency_Hz: 79.5, pressure_kPa: 160}\n"
    other = "    - {c: 3, m: 0, frequency_Hz: 99.5}\n"
    assert run("validate", str(edited(tmp_path, twice + once + other))) == 0
    assert run("validate", str(edited(tmp_path, twice + twice + other))) == 2
    printed = capsys.readouterr()
    assert "the mode [2,0] is a target already in this state" in printed.out + printed.err


def test_a_fit_reports_exchanged_pressures_before_it_begins(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Frequencies that are lower at 280 than at 200 kPa; --dry-run ends before the fit."""
    rows = [
        f"{c},{m},{kPa},{hertz * rise:.2f},0.2"
        for kPa, rise in ((200, 1.08), (280, 1.0))
        for c, m, hertz in ((1, 0, 71.0), (2, 0, 89.0), (2, 1, 79.0), (3, 0, 106.0), (4, 0, 125.0))
    ]
    table = tmp_path / "exchanged.csv"
    table.write_text("\n".join(["c,m,pressure_kPa,frequency_Hz,sigma_Hz", *rows, ""]))
    case = str(CASES / "p235_75r17.yaml")
    assert run("fit", case, "--mesh", "coarse", "--measured", str(table), "--dry-run") == 0
    words = capsys.readouterr().err
    assert "exchanged.csv, line" in words and "exchanged" in words.replace("exchanged.csv", "")
    assert "200" in words and "280" in words


Modes = dict[Label | None, float]


CASE = str(CASES / "p235_75r17.yaml")


MISSING = (Label(2, 1), Label(3, 1))


FOREIGN_Hz = 24.0


@pytest.fixture(scope="module")
def modes() -> Modes:
    """The coarse mesh's at TRUTH, less some, and a frequency that is no mode, rising."""
    case = with_level(load_case(CASE), "coarse")
    paired = paired_labels(Evaluator(TyreDesign(case)).evaluate(Question(TRUTH)).modes)
    wanted = [*target_labels(case)]
    hertz: Modes = {None: FOREIGN_Hz}
    for mode in sorted(paired, key=lambda mode: mode.frequency_Hz):
        if mode.label in wanted and mode.label not in MISSING:
            hertz[mode.label] = round(mode.frequency_Hz, 3)
    return hertz


@pytest.fixture(scope="module")
def unlabelled(modes: Modes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("unlabelled") / "unlabelled.csv"
    lines = [f"{f},{0.005 * f:.3f},240" for f in modes.values()]
    path.write_text("\n".join(["frequency_Hz,sigma_Hz,pressure_kPa", *lines]) + "\n")
    return path


@pytest.mark.slow
def test_a_fit_to_frequencies_without_labels(
    modes: Modes, unlabelled: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those of the tyre are found and fitted; told in the terminal, the file and on the page."""
    given = [CASE, "--mesh", "coarse", "--output", str(tmp_path)]
    more = ["--measured", str(unlabelled), "--no-pictures", "--report"]
    assert run("fit", *given, *more) == 0
    shown = capsys.readouterr().out
    result = json.loads((tmp_path / "fit.json").read_text())
    assigned = {
        each["frequency_Hz"]: each["c"] is not None and Label(each["c"], each["m"], each["kind"])
        for each in result["labels"]["frequencies"]
    }
    assert assigned == {f: label or False for label, f in modes.items()}
    assert len(result["modes"]) == len(modes) - 1
    for name, truth in TRUTH.items():
        assert result["variables"][name]["value"] == pytest.approx(truth, rel=1e-3)
    words = "Labels of frequencies without a label"
    assert words in shown and words in (tmp_path / "report.html").read_text()

    fit = str(tmp_path / "fit.json")
    assert run("measured", "label", *given, str(unlabelled), "--fitted", fit, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "labels.json").read_text())
    assert [each["probability"] > 0.5 for each in printed["labels"]["frequencies"]] == [True] * len(
        modes
    )
    kept = read_measurements(tmp_path / "labelled.csv")
    assert {each.label: each.value for each in kept} == {k: v for k, v in modes.items() if k}


def test_labels_are_asked_for_where_they_are_needed(
    unlabelled: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Other commands and files that need labels are refused with the command that finds them;
    nothing is labelled twice."""
    labelled = ["--measured", str(CASES / "p235_75r17_wheeler.csv"), "--output", str(tmp_path)]
    given = str(unlabelled)
    for more in (
        ["--repeats", given],
        ["--toggled", given, "spindle_tilt=0"],
        ["--toggled", given, "rim_width*9"],  # a factor is not taken for 9 m
    ):
        assert run("diagnose", CASE, *labelled, *more) == 2
        assert "tyrecal measured label" in capsys.readouterr().err
    other = str(CASES / "p235_75r17_wheeler.csv")
    assert run("measured", "label", CASE, other, "--output", str(tmp_path)) == 2
    assert "every frequency has a label" in capsys.readouterr().err
