"""tyrecal blind: words and exit codes where a step is out of order; a study from end to end."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tyrecal.studies.blind.seal import ANSWERS, SEAL, TRUTH
from tyrecal.studies.inference.effect_ranges import effect_ranges

from .test_cli import run
from .test_diagnose import coarse  # noqa: F401  the main case with a coarse mesh

COUNTS = ["--effects", "1", "--none", "1", "--outside", "0"]


def refused(*command: str) -> bool:
    return run("blind", *command) == 2


def test_steps_out_of_order_are_refused(
    coarse: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
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
    coarse: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    few = {
        "PLAIN_DEGREE": 2,
        "PLAIN_DESIGNS": 4,
        "SOURCE_DEGREE": 1,
        "SOURCE_DESIGNS": 4,
        "EFFECT_DEGREE": 1,
        "EFFECT_DESIGNS": 2,
        "ONE_SIDED_SHARES": (0.5, 1.0),
    }
    for name, value in few.items():
        monkeypatch.setattr(f"tyrecal.studies.blind.emulated.{name}", value)
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
