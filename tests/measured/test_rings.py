"""Labels from rings of sensors: a hundredth of the recorded study (`tests/studies/rings.py`)."""

from __future__ import annotations

import pytest

from ..chance import Chance
from ..studies.rings import DIRECTIONS, GROUPS, draw_test, labels_given
from .tyres import modes

pytestmark = pytest.mark.numbers


@pytest.mark.slow
def test_labels_from_rings_are_right_or_not_given(chance: Chance) -> None:
    """At most one in 200 of some 130 modes of the main tyre (coarse mesh) is wrong, and 19 in 20
    of those that `measured sensors` calls distinguishable have a label.

    False failures: 2e-7.
    """
    ordered = sorted(modes(), key=lambda mode: mode.frequency_Hz)
    wrong, labelled = [], []
    for rings, name in GROUPS:
        test = draw_test(ordered, rings, DIRECTIONS[name], chance.random)
        for true, given, can_tell in labels_given(test):
            wrong.append(given not in (None, true))
            labelled += [given is not None] * can_tell
    chance.often(wrong, 0.0, 0.005)
    chance.often(labelled, 0.95)
