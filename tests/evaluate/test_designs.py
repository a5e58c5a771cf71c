"""Designs that are evaluated: a case's tyre, resolved once, or any other writer of decks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from string import Template
from typing import Any

import pytest

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.tyre.case import start_values, with_level
from tyrecal.tyre.case.schema import SolverChoice
from tyrecal.tyre.effects import catalogue
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

from ..conftest import CASES

CASE = with_level(load_case(CASES / "p235_75r17.yaml"), "coarse")
START = start_values(CASE)


@dataclass(frozen=True)
class DeckText:
    """A design that is nothing but the text of decks, with marks where its variables stand."""

    marked: Mapping[str, str]
    values: Mapping[str, float]
    request: Mapping[str, Any]
    header: str = ""
    pressure_kPa: float = 240.0
    needs: Mapping[str, str] = field(default_factory=dict)
    has_slopes: bool = True
    nominal: None = None
    is_nominal: bool = False
    solver: SolverChoice = CASE.case.solver

    def at(self, values: Mapping[str, float]) -> DeckText:
        return replace(self, values={**self.values, **values})

    def neighbour(self, name: str, side: int) -> tuple[DeckText, float]:
        moved = self.values[name] * (1 + side * 1e-4)
        return self.at({name: moved}), moved

    def explained(self, refusal: str) -> str:
        return refusal

    def texts(self, dialect: str, request: Mapping[str, Any]) -> dict[str, str]:
        assert dialect == "abaqus"
        marks = {name: format(value, ".13g") for name, value in self.values.items()}
        return {file: Template(text).substitute(marks) for file, text in self.marked.items()}


def test_somebodys_decks_are_evaluated_without_a_case() -> None:
    """Frequencies and slopes are those of the case that the text was once written from."""
    design = TyreDesign(CASE, START)
    texts = design.texts("abaqus", Decks(design).request)
    marked = {
        file: text.replace(format(START["C10"], ".13g"), "$C10") for file, text in texts.items()
    }
    assert any("$C10" in text for text in marked.values())
    question = Question({"C10": 1.1 * START["C10"]}, ("C10",))
    text = DeckText(marked, {"C10": START["C10"]}, design.request)
    own = Evaluator(text, "bundled").evaluate(question)
    of_case = Evaluator(TyreDesign(with_values(CASE, START))).evaluate(question)
    assert [m.frequency_Hz for m in own.modes] == pytest.approx(
        [m.frequency_Hz for m in of_case.modes], rel=1e-10
    )
    assert own.gradients["C10"] == pytest.approx(of_case.gradients["C10"], rel=1e-7)


@pytest.mark.parametrize("gradients", [(), ("C10",), tuple(START)])
def test_effects_are_written_in_once_a_design(
    gradients: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Effects are written once for the design, and once on either side of each variable with a
    sensitivity."""
    effect, made = catalogue()["bead_filler"], []

    def add(case: Any, value: float) -> Any:
        made.append(value)
        return effect.add(case, value)

    case = with_values(CASE, {"effects.bead_filler": 0.5})
    monkeypatch.setitem(catalogue(), "bead_filler", replace(effect, add=add))
    evaluator = Evaluator(TyreDesign(case))
    made.clear()
    evaluator.evaluate(Question(START, gradients))
    assert len(made) == 1 + 2 * len(gradients)
