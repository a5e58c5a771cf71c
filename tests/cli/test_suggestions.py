"""A slip of the hand is told what was probably meant, always in the same words."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ..conftest import CASES
from .test_cli import CASE, run

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
