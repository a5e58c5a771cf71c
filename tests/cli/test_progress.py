"""Progress of long work, and --dry-run: how far it is, and how much it would be."""

from __future__ import annotations

import json
import logging
from pathlib import Path

import pytest

from tyrecal.cli import terminal
from tyrecal.cli.terminal import Progress, Terminal
from tyrecal.simulate.evaluate.evaluator import Evaluator

from ..conftest import CASES
from .test_cli import run
from .test_conventions import CASE, COARSE, commands


class Clock:
    now = 0.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(terminal, "time", clock)
    return clock


def test_nothing_is_left_until_something_is_done(clock: Clock) -> None:
    progress = Progress("fit")
    progress.at(0, 4)
    clock.now = 15.0
    assert progress.clock(clock.now) == "0:15 elapsed"
    progress.at(1, 4)
    assert progress.clock(clock.now) == "0:15 elapsed, 0:45 left"
    progress.at(4, 4)
    assert progress.clock(clock.now) == "0:15 elapsed"


def test_a_stage_has_a_name_a_place_and_a_rest_of_its_own(clock: Clock) -> None:
    lines: list[str] = []
    progress = Progress("diagnose", ["calibrate", "map"], lines.append)
    progress.begin("calibrate")
    progress.at(0, 95)
    clock.now = 100.0
    progress.begin("map")
    progress.at(0, 4)
    clock.now = 131.0
    progress.at(1, 4)
    assert lines == [
        "stage 1 of 2, calibrate ...",
        "stage 2 of 2, map ...",
        "stage 2 of 2, map, 1 of 4 done, 2:11 elapsed, 1:33 left in this stage",
    ]


def test_further_pieces_of_a_stage_are_counted_on_top(clock: Clock) -> None:
    """One count for all, however many batches of evaluations it is made of."""
    lines: list[str] = []
    progress = Progress("weigh effects", (), lines.append)
    for piece in range(3):
        progress.at(0, 4)
        for done in range(1, 5):
            clock.now += 40.0
            progress.at(done, 4)
        assert lines[-1] == f"weigh effects, {4 * (piece + 1)} of {4 * (piece + 1)} done, " + (
            f"{(160 * (piece + 1)) // 60}:{(160 * (piece + 1)) % 60:02d} elapsed"
        )
    assert [int(line.split(", ")[1].split()[0]) for line in lines] == list(range(1, 13))


def test_lines_come_now_and_then_only(clock: Clock) -> None:
    lines: list[str] = []
    progress = Progress("footprint", (), lines.append)
    progress.begin("")
    for second in range(0, 100, 5):
        clock.now = float(second)
        progress.at(second, 1000)
    progress.within(1, 3)
    clock.now = 131.0
    progress.within(2, 3)
    assert lines == [
        "footprint ...",
        "footprint, 35 of 1000 done, 0:35 elapsed, 16:05 left",
        "footprint, 70 of 1000 done, 1:10 elapsed, 15:30 left",
        "footprint, load 3 of 3, 95 of 1000 done, 2:11 elapsed, 20:38 left",
    ]


