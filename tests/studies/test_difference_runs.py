"""Runs and time of sensitivities by differences, in words before they begin."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from tyrecal.studies import difference_runs
from tyrecal.studies.difference_runs import runs_in_words


class Tyre:
    """An evaluator whose run takes 12 s."""

    def __init__(self, has_gradients: bool = False, is_recorded: bool = False):
        self.solver = SimpleNamespace(name="calculix")
        self.has_gradients, self.is_recorded = has_gradients, is_recorded
        self.counts, self.clock_s = SimpleNamespace(runs=0), 0.0

    def evaluate(self, question: object) -> None:
        """Run, if it is not recorded."""
        if not self.is_recorded:
            self.counts.runs, self.clock_s = self.counts.runs + 1, self.clock_s + 12.0


@pytest.mark.parametrize(
    ("tyre", "words"),
    [
        (Tyre(), "300 runs of solver 'calculix', 12 s each: about 30 min with 2 at a time"),
        (Tyre(is_recorded=True), "300 runs of solver 'calculix', without those that are recorded"),
        (Tyre(has_gradients=True), ""),
    ],
)
def test_runs_and_time(tyre: Tyre, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(difference_runs, "monotonic", lambda: tyre.clock_s)
    assert runs_in_words(tyre, {}, 300, 2).endswith(words)  # type: ignore[arg-type]
