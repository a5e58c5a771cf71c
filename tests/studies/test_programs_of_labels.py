"""Programs of studies on labels and tables, on samples: `directions`, `rings`, `tables`.

Labels by shapes and frequencies together: some tests of `rings --case`.
A hundredth of the study of drawn tables.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ..chance import Chance
from . import tables
from .directions import outcome
from .rings import labelled_with_case


@pytest.mark.slow
def test_the_wrong_meaning_of_directions_is_not_taken(chance: Chance) -> None:
    """Wrong in 1 of 500 at most, right without a question in 9 of 10, as the recorded study.

    False failures: 2e-7.
    """
    outcomes = [outcome(chance.random) for _ in range(15)]
    chance.often([each == "wrong" for each in outcomes], 0.0, 0.002)
    chance.often([each == "right" for each in outcomes], 0.9)


@pytest.mark.slow
def test_labels_by_shapes_and_frequencies_are_right_as_stated(
    chance: Chance, tmp_path: Path
) -> None:
    """Four tests with two or three rings on a tyre that is not the model: of some 40 labels, those
    of one test not independent, 9 of 10 are right; the study records 98 %. False failures: 1e-7."""
    seed = int(chance.random.integers(2**20))
    numbers = (1, 2, 4, 5)
    records = [labelled_with_case(n, seed, tmp_path, ways=("together",)) for n in numbers]
    pairs = [zip(r["true"], r["together"]["labels"], strict=True) for r in records]
    right = [a == b for each in pairs for a, b in each]
    chance.often(right, 0.9)
    p = np.array([each for r in records for each in r["together"]["p"]])
    assert len(p) == len(right) and p.mean() > 0.8


def test_slips_and_mutants() -> None:
    """The draws are fixed: every slip of these is reported."""
    tally = tables.slips(6, seed=1)
    assert tally["reported"] == tally["with_slip"] == 3
    assert tally["reported_without"] == 0
    assert tables.mutants(20, seed=1)["faults"] == 0


@pytest.mark.slow
def test_exchanged_pressures_and_labels() -> None:
    tally = tables.sense(6, seed=1, tyres=2)
    assert tally["pressures"] == tally["pressures_reported"]
    assert tally["neither_reported"] == 0
