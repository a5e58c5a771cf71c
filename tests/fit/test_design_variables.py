"""Design variables: their coordinates, how well a start is known, sizes of effects next to 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.simulate.deck.tyre_design import NEAR_ZERO
from tyrecal.studies.variable import DesignVariable, read_variable, read_variables
from tyrecal.tyre.case import start_values
from tyrecal.tyre.case.schema import Variable
from tyrecal.tyre.values import overridden

from .tyre_in_states import CASE


def read(variable: Variable) -> DesignVariable:
    """Read a variable as "x" of a case."""
    case = CASE.case.model_copy(update={"variables": {"x": variable}})
    return read_variable(replace(CASE, case=case), "x")


def test_a_variable_stays_next_to_0_where_it_moves_effects_alone() -> None:
    """Most effects leave the deck at 0, and have no slope there; other numbers have one."""

    def made(sets: list[str], lower: float, upper: float, start: float = 0.0) -> DesignVariable:
        return read(Variable(sets=sets, lower=lower, upper=upper, start=start, scale="linear"))

    both, other = ["effects.a", "effects.b"], ["effects.a", "pressure_kPa"]
    near = made(both, 0.0, 2.0)
    assert near.lower == near.start == 2 * NEAR_ZERO > 0 and near.upper == 2.0
    near = made(both, -3.0, 0.0)
    assert near.upper == near.start == -3 * NEAR_ZERO and near.lower == -3.0
    far = made(both, -3.0, 2.0, 0.5)
    assert (far.lower, far.start, far.upper) == (-3.0, 0.5, 2.0)
    for sets in (other, other[::-1], other[1:]):
        assert made(sets, 0.0, 2.0).lower == made(sets, 0.0, 2.0).start == 0.0


@pytest.mark.parametrize("log", [True, False])
def test_a_variables_coordinate_and_back(log: bool) -> None:
    """A logarithm, or the share of the way between the bounds; values stay within them, and the
    start is met to the last bit."""
    v = DesignVariable("x", 0.7, 0.3, 2.3, log)
    for value in (0.3, 0.5, 0.7, 1.9, 2.3):
        x = v.scaled(value)
        assert x == pytest.approx(np.log(value) if log else (value - 0.3) / 2.0)
        assert v.value(x) == pytest.approx(value, rel=1e-14)
        rise = (v.value(x + 1e-6) - v.value(x - 1e-6)) / 2e-6
        if 0.3 < value < 2.3:
            assert v.slope(value) == pytest.approx(rise, rel=1e-6)
    assert v.value(v.scaled(0.7)) == 0.7
    assert v.value(v.scaled(2.3) + 1) == 2.3 and v.value(v.scaled(0.3) - 1) == 0.3


def test_how_well_a_start_is_known() -> None:
    """A start is known as stated, else by 0.5 of a logarithm, and never worse than uniformly
    within the bounds. A linear variable that states nothing is uniform."""
    spread = lambda log, lower, upper, percent=None: (
        DesignVariable("x", 2.0, lower, upper, log, percent).spread
    )
    assert spread(True, 0.2, 20.0) == 0.5
    assert spread(True, 0.2, 20.0, 20.0) == pytest.approx(np.log(1.2))
    assert spread(True, 0.2, 20.0, 900.0) == pytest.approx(np.log(100) / 12**0.5)
    assert spread(True, 1.9, 2.1) == pytest.approx(np.log(2.1 / 1.9) / 12**0.5)
    assert spread(False, 1.0, 5.0) == pytest.approx(1 / 12**0.5)
    assert spread(False, 1.0, 5.0, 10.0) == pytest.approx(0.2 / 4)
    assert read(Variable(sets=["a"], start=2, lower=1, upper=5, percent=7)).percent == 7


def test_a_variable_starts_where_its_user_has_set_it() -> None:
    """Within its bounds; the case's own start stays what its file says."""
    case = overridden(CASE, {"C10": 2e6})
    assert start_values(case)["C10"] == read_variable(case, "C10").start == 2e6
    assert case.case.variables["C10"].start == 1e6 and start_values(CASE)["C10"] == 1e6
    outside = overridden(CASE, {"C10": 2e7})  # which other studies than a fit evaluate
    with pytest.raises(InputError, match=r"'C10' starts at 2e.07: it must start within its"):
        read_variables(outside)
    with pytest.raises(ValueError, match="C10_Pa is set by the variable 'C10': set C10 instead"):
        overridden(CASE, {"materials.rubber.C10_Pa": 2e6})
