"""How far long work is: stages with their names, elapsed and left told apart."""

from __future__ import annotations

import logging

import pytest

from tyrecal.cli import terminal
from tyrecal.cli.terminal import Progress, Terminal


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
