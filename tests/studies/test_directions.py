"""A sample of `directions`."""

from __future__ import annotations

import pytest

from ..chance import Chance
from .directions import outcome


@pytest.mark.slow
def test_the_wrong_meaning_of_directions_is_not_taken(chance: Chance) -> None:
    """Wrong in 1 of 500 at most, right without a question in 9 of 10, as the recorded study.

    False failures: 2e-7.
    """
    outcomes = [outcome(chance.random) for _ in range(15)]
    chance.often([each == "wrong" for each in outcomes], 0.0, 0.002)
    chance.often([each == "right" for each in outcomes], 0.9)
