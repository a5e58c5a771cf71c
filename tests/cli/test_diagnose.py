"""tyrecal diagnose and tyrecal blind: files, words, exit codes, a case with an effect added."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import Label, paired_labels
from tyrecal.studies.blind.protocol import ANSWERS, SEAL, TRUTH
from tyrecal.studies.inference.effect_ranges import effect_ranges
from tyrecal.tyre.case import start_values
from tyrecal.tyre.load import load_case

from ..solvers.test_abaqus import COARSE
from .test_cli import run

HEADER = "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma"


EFFECTS = ["--effect", "bead_filler", "--effect", "pressure_offset"]


FILES = ("diagnosis.json", "diagnosis.md", "diagnosis_section.json")


PICTURES = ("residuals", "probabilities", "held_out", "section")


@pytest.fixture
def coarse(case_folder: Path) -> Path:
    """The main case with a coarse mesh, its section that of the model which makes the data."""
    path = case_folder / "p235_75r17.yaml"
    text = path.read_text().replace("\n    default:\n", COARSE)
    text = text.replace("known_from: size_code", "known_from: exact")
    path.write_text(text.replace("level: default", "level: small"))
    return path


def measured(case: Path, path: Path, **effects: float) -> Path:
    """The case's own frequencies with effects, at two pressures, to three digits."""
    loaded = load_case(case)
    lines = [HEADER]
    for p in (180.0, 240.0):
        values = {**start_values(loaded), "pressure_kPa": p}
        values |= {f"effects.{id}": e for id, e in effects.items()}
        for mode in paired_labels(Evaluator(TyreDesign(loaded)).evaluate(Question(values)).modes):
            label = mode.label
            if label.m < 2 and (label.c or label.kind) and label != Label(4, 1):
                f = mode.frequency_Hz
                lines.append(
                    f"frequency_Hz,{label.c},{label.m},{label.kind or ''},,{p:g},0,"
                    f"{f:.3f},{0.001 * f:.3f}"
                )
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.slow
def test_a_diagnosis_in_files_and_again_from_the_record(
    coarse: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = measured(coarse, tmp_path / "m.csv", bead_filler=2.0), tmp_path / "out"
    command = ["diagnose", str(coarse), "--measured", str(file), *EFFECTS, "--output", str(out)]
    assert run(*command, "--json") == 0
    printed = capsys.readouterr()
    diagnosis = json.loads(printed.out)
    assert diagnosis == json.loads((out / "diagnosis.json").read_text())
    assert diagnosis["verdict"] == "named" and diagnosis["effect"] == "bead_filler"
    assert diagnosis["parameter"]["low"] < 2.0 < diagnosis["parameter"]["high"]
    assert "cannot prove a cause" in printed.err or diagnosis["rung"] == 4
    for name in PICTURES:
        assert (out / f"diagnosis_{name}.png").stat().st_size > 3000
    before = {name: (out / name).read_bytes() for name in FILES}
    assert run(*command, "--quiet", "--no-pictures", "--jobs", "2", "--report") == 0
    assert capsys.readouterr().out == ""
    assert {name: (out / name).read_bytes() for name in FILES} == before
    assert json.loads((out / "run.json").read_text())["diagnose"]["solver_runs"] == 0
    assert "Bead filler" in (out / "report.html").read_text()


@pytest.mark.slow
def test_frequencies_without_labels_are_evidence(
    coarse: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two modes without labels: told beside what is named, in file and page."""
    file, out = measured(coarse, tmp_path / "m.csv", bead_filler=2.0), tmp_path / "out"
    lines = [line for line in file.read_text().splitlines() if ",180," not in line]
    bare = [re.sub(r"_Hz,[23],1,", "_Hz,,,", line) for line in lines]
    file.write_text("\n".join(bare) + "\n")
    given = ["--measured", str(file), *EFFECTS[:2], "--no-pictures", "--output", str(out)]
    assert run("diagnose", str(coarse), *given, "--json") == 0
    diagnosis = json.loads(capsys.readouterr().out)
    assert diagnosis["verdict"] == "named" and diagnosis["effect"] == "bead_filler"
    assert diagnosis["parameter"]["low"] < 2.0 < diagnosis["parameter"]["high"]
    labels = [each for each in diagnosis["labels"]["frequencies"] if each["probability"] > 0.9]
    assert [(each["c"], each["m"]) for each in labels] == [(2, 1), (3, 1)]
    assert "## Which labels?" in (out / "diagnosis.md").read_text()


@pytest.mark.slow
def test_what_was_measured_under_load_is_compared(
    coarse: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Areas and stiffnesses of the tyre with the effect: the calibrated one misses them, the one
    with the effect that frequencies alone have named does not."""
    file, out = measured(coarse, tmp_path / "m.csv", bead_filler=2.0), tmp_path / "out"
    loaded, loads = load_case(coarse), [200.0, 500.0]
    pressed = Evaluator(TyreDesign(loaded)).press(
        {**start_values(loaded), "effects.bead_filler": 2.0}, loads
    )
    with file.open("a") as lines:
        for each in pressed.footprints:
            f = each.stiffness_N_per_m
            at = f",,,,,240,{each.load_N:g},"
            lines.write(f"vertical_stiffness_N_per_m{at}{f:.0f},{0.01 * f:.0f}\n")
            area = each.contact_area_m2
            lines.write(f"contact_area_m2{at}{area:.8f},{0.01 * area:.8f}\n")
    command = ["diagnose", str(coarse), "--measured", str(file), *EFFECTS, "--output", str(out)]
    assert run(*command, "--no-pictures", "--report") == 0
    diagnosis = json.loads((out / "diagnosis.json").read_text())
    road = diagnosis["under_load"]
    assert diagnosis["effect"] == road["effect"] == "bead_filler" and not diagnosis["left_out"]
    assert [row["load_N"] for row in road["rows"]] == [200, 200, 500, 500] and not road["failed"]
    assert road["effect_rms_percent"] < 0.3 * road["calibrated_rms_percent"]
    assert set(diagnosis["gap"]["by_load"]) == {"200", "500"}
    words = (out / "diagnosis.md").read_text()
    assert "Measurements under load were not fitted" in words
    off = road["rows"][1]["calibrated_percent"]
    stiffness = road["rows"][1]["measured"] / 1000
    assert f"| 240 | 200 | vertical stiffness {stiffness:.1f} N/mm ± 1.0 % | {off:+.1f} |" in words


def test_an_added_effect_makes_a_case(
    coarse: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("diagnose", str(coarse), "--add", "bead_filler=1.5") == 0
    new = coarse.with_name(f"{coarse.stem}_bead_filler.yaml")
    assert load_case(new).case.effects["bead_filler"] == 1.5
    assert run("validate", str(new)) == 0
    assert run("diagnose", str(coarse), "--add", "bead_filler=1.5") == 2
    assert "exists already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "--measured FILE must be given"),
        (["--measured", "none.csv"], "none.csv"),
        (["--measured", "M", "--effect", "magic"], "--effect magic: there is no such effect"),
        (["--measured", "M", "--toggled", "M", "magic=0"], "there is no effect 'magic'"),
        (["--measured", "M", "--toggled", "M", "bead_filler=nan"], "must be a number"),
        (["--measured", "M", "--toggled", "M", "bead_filler*1"], "changes nothing"),
        (["--measured", "M", "--effect", "belt_width", "--without", "belt_width"], "no effect"),
        (["--add", "bead_filler=1", "--set", "C10=1.1e6"], "no --set"),
        (["--add", "bead_filler=1", "--measured", "M"], "no --measured"),
        (["--measured", "BAD"], "line 2"),
        (["--measured", "M", "--set", "A_belt=5e-8"], "must start within its bounds"),
        (["--add", "magic=1"], "magic"),
        (["--add", "bead_filler"], "NAME=VALUE"),
        (["--add", "bead_filler=-5"], "bead_filler"),
    ],
)
def test_wrong_input(
    coarse: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], words: str
) -> None:
    good, bad = tmp_path / "m.csv", tmp_path / "bad.csv"
    good.write_text(HEADER + "\nfrequency_Hz,2,0,,,240,0,79.5,0.2\n")
    bad.write_text(HEADER + "\nfrequency_Hz,2,0,,,240,0,79.5,0\n")
    names = {"M": str(good), "BAD": str(bad)}
    given = [names.get(word, word) for word in options]
    assert run("diagnose", str(coarse), *given, "--output", str(tmp_path / "out")) == 2
    printed = capsys.readouterr()
    assert words in printed.err and "Traceback" not in printed.err


