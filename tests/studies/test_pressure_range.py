"""Pressures of a sweep without ends: round the case's own."""

from __future__ import annotations

import pytest

from tyrecal.errors import InputError
from tyrecal.studies.pressure_range import PressureRange
from tyrecal.tyre.values import with_values

from ..evaluate.stand_in import CASE


@pytest.mark.parametrize(("own", "ends"), [(240, (100, 320)), (850, (350, 1130))])
def test_default_ends_follow_the_case(own: float, ends: tuple[float, float]) -> None:
    case = with_values(CASE, {"pressure_kPa": own})
    pressures = PressureRange(None, None, 12).on(case)
    assert (pressures[0], pressures[-1], len(pressures)) == (*ends, 12)
    assert pressures == sorted(pressures) and pressures[0] < own < pressures[-1]


def test_an_end_that_is_given_counts() -> None:
    assert PressureRange(200.0, None, 4).on(CASE) == [200, 240, 280, 320]
    assert PressureRange(None, 110.0, 3).on(CASE) == [100, 105, 110]
    with pytest.raises(
        InputError, match=r"100 must be less than --to-kPa 90 \(default: 100 to 320"
    ):
        PressureRange(None, 90.0, 3).on(CASE)
