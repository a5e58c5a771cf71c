"""Refusals of a study before anything is judged, and changes of a run as they are written.

An effect is added to a case's file.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.evaluate.failure import DeckRefused
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.add import add
from tyrecal.studies.diagnose.study import parse_change
from tyrecal.studies.inference.check_units import check_units
from tyrecal.studies.inference.inverse_problem import Toggle
from tyrecal.studies.inference.model import Answer
from tyrecal.studies.inference.observations import Observable, Observations
from tyrecal.tyre.case.editor import EDITOR_LINE
from tyrecal.tyre.load import load_case

from ..case.test_guard import SLIPS


@pytest.mark.parametrize(
    ("text", "change"),
    [
        ("bead_filler=1", Toggle("bead_filler", 1.0, False)),
        (" bead_filler = 0", Toggle("bead_filler", 0.0, False)),
        ("bead_filler*0.5", Toggle("bead_filler", 0.5, True)),
    ],
)
def test_a_change_is_a_value_or_a_factor(text: str, change: Toggle) -> None:
    assert parse_change(text) == change


@pytest.mark.parametrize(
    "text", ["bead_filler", "nonsense=0", "bead_filler=x", "=1", "bead_filler*1", "bead_filler=inf"]
)
def test_a_change_that_is_none(text: str) -> None:
    with pytest.raises(InputError):
        parse_change(text)


def test_what_is_not_even_near_the_model_is_refused() -> None:
    """A frequency by a factor of 2, the mass by 1.5, either way; frequencies are told first."""
    rows = [(Label(2, 0), 240.0), (None, 0.0)]
    answer = Answer(np.log([80.0, 12.0]), np.zeros((2, 1)), np.zeros(2))
    start = np.zeros(1)
    model: Any = SimpleNamespace(rows=rows, start=start, answers=lambda points: [answer])

    def check(frequency: float, mass: float) -> None:
        measured = (Observable("mass_kg", None, 0.0), Observable("frequency_Hz", *rows[0]))
        none = np.full(2, np.nan)
        y = np.log([12.0 * mass, 80.0 * frequency])
        check_units(model, Observations(measured, y, none, 0.0, none, none), ["a.csv"], ())

    for good in (1.0, 1.99, 1 / 1.99):
        check(good, 1.0)
    for good in (1.49, 1 / 1.49):
        check(1.0, good)
    for bad in (2.01, 1 / 2.01):
        with pytest.raises(InputError, match=f"a.csv: .* {bad:.2g} times the model's"):
            check(bad, 1.51)
    for bad in (1.51, 1 / 1.51):
        with pytest.raises(InputError, match=f"a.csv: the mass is {bad:.2g} times the model's"):
            check(1.9, bad)


def test_a_model_without_an_answer_says_why_before_anything_is_judged() -> None:
    """A plain tyre gives its own failure; a switched one gives what was switched."""
    rows = [(Label(2, 0), 240.0)]
    answer = Answer(np.log([80.0]), np.zeros((1, 1)), np.zeros(1))
    failure, asked_for = DeckRefused("no such tyre"), []
    none = np.full(1, np.nan)
    seen = Observations((Observable("frequency_Hz", *rows[0]),), answer.eta, none, 0.0, none, none)

    def check(answers: list, *changes: Toggle) -> None:
        answering = lambda points: asked_for.append([dict(p.effects) for p in points]) or answers
        model: Any = SimpleNamespace(rows=rows, start=np.zeros(1), answers=answering)
        check_units(model, seen, ["a.csv"], changes)

    with pytest.raises(DeckRefused, match="no such tyre"):
        check([failure])
    switched = Toggle("point_mass", 0.05, base=0.02)
    with pytest.raises(InputError, match=r"'point_mass=0.05' cannot be evaluated: no such tyre"):
        check([answer, failure], switched)
    check([answer, answer], switched)
    # what is as in the case, or a factor, is no other tyre
    check([answer], replace(switched, value=0.02), replace(switched, times=True))
    assert asked_for == [[{}], *[[{}, {"point_mass": pytest.approx(0.03)}]] * 2, [{}]]


def test_an_effect_is_added_with_the_files_comments_kept(case_folder: Path) -> None:
    old = case_folder / "p235_75r17.yaml"
    new = add(old, {"bead_filler": 1.5})
    added = [line for line in new.read_text().splitlines() if line not in old.read_text()]
    apart = "effects:", EDITOR_LINE.strip()
    assert [word for line in added if (word := line.strip()) not in apart] == ["bead_filler: 1.5"]
    assert "# Table 1 of the paper" in new.read_text()
    with pytest.raises(InputError):
        add(old, {"bead_filler": 1.5})
    with pytest.raises(ValueError, match="no 'nothing'"):
        add(old, {"nothing": 1.5})


def test_an_effect_is_added_to_a_case_whose_numbers_are_unusual(case_folder: Path) -> None:
    """Its user was told of them already."""
    path = case_folder / "p235_75r17.yaml"
    old, new, *_ = next(iter(SLIPS.values()))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    assert load_case(add(path, {"bead_filler": 1.5}), allow_unusual=True).case.effects
