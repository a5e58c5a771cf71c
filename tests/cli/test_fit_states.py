"""tyrecal fit over several states: a case that holds some, mistakes, what other studies do."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import paired_labels
from tyrecal.tyre.case import LoadedCase, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import TyreState

from ..batch.support import nearly_certain
from ..conftest import CASES
from .test_cli import run

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
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
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
def test_a_case_holds_targets_in_several_states(case: Path, tmp_path: Path) -> None:
    """Fitted, reported; what each state was stands in the results."""
    given = [str(case), "--mesh", "coarse", "--no-pictures", "--report", "--output", str(tmp_path)]
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
def test_other_studies_take_such_a_case(case: Path, tmp_path: Path) -> None:
    """Sweeps with the fitted design, pictures, batches, modes and draws."""
    case = nearly_certain(Path(shutil.copytree(case.parent, tmp_path / "cases")) / case.name)
    common = ["--mesh", "coarse", "--output", str(tmp_path)]
    assert run("validate", str(case)) == 0
    assert run("fit", str(case), *common, "--jobs", "2") == 0
    assert (tmp_path / "fit_states.png").exists()
    ends = ["--from-kPa", "160", "--to-kPa", "240", "--steps", "2"]
    assert run("sweep-pressure", str(case), *ends, "--fitted", str(tmp_path), *common) == 0
    assert run("modes", str(case), *common, "--no-pictures") == 0
    few = ["--draws", "2000"]  # which it says: 4
    assert run("sample", str(case), *few, *common) in (0, 4)
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
