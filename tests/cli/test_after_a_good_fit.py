"""Whatever fails after a good fit, in its folder: every file of the fit stays, byte for byte.

Bare `tyrecal sweep-pressure` and `tyrecal footprint`: the last fit here, or the only case.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import click
import pytest

from tyrecal.cli.default_case import default_case
from tyrecal.cli.options import Study
from tyrecal.cli.terminal import Terminal
from tyrecal.files import results
from tyrecal.simulate.case_folder import owner
from tyrecal.simulate.evaluate.evaluator import Evaluator
from tyrecal.simulate.evaluate.failure import EvaluationFailed
from tyrecal.tyre.load import load_case

from ..conftest import CASES
from .test_cli import run

HEADER = "quantity,c,m,kind,member,pressure_kPa,load_N,value,sigma\n"
TWO_MODES = HEADER + "frequency_Hz,2,0,,,240,0,79.5,0.4\nfrequency_Hz,2,1,,,240,0,66.1,0.4\n"
ROAD = HEADER + "contact_area_m2,,,,,240,4000,0.02,0.001\n"


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with a case and the results of its fit."""
    project = tmp_path_factory.mktemp("project")
    for name in ("p235_75r17.yaml", "p235_75r17.csv"):
        shutil.copy(CASES / name, project)
    case = project / "p235_75r17.yaml"
    text = case.read_text().replace("level: default", "level: coarse")
    case.write_text(text.replace("static_increments: 10", "static_increments: 5"))
    (project / "two.csv").write_text(TWO_MODES)
    (project / "wrong.csv").write_text(HEADER + "frequency_Hz,2,0,,,240,0,79500,0.4\n")
    (project / "other.csv").write_text(TWO_MODES.replace("240", "200"))
    (project / "road.csv").write_text(ROAD)
    (project / "broken.yaml").write_text(text.replace("C10_Pa", "C10_MPa"))
    (project / "old.json").write_text('{"variables": {}, "fixed": {"A_belt": 1}}')
    out = ["--output", str(project / "out"), "--quiet"]
    assert run("fit", str(case), "--fix", "A_carcass", *out) == 0
    assert (project / "out/fit_modes.png").exists()
    return project


Break = Callable[[pytest.MonkeyPatch], None]


def nothing(patch: pytest.MonkeyPatch) -> None:
    """The command line alone is wrong."""


def crash(patch: pytest.MonkeyPatch) -> None:
    """The solver dies."""

    def fails(evaluator: Evaluator, *question: object) -> None:
        raise EvaluationFailed("crashed", "the licence was eaten")

    patch.setattr(Evaluator, "evaluate", fails)