COUNTS = ["--effects", "1", "--none", "1", "--outside", "0"]


def refused(*command: str) -> bool:
    return run("blind", *command) == 2


def test_steps_out_of_order_are_refused(
    coarse: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, case = str(tmp_path / "t"), str(coarse)
    for command, words in (
        (["answer", out], "seal.json is missing"),
        (["score", out], "answers.json is missing"),
        (
            ["make", out, "--case", case, "--effects", "0", "--none", "0", "--outside", "0"],
            "at least one trial",
        ),
        (
            ["make", out, "--case", case, "--effect", "luck"],
            "there is no such effect of these trials",
        ),
        (["make", out, "--case", case, *COUNTS, "--truth", out + "/truth"], "must not be in"),
        (["answer", out, "--effect", "luck"], "--effect luck: there is no such effect; known: "),
    ):
        assert refused(*command), command
        assert words in capsys.readouterr().err


@pytest.mark.slow
def test_a_study_from_end_to_end(
    coarse: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    only = lambda case, evaluator, ids=None: effect_ranges(case, evaluator, ["spindle_lateral"])
    monkeypatch.setattr("tyrecal.studies.blind.answer.effect_ranges", only)  # the ruler's, too
    out = tmp_path / "t"
    make = [
        "make",
        str(out),
        "--case",
        str(coarse),
        *COUNTS,
        "--effect",
        "spindle_lateral",
        "--seed",
        "3",
        "--quiet",
    ]
    assert run("blind", *make) == 0
    assert (out / SEAL).exists() and not list(out.rglob(TRUTH))
    capsys.readouterr()
    assert run("blind", "answer", str(out), "--effect", "spindle_lateral", "--json") == 0
    answered = json.loads(capsys.readouterr().out)
    sealed = json.loads((out / ANSWERS).read_text())["sha256"]
    assert answered == {"folder": str(out), "sha256": sealed}
    assert run("blind", "score", str(out), "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((out / "score.json").read_text())
    assert printed["trials"] == {"effect": 1, "none": 1, "outside": 0}
    assert "inverse crime" in (out / "score.md").read_text()
    assert refused(*make)
