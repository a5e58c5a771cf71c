"""An answer hangs on its deck alone, though Newton's method starts at the nominal tyre's shape."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question, _key
from tyrecal.simulate.evaluate.results import Evaluation
from tyrecal.simulate.evaluate.store import Store
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import overridden, with_values

from ..conftest import CASES

CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
START = start_values(CASE)
NEAR = {name: 1.03 * value for name, value in START.items()}
FAR = {name: 0.8 * value for name, value in START.items()}


def ask(evaluator: Evaluator, values: dict[str, float], *gradients: str) -> bytes:
    """Return the numbers of an answer."""
    return numbers(evaluator.evaluate(Question(values, gradients)))


def numbers(evaluation: Evaluation | Exception) -> bytes:
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
    assert list(map(numbers, pooled)) == list(map(numbers, alone))


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