def interrupt(patch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the middle."""

    def stops(evaluator: Evaluator, *question: object) -> None:
        raise KeyboardInterrupt

    patch.setattr(Evaluator, "evaluate", stops)


def full_disc(patch: pytest.MonkeyPatch) -> None:
    """The last result cannot be written."""

    def fails(*arguments: object) -> None:
        raise OSError(28, "No space left on device", "fit_history.csv")

    patch.setattr("tyrecal.studies.fit.study.history_csv", fails)


def no_picture(patch: pytest.MonkeyPatch) -> None:
    """Pictures fail when all else is written."""

    def fails(*arguments: object) -> None:
        raise OSError(28, "No space left on device", "convergence.png")

    patch.setattr("tyrecal.report.pictures.draw_convergence", fails)


def unmoved(patch: pytest.MonkeyPatch) -> None:
    """The optimiser gives up where it starts."""
    from tyrecal.studies.fit import calibrate, search

    def stays(problem: object, point: Any, *more: object) -> search.Descent:
        return search.Descent(point, "gave up")

    patch.setitem(calibrate.METHODS, "slsqp", stays)


KINDS: dict[str, tuple[list[str], int, Break]] = {
    "too few targets": (["fit", "--measured", "two.csv"], 2, nothing),
    "nothing free": (
        ["fit", *(w for v in ("A_belt", "A_carcass", "C10") for w in ("--fix", v))],
        2,
        nothing,
    ),
    "no such variable": (["fit", "--fix", "C11"], 2, nothing),
    "start out of bounds": (["fit", "--set", "C10=1e9"], 2, nothing),
    "no such number": (["fit", "--set", "materials.rubber.C10=1"], 2, nothing),
    "an impossible number": (["fit", "--set", "materials.rubber.density_kg_per_m3=-1"], 2, nothing),
    "no such mesh": (["fit", "--mesh", "fine"], 2, nothing),
    "no such solver": (["fit", "--solver", "nastran"], 2, nothing),
    "measured in another unit": (["fit", "--measured", "wrong.csv"], 2, nothing),
    "measured elsewhere": (["fit", "--measured", "other.csv"], 2, nothing),
    "two options that exclude": (["fit", "--jobs", "2", "--scheduler", "x"], 2, nothing),
    "a broken case": (["fit", "broken.yaml"], 2, nothing),
    "another case": (["fit", str(CASES / "205_60r15.yaml")], 2, nothing),
    "the solver dies": (["fit"], 3, crash),
    "an old fit": (["sweep-pressure", "--fitted", "old.json"], 2, nothing),
    "another tyre": (
        [
            "footprint",
            "--compare",
            "fitted",
            "--loads-N",
            "500",
            "--set",
            "rebar_layers.belt_1.angle_deg=70.07",
        ],
        2,
        nothing,
    ),
    "modes of no tyre": (["modes", "--pictures"], 3, crash),
    "a sweep of no tyre": (["sweep-pressure", "--steps", "2"], 3, crash),
    "a diagnosis of a road": (["diagnose", "--measured", "road.csv"], 2, nothing),
    "interrupted": (["fit"], 130, interrupt),
    "a full disc": (["fit"], 2, full_disc),
    "a full disc under a picture": (["fit"], 2, no_picture),
    "a fit that stays where it starts": (["fit"], 4, unmoved),
}


DRAWN = ("a full disc under a picture", "a fit that stays where it starts")


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=pytest.mark.slow if kind in DRAWN else ()) for kind in KINDS]
)
def test_the_good_fit_stays(
    kind: str, good: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words, code, spoil = KINDS[kind]
    monkeypatch.chdir(good)
    before = contents(good / "out")
    assert {"fit.json", "fit_modes.png", "fit_mode_2_1.vtu", "fit_shapes.json"} <= set(before)
    spoil(monkeypatch)
    command, *rest = words
    case = [] if rest and rest[0].endswith(".yaml") else ["p235_75r17.yaml"]
    assert run(command, *case, *rest, "--output", "out") == code, capsys.readouterr()
    assert contents(good / "out") == before
    assert "Traceback" not in capsys.readouterr().err
    assert not list((good / "out").glob(".new-*")) and not (good / "out/previous").exists()
    facts = json.loads((good / "out/run.json").read_text())
    if code == 2 and spoil is nothing:  # a mistake is found before anything is begun
        assert facts["fit"]["finished"] and facts["fit"].get("results") is None
    elif command == "fit":
        assert facts["fit"]["finished"] == (code == 4)
    if code == 4:
        assert facts["fit"]["results"] == "not_converged"
        assert json.loads((good / "out/not_converged/fit.json").read_text())["moved"] is False
    facts["fit"] |= {"finished": True}  # for the next kind
    facts["fit"].pop("results", None)
    (good / "out/run.json").write_text(json.dumps(facts))


def contents(folder: Path) -> dict[str, bytes]:
    """The files of the fit."""
    return {path.name: path.read_bytes() for path in results(folder, "fit")}


@pytest.mark.parametrize("place", ["draw_fit", "next_states"])
def test_what_fails_after_a_fit_does_not_lose_it(
    good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    """Its pictures, and the states that it would propose to measure."""

    def fails(*arguments: object) -> None:
        raise ValueError("cannot reshape array")

    module = {
        "draw_fit": "tyrecal.report.pictures",
        "next_states": "tyrecal.studies.fit.build_result",
    }
    monkeypatch.setattr(f"{module[place]}.{place}", fails)
    rows = TWO_MODES + TWO_MODES.removeprefix(HEADER).replace("240", "200")
    (tmp_path / "states.csv").write_text(rows)
    case = str(good / "p235_75r17.yaml")
    out = ["--output", str(tmp_path / "out"), "--quiet", "--fix", "A_carcass", "--fix", "A_belt"]
    measured = ["--measured", str(tmp_path / "states.csv")]
    ask = partial(run, "fit", case, *measured, *out)
    if place == "draw_fit":
        with pytest.raises(ValueError, match="cannot reshape"):  # a fault of tyrecal
            ask()
    else:
        assert ask("--no-pictures") == 0
    result = json.loads((tmp_path / "out/fit.json").read_text())
    error = result.get("next_states_error", "")
    assert len(result["states"]) == 2 and ("cannot reshape" in error) == (place == "next_states")


STUDY = Study(Terminal())


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("p235_75r17.yaml", "p235_75r17.csv"):
        shutil.copy(CASES / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def fit(folder: Path, case: Path, started: str, good: bool = True) -> None:
    """Write the traces of a fit: its entry in run.json, and whether it converged."""
    folder.mkdir(exist_ok=True)
    loaded = load_case(case) if case.exists() else None
    entry = {**owner(folder, case, loaded), "command": "fit", "started": started, "finished": True}
    (folder / "run.json").write_text(json.dumps({"fit": entry}))
    (folder / "fit.json").write_text(json.dumps({"converged": good, "moved": good}))


def test_the_only_case_is_taken_and_named(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "jobs.yaml").write_text("queue: long\n")  # no case
    assert default_case(None, STUDY) == (Path("p235_75r17.yaml"), STUDY)
    assert capsys.readouterr().err == "p235_75r17.yaml, the only case here\n"


def test_several_cases_or_none_are_refused_with_a_list(here: Path) -> None:
    shutil.copy(here / "p235_75r17.yaml", here / "b.yaml")
    with pytest.raises(click.UsageError, match=r"several here: b\.yaml, p235_75r17\.yaml"):
        default_case(None, STUDY)
    for path in here.glob("*.yaml"):
        path.unlink()
    with pytest.raises(click.UsageError, match="no fit and no case here"):
        default_case(None, STUDY)


def test_the_last_fit_that_converged_is_taken_with_its_case(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = here / "b.yaml"
    shutil.copy(here / "p235_75r17.yaml", other)
    fit(here / "old", other, "2026-01-01T10:00:00+00:00")
    fit(here / "new", here / "p235_75r17.yaml", "2026-01-02T10:00:00+00:00")
    fit(here / "failed", other, "2026-01-03T10:00:00+00:00", good=False)
    fit(here / "gone", here / "none.yaml", "2026-01-03T10:00:00+00:00")
    case, study = default_case(None, STUDY)
    assert (case, study.fitted) == (Path("p235_75r17.yaml"), Path("new/fit.json"))
    assert study.output == Path("new")
    notes = capsys.readouterr().err
    assert "p235_75r17.yaml, with the fit in 'new'" in notes
    assert "failed" not in notes and "gone" not in notes
    old = replace(STUDY, fitted=Path("old/fit.json"))
    assert default_case(None, old) == (Path("b.yaml"), replace(old, output=Path("old")))
    assert default_case(other, STUDY) == (other, STUDY)


def test_a_fit_whose_case_is_not_at_its_place_needs_the_case(here: Path) -> None:
    fit(here / "results", here / "none.yaml", "2026-01-01T10:00:00+00:00")
    with pytest.raises(click.UsageError, match="the case of 'results' is not at its place"):
        default_case(None, replace(STUDY, fitted=Path("results")))


def test_a_case_of_an_own_deck_is_one(here: Path) -> None:
    (here / "p235_75r17.yaml").unlink()
    shutil.copytree(CASES / "ring_3d", here, dirs_exist_ok=True)
    assert default_case(None, STUDY)[0] == Path("ring.yaml")


@pytest.mark.slow
def test_the_users_card(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """fit, then the studies without a word more; both designs, in the fit's folder."""
    coarse = ["--mesh", "coarse", "--no-pictures"]
    assert run("fit", "p235_75r17.yaml", *coarse) == 0
    assert run("sweep-pressure", *coarse, "--steps", "2") == 0
    assert run("footprint", *coarse, "--loads-N", "300") == 0
    assert capsys.readouterr().err.count("p235_75r17.yaml, with the fit in 'p235_75r17'") == 2
    for name in ("pressure_sweep.json", "footprint.json"):
        rows = json.loads((here / "p235_75r17" / name).read_text())["rows"]
        assert {row["design"] for row in rows} == {"initial", "fitted"}
