"""Runs and time of sensitivities by differences, in words before they begin."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

from tyrecal.studies import difference_runs
from tyrecal.studies.difference_runs import runs_in_words


@dataclass
class Tyre:
    """An evaluator whose run takes 12 s, if it is not recorded."""

    has_gradients: bool = False
    store: object = None
    counts: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(runs=0, clock_s=0.0))
    solver = SimpleNamespace(name="calculix")

    def evaluate(self, question: object) -> None:
        """Run, or recall."""
        if not self.store:
            self.counts.runs, self.counts.clock_s = self.counts.runs + 1, self.counts.clock_s + 12.0


@pytest.mark.parametrize(
    ("tyre", "words"),
    [
        (Tyre(), "300 runs of solver 'calculix', 12 s each: about 30 min with 2 at a time"),
        (Tyre(store="recorded"), "300 runs of solver 'calculix', 12 s each: about 30 min"),
        (Tyre(has_gradients=True), ""),
    ],
)
def test_runs_and_time(tyre: Tyre, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(difference_runs, "monotonic", lambda: tyre.counts.clock_s)
    assert words in runs_in_words(tyre, {}, 300, 2)  # type: ignore[arg-type]
    assert tyre.counts.runs == bool(words)
