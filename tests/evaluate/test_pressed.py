"""Evaluated footprints: the same from the record, nothing believed that is not whole.

Derivatives of the pressed tyre by the design variables, against differences of whole presses.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, PressQuestion, Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.store import Store
from tyrecal.tyre.load import load_case

from ..studies.hertz import Hertz, coarse_case
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
        (
            lambda answer: answer["footprints"][0].update(
                displacement_slopes=np.zeros((1, 2, 3, 3))
            ),
            "sensitivities of a displacement are not this tyre's",
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


NAMES = ("deflection_m", "stiffness_N_per_m", "contact_area_m2", "contact_length_m")
NAMES += ("contact_width_m",)
# cords, rubber, geometry, pressure, and the road's own
MORE = """
  wear: {sets: [effects.tread_wear], start: 1.0e-2, lower: 1.0e-3, upper: 1.0e-1}
  p: {sets: [pressure_kPa], start: 240.0, lower: 100.0, upper: 400.0}
  k: {sets: [road.stiffness_Pa_per_m], start: 1.0e+9, lower: 1.0e+8, upper: 1.0e+10}
  mu: {sets: [road.friction], start: 0.5, lower: 0.1, upper: 1.0}
"""
# by which the logarithm of each moves: rubber, geometry, pressure, and the road's own
ALONG = {"C10": 0.8, "wear": 5.0, "p": -0.4, "k": 1.0, "mu": -1.5}
STEP = 1e-4


def small_case(folder: Path) -> Path:
    """The main case, pressed in half a second, with more variables."""
    path = coarse_case(folder)
    text = path.read_text().replace("[6, 6, 6, 12, 30, 120]", "[10, 14, 36, 120]")
    few = "crown: 4, upper_sidewall: 3, lower_sidewall: 3"
    text = text.replace(few, "crown: 3, upper_sidewall: 2, lower_sidewall: 2")
    before, rest = text.split("\ntargets:", 1)
    path.write_text(f"{before.rstrip()}{MORE}\ntargets:{rest}")
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    "loads", [[1000.0], pytest.param([1000.0, 1500.0], marks=pytest.mark.slow)]
)
def test_along_all_variables_at_once_they_are_differences(
    loads: list[float], tmp_path: Path
) -> None:
    """Sensitivities agree with differences to 1e-3 of the largest, also at the second load,
    whose slip counts from the first one's patch."""
    case = load_case(small_case(tmp_path))
    start = {name: case.case.variables[name].start for name in ALONG}
    evaluator = Evaluator(TyreDesign(case), store=Store(tmp_path / "record"))
    pressed, again = (evaluator.press(start, loads, gradients=tuple(start)) for _ in range(2))
    assert (evaluator.counts.runs, evaluator.counts.recorded) == (1, 1)
    assert [each.slopes for each in again.footprints] == [
        each.slopes for each in pressed.footprints
    ]
    above, below = (
        evaluator.press({v: x * np.exp(step * ALONG[v]) for v, x in start.items()}, loads)
        for step in (STEP, -STEP)
    )
    states = zip(pressed.footprints, above.footprints, below.footprints, strict=True)
    for at, up, down in states:
        for name in NAMES:
            each = [at.slopes[v][name] * start[v] * ALONG[v] for v in start]
            difference = (getattr(up, name) - getattr(down, name)) / (2 * STEP)
            assert abs(sum(each) - difference) < 1e-3 * max(map(abs, each)), (at.load_N, name)
