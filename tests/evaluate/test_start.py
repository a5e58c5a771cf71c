"""Start states, inflated and on the road: the same answer, which depends on its deck alone."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.adapter import JOB, OLDJOB, PRESS
from tyrecal_solvers.bundled.deck.start import PRESSED_FILE
from tyrecal_solvers.bundled.job import run
from tyrecal_solvers.bundled.road import footprint_job, pressed_start
from tyrecal_solvers.bundled.road.contact import Contact
from tyrecal_solvers.bundled.road.contact_newton import ContactNewton, FirstGuess
from tyrecal_solvers.bundled.road.contact_update import ContactUpdate
from tyrecal_solvers.errors import Indefinite, Refused

from tyrecal.simulate.deck.decks import PressedTyre
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate import executor as executor_module
from tyrecal.simulate.evaluate.evaluator import Evaluator, PressQuestion, Question, _key
from tyrecal.simulate.evaluate.pressed import Pressed
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.evaluate.store import Store
from tyrecal.studies.fit.road import press_with_slopes
from tyrecal.studies.fit.targets import ValueTarget
from tyrecal.tyre.case import LoadedCase, start_values, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.state import TyreState
from tyrecal.tyre.values import overridden, with_values

from ..conftest import CASES
from .test_pressed import small_case

LOADS = [1500.0]


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> LoadedCase:
    return load_case(small_case(tmp_path_factory.mktemp("case")))


def moved(case: LoadedCase) -> dict[str, float]:
    """Another design, at another pressure."""
    start = start_values(case)
    return {**start, "A_carcass": 1.3 * start["A_carcass"], "p": 1.15 * start["p"]}


def numbers(pressed: Pressed) -> bytes:
    """Numbers of an answer that depend on the state."""
    first = pressed.footprints[0]
    parts = (first.displacement, first.pressure_Pa, first.stiffness_N_per_m, first.deflection_m)
    return b"".join(np.asarray(part).tobytes() for part in parts)


@pytest.mark.slow
def test_the_answer_is_that_from_nothing_and_its_bytes_depend_on_no_memory(
    case: LoadedCase, tmp_path: Path
) -> None:
    """Within the tolerance of the out-of-balance force, 1e-8; run alone from its folder, the same
    bytes."""
    base, values = start_values(case), moved(case)
    evaluator = Evaluator(TyreDesign(case), folder=tmp_path / "runs", keep=True)
    begun = evaluator.press(values, LOADS, base=base)
    assert evaluator.counts.runs == 2  # the base first
    cold = Evaluator(TyreDesign(case)).press(values, LOADS)
    for name in ("deflection_m", "stiffness_N_per_m", "contact_area_m2"):
        one, other = (getattr(each.footprints[0], name) for each in (begun, cold))
        assert one == pytest.approx(other, rel=1e-6), name
    (folder,) = (path.parent for path in (tmp_path / "runs").rglob(PRESSED_FILE))
    alone = tmp_path / "alone"
    shutil.copytree(folder, alone)
    for made in (*alone.glob(f"{PRESS}.npz"), *alone.glob(f"{PRESS}.json")):
        made.unlink()
    run(alone, PRESS, OLDJOB)
    assert footprint_job.read(alone / PRESS)["footprints"][0]["stiffness_N_per_m"] == (
        begun.footprints[0].stiffness_N_per_m
    )
    assert not (alone / f"{JOB}.inp").exists()


def start_of(case: LoadedCase) -> PressedTyre:
    """The tyre of a case on the road."""
    evaluator, base = Evaluator(TyreDesign(case)), start_values(case)
    evaluator.press(base, LOADS, base=base)
    (tyre,) = evaluator.pressed_tyres.values()
    assert tyre
    return tyre


@pytest.mark.slow
def test_a_start_is_predicted_to_first_order(case: LoadedCase) -> None:
    """A change by 1 % leaves a twentieth of it at most, and quadratically in the change."""
    evaluator, base = Evaluator(TyreDesign(case)), start_values(case)
    evaluator.press(base, LOADS, gradients=tuple(base), base=base)
    (tyre,) = evaluator.pressed_tyres.values()
    assert tyre is not None
    left = []
    for share in (1.01, 1.02):
        values = {name: share * x for name, x in base.items()}
        (own,) = evaluator.press(values, LOADS).footprints
        predicted = tyre.predicted(values)
        left.append(abs(own.displacement - predicted.displacement[0]).max())
        assert left[-1] < 0.05 * abs(own.displacement - tyre.displacement[0]).max()
        moved = own.deflection_m - tyre.deflection_m[0]
        assert predicted.deflection_m[0] == pytest.approx(own.deflection_m, abs=0.05 * abs(moved))
    assert left[1] == pytest.approx(4 * left[0], rel=0.25)
    assert (tyre.predicted(base).displacement == tyre.displacement).all()


@pytest.mark.slow
@pytest.mark.parametrize("bad", ["unstable", "far away"])
def test_a_bad_start_is_given_up(
    case: LoadedCase, bad: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer is then that from nothing, to the byte."""
    base, values = start_values(case), moved(case)
    cold = numbers(Evaluator(TyreDesign(case)).press(values, LOADS))
    start, form, given = start_of(case), ContactNewton._form, list[float]()

    def refused(work: ContactNewton, contact: Contact) -> ContactUpdate:
        if not given:
            given.append(work.load)
            raise Indefinite("no minimum")
        return form(work, contact)

    def guess(parts: Any, deflection: float) -> FirstGuess:
        given.append(deflection)
        return FirstGuess(-50 * parts, deflection)

    if bad == "unstable":
        monkeypatch.setattr(ContactNewton, "_form", refused)
    else:
        monkeypatch.setattr(pressed_start, "FirstGuess", guess)
    evaluator = Evaluator(TyreDesign(case))
    evaluator.pressed_tyres[_key(TyreDesign(case, base)), tuple(LOADS), ()] = start
    assert numbers(evaluator.press(values, LOADS, base=base)) == cold and given


