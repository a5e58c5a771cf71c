"""Evaluated footprints: the same from the record, nothing believed that is not whole."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, PressQuestion, Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.store import Store

from ..studies.hertz import Hertz
from . import stand_in
from .stand_in import CASE

LOADS = (500.0, 4000.0)


def evaluator(folder: Path, **changes: Any) -> Evaluator:
    solver = Hertz()
    for name, value in changes.items():
        setattr(solver, name, value)
    return Evaluator(
        TyreDesign(CASE), folder=folder / "runs", store=Store(folder / "record"), _solver=solver
    )


def test_the_record_answers_the_same_and_other_loads_are_another_question(tmp_path: Path) -> None:
    first, second = evaluator(tmp_path), evaluator(tmp_path)
    run, recorded = first.press({}, LOADS), second.press({}, LOADS)
    assert (first.counts.runs, second.counts.runs, second.counts.recorded) == (1, 0, 1)
    for one, other in zip(run.footprints, recorded.footprints, strict=True):
        for name, value in vars(one).items():
            assert np.array_equal(value, getattr(other, name)), name
    second.press({}, LOADS[:1])
    assert second.counts.runs == 1
    assert not list((tmp_path / "runs").iterdir())


def test_a_load_not_reached_is_on_record_and_its_run_is_kept(tmp_path: Path) -> None:
    first = evaluator(tmp_path, reach=1e3).press({}, LOADS)
    assert first.failed and first.failed.folder and first.failed.folder.exists()
    assert (first.failed.folder / "press.inp").exists()
    again = evaluator(tmp_path)
    recorded = again.press({}, LOADS)
    assert again.counts.runs == 0 and len(recorded.footprints) == 1
    assert recorded.failed and recorded.failed.words == first.failed.words


def test_time_that_ran_out_is_not_on_record(tmp_path: Path) -> None:
    slow = evaluator(tmp_path, reach=1e3)
    read = slow.solver.read
    slow.solver.read = lambda folder: {**read(folder), "cause": "timed_out"}  # type: ignore[method-assign]
    pressed = slow.press({}, LOADS)
    assert pressed.failed and pressed.failed.cause == "timed_out"
    again = evaluator(tmp_path)
    assert again.press({}, LOADS).failed is None and again.counts.runs == 1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda answer: answer["footprints"].pop(), "footprints at"),
        (lambda answer: answer["footprints"].clear(), "at least 1 item"),
        (lambda answer: answer.update(footprints=[], failure="no load"), "at least 1 item"),
        (lambda answer: answer["footprints"].reverse(), "footprints at"),
        (lambda answer: answer.update(failure="no more"), "footprints at"),
        (lambda answer: answer["footprints"][0].update(road_N=400.0), "bears 400 N of 500 N"),
        (lambda answer: answer["footprints"][0].update(road_N=494.0), "bears 494 N of 500 N"),
        (lambda answer: answer["footprints"][1].update(road_N=4045.0), "bears 4045 N of 4000"),
        (
            lambda answer: answer["footprints"][0].update(road_N=float("nan")),
            "road_N: holds a number that is not finite",
        ),
    ],
)
def test_answers_that_are_not_whole(change: Any, words: str, tmp_path: Path) -> None:
    wrong = evaluator(tmp_path)
    read = wrong.solver.read

    def changed(folder: Path) -> dict[str, Any]:
        answer = read(folder)
        change(answer)
        return answer

    wrong.solver.read = changed  # type: ignore[method-assign]
    with pytest.raises(EvaluationFailed, match=words) as failure:
        wrong.press({}, LOADS)
    assert failure.value.cause == "no_results"
    assert failure.value.folder and failure.value.folder.exists()
    assert not list((tmp_path / "record").glob("*/*"))


def test_each_load_has_the_time_of_a_run(tmp_path: Path) -> None:
    subject = evaluator(tmp_path)
    limits: list[float] = []
    subject.solver.run = lambda folder, limit: limits.append(limit)  # type: ignore[method-assign]
    subject.press({}, LOADS)
    subject.press({}, LOADS[:1])
    assert limits == [600.0, 300.0] == [n * CASE.case.solver.time_limit_s for n in (2, 1)]


def test_modes_on_a_road_are_another_capability_than_a_footprint(tmp_path: Path) -> None:
    plain = evaluator(tmp_path, capabilities=frozenset({"modes", "footprint"}))
    plain.needs_road()
    with pytest.raises(DeckRefused, match=r"find modes of a tyre on a road.*\(loaded_modes\)"):
        plain.needs_road(modes=True)
    none = evaluator(tmp_path, capabilities=frozenset({"modes", "loaded_modes"}))
    none.needs_road(modes=True)
    with pytest.raises(DeckRefused, match=r"press a tyre on a road.*\(footprint\)"):
        none.needs_road()


def test_unless_asked_otherwise_all_is_done_in_this_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "tyrecal.simulate.evaluate.evaluator.executor", lambda *arguments: pytest.fail("elsewhere")
    )
    subject = evaluator(tmp_path)
    assert (
        len(list(subject.press_all([PressQuestion({}, LOADS), PressQuestion({"C10": 9e5}, LOADS)])))
        == subject.counts.runs
        == 2
    )
    assert (
        len(list(subject.press_all([PressQuestion({}, LOADS)], jobs=2))) == 1
    )  # one design needs no other
    questions = [Question({"C10": value}) for value in (1e6, 2e6)]
    plain = stand_in.evaluator(tmp_path / "plain")
    assert len(list(plain.evaluate_all(questions))) == len(list(plain.answer_all(questions))) == 2


def test_a_tyre_that_finds_no_equilibrium_ends_with_the_line_that_helps(tmp_path: Path) -> None:
    """A tyre that is flat on its rim has another cause, and the line is not printed."""
    pressing = evaluator(tmp_path, reach=1e3)
    read = pressing.solver.read
    buckled = {"failure": "no equilibrium between 1000 and 4000 N: the cords of layer BELT buckle"}
    pressing.solver.read = lambda folder: {**read(folder), **buckled}  # type: ignore[method-assign]
    pressed = pressing.press({}, LOADS)
    assert pressed.failed and pressed.failed.words.startswith(buckled["failure"] + "; cords of ")
    assert pressed.failed.words.endswith("materials.carcass_cord.bears_compression: false")
    flat = evaluator(tmp_path / "flat", reach=1e3).press({}, LOADS)
    assert flat.failed and "bears_compression" not in flat.failed.words
