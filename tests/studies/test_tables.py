"""A hundredth of the study of drawn tables."""

from __future__ import annotations

import pytest

from . import tables


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
