"""Designs that fail: a fit steps back from them, goes round them, or ends and says why."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.evaluate.failure import DeckRefused, EvaluationFailed
from tyrecal.simulate.evaluate.results import Evaluation

from ..calibrated import calibrate
from .known_truth import CASE, START, TRUTH, evaluator


@pytest.mark.parametrize("method", ["slsqp", "gauss-newton"])
@pytest.mark.parametrize("margin", [0.005, 0.02])
def test_steps_back_from_designs_that_fail(method: str, margin: float) -> None:
    """The truth lies just before a cliff, beyond which there is no equilibrium."""
    fails = lambda values: values["A_belt"] / TRUTH["A_belt"] - 1 > margin
    fit = calibrate(CASE, evaluator(fails=fails), method)  # type: ignore[arg-type]
    assert fit.result["objective_Hz"] < 0.05
    failed = [row for row in fit.history if row["objective_Hz"] is None]
    assert all("inflation stopped" in row["failure"] for row in failed)
    assert fit.result["failed_evaluations"] == len(failed) > 0


@pytest.mark.parametrize("method", ["slsqp", "gauss-newton"])
def test_goes_round_designs_that_fail(method: str) -> None:
    """The design that the search tries first, and those within 2 % of it, have no equilibrium."""
    first = calibrate(CASE, evaluator(), method).history[1]["values"]  # type: ignore[arg-type]
    fails = lambda values: all(abs(np.log(values[n] / first[n])) < 0.02 for n in first)
    assert not fails(TRUTH)
    fit = calibrate(CASE, evaluator(fails=fails), method)  # type: ignore[arg-type]
    assert fit.result["objective_Hz"] < 0.05 and fit.result["failed_evaluations"] > 0


def test_a_start_that_fails_is_a_failure_not_a_number() -> None:
    with pytest.raises(EvaluationFailed, match="12 of 240 kPa"):
        calibrate(CASE, evaluator(fails=lambda values: True))  # type: ignore[arg-type]


def test_a_design_whose_deck_is_refused_ends_the_fit_and_is_no_point_of_it() -> None:
    """A refusal is a mistake of the case, not of the design."""
    refusing = evaluator()
    answer = refusing.evaluate

    def evaluate(question: Question) -> Evaluation:
        if question.values["C10"] != START["C10"]:
            raise DeckRefused("not honoured")
        return answer(question)

    refusing.evaluate = evaluate  # type: ignore[method-assign]
    with pytest.raises(DeckRefused, match="not honoured"):
        calibrate(CASE, refusing)  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_design_that_the_case_cannot_have_is_stepped_back_from() -> None:
    """C10 + C01 must be positive, which the bounds of C01 alone do not say."""
    variable = CASE.case.variables["C10"].model_copy(
        update={
            "sets": ["materials.rubber.C01_Pa"],
            "scale": "linear",
            "start": 0.0,
            "lower": -9e5,
            "upper": 9e5,
        }
    )
    variables = {"A_belt": CASE.case.variables["A_belt"], "C01": variable}
    rubber = CASE.case.materials["rubber"].model_copy(update={"C10_Pa": 5e5})
    materials = {**CASE.case.materials, "rubber": rubber}
    changed = {"variables": variables, "materials": materials}
    changed["mesh"] = CASE.case.mesh.model_copy(update={"level": "coarse"})
    case = replace(CASE, case=CASE.case.model_copy(update=changed))
    result = calibrate(case, Evaluator(TyreDesign(case)), starts=4, seed=0).result
    assert result["replaced_starts"] > 0
    assert len(result["starts"]) == 4