@pytest.mark.slow
def test_the_order_of_the_questions_does_not_matter(case: LoadedCase, tmp_path: Path) -> None:
    base, values = start_values(case), moved(case)
    fresh = lambda: Evaluator(TyreDesign(case), store=Store(tmp_path / "record"))
    first = fresh()
    alone = numbers(first.press(values, LOADS, base=base))
    again = fresh()
    assert numbers(again.press(values, LOADS, base=base)) == alone
    assert (again.counts.runs, again.counts.recorded) == (0, 2)
    both = [PressQuestion(each, LOADS, base=base) for each in (base, values)]
    evaluator = Evaluator(TyreDesign(case))
    workers = evaluator.press_all(both, jobs=2)
    assert [numbers(each) for each in workers if isinstance(each, Pressed)][1] == alone
    assert evaluator.counts.runs == 2


@pytest.mark.slow
def test_states_that_run_side_by_side_give_the_same_bytes(case: LoadedCase) -> None:
    """Stiffnesses at two pressures of three designs, each of which begins at the one before it, as
    a fit asks for them; the workers stay for the next design."""
    start = start_values(case)
    designs = [{**start, "A_carcass": share * start["A_carcass"]} for share in (1.0, 1.2, 1.3)]
    targets = [
        ValueTarget("vertical_stiffness_N_per_m", 2e5, 1e3, 1.0, TyreState(kPa, LOADS[0]))
        for kPa in (220.0, 250.0)
    ]
    answers = []
    workers = set()
    for jobs in (1, 2):
        evaluator = Evaluator(TyreDesign(case))
        for values, base in zip(designs, [start, *designs], strict=False):
            answers.append(press_with_slopes(case, evaluator, targets, values, [], base, jobs)[0])
            if jobs == 2:
                workers.add(id(executor_module._idle[2]))
        assert evaluator.counts.runs == 6
    assert len(workers) == 1
    assert all(np.all(answer > 0) for answer in answers)
    assert [a.tobytes() for a in answers[:3]] == [a.tobytes() for a in answers[3:]]


@pytest.mark.slow
def test_a_start_that_is_not_the_one_named_is_refused(case: LoadedCase, tmp_path: Path) -> None:
    evaluator = Evaluator(TyreDesign(case), folder=tmp_path, keep=True)
    evaluator.press(moved(case), LOADS, base=start_values(case))
    (start,) = tmp_path.rglob(PRESSED_FILE)
    start.write_bytes(start.read_bytes() + b" ")
    with pytest.raises(Refused, match="is not the state that the deck names"):
        run(start.parent, PRESS, OLDJOB)
    start.unlink()
    with pytest.raises(Refused, match=r"start.npz is not next to it"):
        run(start.parent, PRESS, OLDJOB)


CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")


START = start_values(CASE)


NEAR = {name: 1.03 * value for name, value in START.items()}


FAR = {name: 0.8 * value for name, value in START.items()}


def ask(evaluator: Evaluator, values: dict[str, float], *gradients: str) -> bytes:
    """Return the numbers of an answer."""
    return frequencies(evaluator.evaluate(Question(values, gradients)))


def frequencies(evaluation: Evaluation | Exception) -> bytes:
    assert isinstance(evaluation, Evaluation)
    shapes = [mode.shape.amplitude for mode in evaluation.modes]
    return b"".join(
        np.asarray(part).tobytes()
        for part in (evaluation.displacement, [m.frequency_Hz for m in evaluation.modes], *shapes)
    )


def test_same_bytes_in_any_order_and_from_the_record(tmp_path: Path) -> None:
    fresh = lambda: Evaluator(TyreDesign(CASE))
    alone = ask(fresh(), FAR)
    after = fresh()
    ask(after, START, *START)
    ask(after, NEAR)
    assert ask(after, FAR) == alone
    assert ask(fresh(), START) == ask(after, START)
    stored = Evaluator(TyreDesign(CASE), store=Store(tmp_path))
    first, again = ask(stored, FAR), ask(stored, FAR)
    assert first == again == alone
    assert (stored.counts.runs, stored.counts.recorded) == (2, 1)  # the nominal one, and this


@pytest.mark.slow
def test_same_bytes_by_workers() -> None:
    questions = [Question(values) for values in (FAR, START, NEAR)]
    pooled = Evaluator(TyreDesign(CASE)).evaluate_all(questions, jobs=2)
    alone = Evaluator(TyreDesign(CASE)).evaluate_all(questions)
    assert list(map(frequencies, pooled)) == list(map(frequencies, alone))


def test_what_was_set_before_does_not_count() -> None:
    """The shape is that of the case's file, whoever sets what, and in how many steps."""
    at_once = ask(Evaluator(TyreDesign(CASE)), {**FAR, "pressure_kPa": 200.0})
    case = with_values(overridden(with_values(CASE, NEAR), {"pressure_kPa": 200.0}), FAR)
    assert ask(Evaluator(TyreDesign(case)), FAR) == at_once


def starts(evaluator: Evaluator, monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Return whether each further deck names a shape to start from."""
    named: list[bool] = []
    write = type(evaluator.solver).write

    def noting(self, decks, folder):
        named.append(decks.start is not None)
        return write(self, decks, folder)

    monkeypatch.setattr(type(evaluator.solver), "write", noting)
    return named


def test_the_case_as_it_stands_starts_at_rest_and_is_asked_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    evaluator = Evaluator(TyreDesign(CASE))
    named = starts(evaluator, monkeypatch)
    ask(evaluator, START)
    assert named == [False] and evaluator.counts.runs == 1
    ask(evaluator, NEAR)
    ask(evaluator.of(TyreDesign(with_values(CASE, {"pressure_kPa": 210.0}))), FAR)
    assert named == [False, True, True] and evaluator.counts.runs == 3
    named.clear()
    ask(Evaluator(TyreDesign(CASE)), NEAR)
    assert named == [False, True]


@pytest.mark.slow
def test_where_the_nominal_tyre_fails_all_start_at_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing remains of that failure, which no study requested."""
    soft = {"variables.C10.lower": 1e4, "variables.C10.start": 2e4, "pressure_kPa": 1500.0}
    unstable = replace(with_values(CASE, soft), as_read=None)
    case = with_values(unstable, {"pressure_kPa": 240.0})
    evaluator = Evaluator(TyreDesign(case), folder=tmp_path)
    named = starts(evaluator, monkeypatch)
    near = ask(evaluator, NEAR)
    ask(evaluator, FAR)
    assert named == [False, False, False] and not list(tmp_path.iterdir())
    at_rest = Evaluator(TyreDesign(CASE))
    at_rest.shapes[_key(TyreDesign(CASE, START))] = np.empty((0, 4))
    assert near == ask(at_rest, NEAR)
