"""A coarse case, and frequencies through the public evaluator."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from tyrecal.simulate.deck.decks import Decks
from tyrecal.simulate.deck.tyre_design import TyreDesign
from tyrecal.simulate.evaluate.evaluator import Evaluator, Question
from tyrecal.simulate.modes.label import Label, paired_labels
from tyrecal.tyre.case import LoadedCase, start_values
from tyrecal.tyre.load import load_case
from tyrecal.tyre.values import with_values

CASES = Path(__file__).parents[2] / "cases"
COARSE = {"crown": 3, "upper_sidewall": 3, "lower_sidewall": 3, "bead": 1}


def coarse(name: str = "p235_75r17.yaml") -> LoadedCase:
    """A shipped case with a coarse mesh and an exact section."""
    loaded = load_case(CASES / name)
    case = loaded.case
    level = case.mesh.levels["default"]
    coarser = level.model_copy(update={"elements": COARSE, "rows": [1, 1, 1, 1], "grading": None})
    mesh = case.mesh.model_copy(update={"levels": {"default": coarser}})
    return exact(replace(loaded, case=case.model_copy(update={"mesh": mesh})))


def exact(loaded: LoadedCase) -> LoadedCase:
    """The case with its section beyond doubt: that of the model which makes the data."""
    section = loaded.case.section.model_copy(update={"known_from": "exact"})
    return replace(loaded, case=loaded.case.model_copy(update={"section": section}))


CASE = with_values(coarse(), {"pressure_kPa": 160.0})  # not the file's, for the drift
START = start_values(CASE)


def decks(case: LoadedCase, **effects: float) -> dict[str, str]:
    """The decks of a case with effects."""
    values = {f"effects.{id}": value for id, value in effects.items()}
    return data(Decks(TyreDesign(with_values(case, values))))


def data(decks: Decks) -> dict[str, str]:
    """Decks without the line that says which tyre they are of: the same data can be reached by an
    effect and by the case's own numbers."""
    texts = decks.texts("abaqus")
    assert all("** tyre_sha256 " in text for text in texts.values())
    return {name: re.sub(r"\*\* tyre_sha256 .*\n", "", text) for name, text in texts.items()}


def frequencies(case: LoadedCase = CASE, **effects: float) -> dict[Label, float]:
    """Hz by label of a case with effects."""
    values = {f"effects.{id}": value for id, value in effects.items()}
    modes = paired_labels(Evaluator(TyreDesign(case)).evaluate(Question({**START, **values})).modes)
    return {mode.label: mode.frequency_Hz for mode in modes}


def slopes(case: LoadedCase, id: str, value: float) -> np.ndarray:
    """Exact d Hz / d parameter of every mode, in the order of the solver."""
    name = f"effects.{id}"
    answer = Evaluator(TyreDesign(case)).evaluate(Question({**START, name: value}, (name,)))
    return np.array(answer.gradients[name])
