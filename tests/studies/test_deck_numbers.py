"""A hundredth of `deck_numbers`: no number of a deck is off by a unit in silence."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from . import deck_numbers


@pytest.mark.parametrize("name", ["parameters", "ogden"])
def test_a_slip_is_refused_or_changes_little(
    name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """12 of 312 slips; all 312 end so."""
    chosen = Random(request.config.getoption("--seed")).sample(range(144), 6)
    path = deck_numbers.decks(tmp_path, name)
    trials = list(deck_numbers.trials(name, path, chosen))
    assert len(trials) == 6
    assert not [each for each in trials if deck_numbers.ending(each) in ("silent", "failed")]
