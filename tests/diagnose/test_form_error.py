"""The error of form on record is the one that its study finds."""

from __future__ import annotations

import pytest

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.form_error import OTHERS, PERCENT, form_error

from ..studies.form_error import FLOOR, LABELS, computed


@pytest.mark.slow
def test_what_is_on_record_is_what_the_study_finds() -> None:
    """To the digits that are on record."""
    assert computed() == pytest.approx(PERCENT, abs=0.006)


def test_a_mode_has_its_own_error_or_the_worst() -> None:
    assert set(PERCENT) == {str(label) for label in LABELS}
    assert max(PERCENT.values()) == OTHERS and min(PERCENT.values()) >= FLOOR
    assert form_error(Label(2, 1)) == pytest.approx(PERCENT["[2,1]"] / 100)
    assert form_error(Label(9, 0)) == OTHERS / 100 and form_error(None) == 0.0