@pytest.mark.parametrize("quiet", [True, False])
def test_where_nobody_watches_a_line_a_stage(
    quiet: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """On standard error, beside JSON too; nothing with --quiet."""
    with Terminal(as_json=True, quiet=quiet).progress("diagnose", ["one", "two"]) as progress:
        progress.begin("one")
        progress.begin("two")
    printed = capsys.readouterr()
    assert printed.out == ""
    lines = ["stage 1 of 2, one ...", "stage 2 of 2, two ..."]
    assert printed.err.splitlines() == ([] if quiet else lines)


def test_what_is_reached_on_the_way_to_a_load_is_told(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with Terminal().progress("footprint") as bar:
        bar.at(0, 1)
        clock.now = 100.0
        logging.getLogger(terminal.SOLVERS).info("28000 of 400000 N are reached (90 of 142 mm)")
    assert "28000 of 400000 N are reached" in capsys.readouterr().err


def test_a_load_that_the_solver_reaches_moves_the_bar(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with Terminal().progress("footprint") as bar:
        bar.at(0, 2)
        clock.now = 100.0
        logging.getLogger(terminal.SOLVERS).info("1 of 4", extra={"loads": (1, 4)})
    assert (
        "footprint, load 2 of 4, 0 of 2 done, 1:40 elapsed, 11:40 left" in capsys.readouterr().err
    )


MEASURED = str(CASES / "p235_75r17_wheeler.csv")


STUDIES = {  # of each command with --dry-run: the words that a run needs
    "fit": ["fit", CASE],
    "modes": ["modes", CASE, "--load-N", "4000"],
    "sweep-pressure": ["sweep-pressure", CASE],
    "sweep": ["sweep", CASE, "--latin-hypercube", "7"],
    "footprint": ["footprint", CASE],
    "sensitivities": ["sensitivities", CASE, "--of", "contact_area", "--measured", MEASURED],
    "frf": ["frf", CASE],
    "stiffness": ["stiffness", CASE],
    "effects": ["effects", "--case", CASE],
    "sample": ["sample", CASE, "--measured", MEASURED],
    "diagnose": ["diagnose", CASE, "--measured", MEASURED],
    "plan": ["plan", CASE],
    "blind power": ["blind", "power", CASE],
    "measured sensors": ["measured", "sensors", CASE, "--place", "8"],
    "measured label": ["measured", "label", CASE, "unlabelled.csv"],
}


# whose number of runs does not depend on what they find
COUNTED = {
    "modes": ["modes", CASE, "--set", "pressure_kPa=200"],
    "sweep-pressure": ["sweep-pressure", CASE, "--steps", "3", "--no-pictures"],
    "sweep": ["sweep", CASE, "C10=9e5:1.1e6:3", "pressure_kPa=240:280:2", "--no-pictures"],
    "sensitivities": ["sensitivities", CASE, "--by", "C10,pressure_kPa", "--no-pictures"],
    "effects": ["effects", "rim_width", "--case", CASE, "--no-pictures"],
}


def test_every_study_has_it() -> None:
    with_option = {
        name
        for name, command in commands().items()
        if any("--dry-run" in param.opts for param in command.params)
    }
    assert with_option == {*STUDIES}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name, marks=[pytest.mark.slow] * (name in ("sample", "diagnose", "blind power"))
        )
        for name in STUDIES
    ],
)
def test_it_states_runs_and_time_and_does_nothing(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither the solver runs nor does the folder, or the one for results, get any file."""
    monkeypatch.chdir(tmp_path)
    table = tmp_path / "unlabelled.csv"
    table.write_text("label,frequency_Hz,sigma_Hz,pressure_kPa,load_N,rim\n,66.1,0.3,240,0,\n")
    for way in ("evaluate", "press"):
        monkeypatch.setattr(Evaluator, way, lambda *_: pytest.fail("the solver runs"))
    assert run(*STUDIES[name], *COARSE, "--dry-run", "--json") == 0
    plan = json.loads(capsys.readouterr().out)
    assert plan["runs"] > 0 and plan["seconds"] > 0
    assert name != "sweep" or plan["designs"] == 7  # points of the Latin hypercube
    assert run(*STUDIES[name], *COARSE, "--dry-run") == 0
    printed = capsys.readouterr().out
    assert f"{plan['runs']} run" in printed and "in the solver" in printed
    assert [*tmp_path.iterdir()] == [table]


@pytest.mark.slow
@pytest.mark.parametrize("name", COUNTED)
def test_as_many_runs_as_it_states(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [*COUNTED[name], *COARSE, "--output", str(tmp_path / "out")]
    assert run(*words, "--dry-run", "--json") == 0
    stated = json.loads(capsys.readouterr().out)["runs"]
    assert run(*words, "--quiet") == 0
    (entry,) = json.loads((tmp_path / "out/run.json").read_text()).values()
    assert entry["solver_runs"] == stated
