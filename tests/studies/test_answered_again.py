"""The comparison of one study's answers by two commits."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from .answered_again import changes

pytestmark = pytest.mark.numbers


def test_how_the_answers_of_two_commits_differ(tmp_path: Path) -> None:
    """Verdicts, named effects and the largest change of a probability, of the common trials."""
    first = {
        "a": ("named", "e0", {"e0": 0.94, "none": 0.06}),
        "b": ("no_gap", None, {"none": 0.9, "e0": 0.1}),
        "alone": ("no_gap", None, {"none": 0.1, "e0": 0.9}),
    }
    other = {
        "a": ("named", "e1", {"e1": 0.25, "e0": 0.7, "none": 0.05}),
        "b": ("undecided", None, {"none": 0.89, "e0": 0.11}),
    }
    for folder, answers in (("first", first), ("other", other)):
        (tmp_path / folder).mkdir()
        for trial, (verdict, effect, p) in answers.items():
            content = {"diagnosis": {"verdict": verdict, "effect": effect, "probabilities": p}}
            (tmp_path / folder / f"{trial}.json").write_text(json.dumps(content))
    assert changes(tmp_path / "first", tmp_path / "other").splitlines() == [
        "2 trials, 1 other verdicts, 1 other effects,"
        " largest change of a probability 0.250 (e1, a)",
        "b: no_gap, undecided",
        "a: e0, e1",
    ]
    assert "0.250" in changes(tmp_path / "other", tmp_path / "first")
