"""The error of form on record is the one that its studies find."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.inference.covariance import (
    FORM_LENGTH,
    OTHERS,
    PERCENT,
    at_pressures,
    form_error,
)

from ..chance import generator
from ..studies import material_laws
from ..studies.form_error import FLOOR, LABELS, PRESSURES, alike_over, computed


@pytest.mark.slow
def test_what_is_on_record_is_what_the_study_finds() -> None:
    """To the digits that are on record."""
    percent, length = computed()
    assert percent == pytest.approx(PERCENT, abs=0.006)
    assert length == pytest.approx(FORM_LENGTH, abs=0.006)


def test_what_laws_do_falls_into_what_is_shared_and_what_is_not() -> None:
    """Five of the plane and four out of it at two pressures: a shift of all, of the plane's beside
    it and of one mode beside both come back as those, orthogonal to each other."""
    labels = [label for label in LABELS if label.c <= 4][:9]
    inside = np.array([label.family == labels[1].family for label in labels])
    all_modes, family = np.array([[0.01], [0.02]]), np.where(inside, 1.0, -inside.sum())
    family[~inside] /= (~inside).sum()
    own = np.zeros(len(labels))
    own[np.flatnonzero(inside)[:2]] = 1e-3, -1e-3
    d = all_modes + 1e-3 * family + own
    parts = material_laws.parts(d, labels)
    for part, made in zip(parts, (all_modes + 0 * family, 1e-3 * family, own), strict=True):
        assert part == pytest.approx(np.broadcast_to(made, d.shape), abs=1e-12)


def test_a_deck_s_rubber_gets_another_law() -> None:
    text = "*MATERIAL\n*HYPERELASTIC, {}, MODULI=LONG TERM\n{}\n*END STEP\n"
    softening = material_laws.with_law("YEOH", lambda C, D1: (C, -0.3 * C, D1))
    plain = text.format("MOONEY-RIVLIN", "6e5, 0.0, 5e-8")
    assert softening(plain) == text.format("YEOH", "600000, -180000, 5e-08")


def test_errors_that_are_drawn_with_a_length_have_it() -> None:
    """20000 modes of an error smooth over 0.8 of ln p: rho is right to 1 %, and the length,
    which the largest of - ln rho tells, to 2 %. One that grows twofold from the first pressure to
    the last, and else stays what it is, has rho = 2 * 2 / (1 + 4) between the two."""
    p = np.array(PRESSURES)
    root = np.linalg.cholesky(at_pressures(p, 0.8))
    assert alike_over(root @ generator("lengths").normal(size=(3, 20_000))) == pytest.approx(
        0.8, rel=0.02
    )
    grown = np.array([[1.0], [1.5], [2.0]])
    far, rho = np.log(p[[1, 2, 2]] / p[[0, 1, 0]]) ** 2 / 2, np.array([3 / 3.25, 6 / 6.25, 0.8])
    assert alike_over(grown) == pytest.approx(np.sqrt(far @ far / (far @ -np.log(rho))))
    assert at_pressures(p, 0.8)[0, 2] == pytest.approx(np.exp(-(np.log(2) ** 2) / (2 * 0.8**2)))


def test_a_mode_has_its_own_error_or_the_worst() -> None:
    assert set(PERCENT) == {str(label) for label in LABELS}
    assert max(PERCENT.values()) == OTHERS and min(PERCENT.values()) >= FLOOR
    assert form_error(Label(2, 1)) == pytest.approx(PERCENT["[2,1]"] / 100)
    assert form_error(Label(9, 0)) == OTHERS / 100 and form_error(None) == 0.0
