"""The error of form on record is the one that its study finds."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.form_error import (
    FORM_LENGTH,
    OTHERS,
    PERCENT,
    at_pressures,
    form_error,
)

from ..chance import generator
from ..studies.form_error import FLOOR, LABELS, PRESSURES, alike_over, computed


@pytest.mark.slow
def test_what_is_on_record_is_what_the_study_finds() -> None:
    """To the digits that are on record."""
    percent, length = computed()
    assert percent == pytest.approx(PERCENT, abs=0.006)
    assert length == pytest.approx(FORM_LENGTH, abs=0.06)


def test_errors_that_are_drawn_with_a_length_have_it() -> None:
    """20000 modes of an error smooth over 0.8 of ln p: rho is right to 1 %, and the length,
    which the largest of - ln rho tells, to 2 %."""
    p = np.array(PRESSURES)
    root = np.linalg.cholesky(at_pressures(p, 0.8))
    assert alike_over(root @ generator("lengths").normal(size=(3, 20_000))) == pytest.approx(
        0.8, rel=0.02
    )
    assert at_pressures(p, 0.8)[0, 2] == pytest.approx(np.exp(-(np.log(2) ** 2) / (2 * 0.8**2)))


def test_a_mode_has_its_own_error_or_the_worst() -> None:
    assert set(PERCENT) == {str(label) for label in LABELS}
    assert max(PERCENT.values()) == OTHERS and min(PERCENT.values()) >= FLOOR
    assert form_error(Label(2, 1)) == pytest.approx(PERCENT["[2,1]"] / 100)
    assert form_error(Label(9, 0)) == OTHERS / 100 and form_error(None) == 0.0
