"""Frequencies between the lowest and the highest pressure, against polynomials and the model."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.studies.inference.between import Between
from tyrecal.studies.inference.model import Answer, ModelRow, Query
from tyrecal.tyre.state import TyreState

from .coarse_model import X, model
from .toy import LABELS

pytestmark = pytest.mark.numbers
A, B = LABELS[:2]


def test_rows_and_ends_of_each_rim() -> None:
    """A mode that was measured between the ends only gets rows there; the mass needs none."""
    wide = TyreState(200.0, "wide")
    rows: list[ModelRow] = [(A, 160.0), (A, 240.0), (B, 240.0), (A, 320.0), (A, wide), (None, 0.0)]
    states = [TyreState(p) for p in (160.0, 240.0, 320.0)]
    between = Between.of(rows, [states[0], wide, *states[1:]])
    assert set(between.ends) == {states[0], states[2], wide}
    assert between.rows[6:] == ((B, states[0]), (B, states[2]))
    assert between.low.tolist() == [0, 0, 6, 0, 4, 5, 6, 6]
    assert between.high.tolist() == [3, 3, 7, 3, 4, 5, 7, 7]
    assert np.flatnonzero(between.inner).tolist() == [1, 2]


@pytest.mark.parametrize("degree", [1, 3])
def test_shifts_are_cubics_in_ln_p(degree: int) -> None:
    """With slopes by the pressure, else straight lines; other numbers are straight lines."""
    p = np.array([160.0, 200.0, 280.0, 320.0])
    between = Between.of([(A, float(each)) for each in p], [TyreState(float(each)) for each in p])
    curve = np.polynomial.Polynomial([0.3, -0.2, 0.5, 0.4][: degree + 1])
    ln_p, none = np.log(p), np.zeros((4, 1))
    plain = Answer(np.sin(p), none, 0 * p, by_pressure=np.cos(p) if degree > 1 else None)
    ends = ~between.inner
    rate = curve.deriv()(ln_p) + np.cos(p)
    answer = Answer(
        np.where(ends, curve(ln_p) + np.sin(p), 0.0),
        np.where(ends, 2 * ln_p, 0.0)[:, None],
        np.where(ends, 3 * ln_p, 0.0),
        slopes={"e0": np.where(ends, 4 * ln_p, 0.0)},
        by_pressure=np.where(ends, rate, 0.0),
    )
    filled = between.filled(answer, plain)
    assert filled.eta == pytest.approx(curve(ln_p) + np.sin(p), abs=1e-12)
    assert filled.jacobian[:, 0] == pytest.approx(2 * ln_p, abs=1e-12)
    assert filled.split == pytest.approx(3 * ln_p) and filled.slopes["e0"] == pytest.approx(
        4 * ln_p
    )


@pytest.mark.slow
def test_a_tyre_between_two_pressures() -> None:
    """An effect and a step of the variables: shifts to 1 % of the largest, in two thirds of the
    runs."""
    pressures = (160.0, 240.0, 320.0)
    own = model([*((label, p) for p in pressures for label in LABELS), (None, 0.0)])
    points = [(X, {"bead_filler": 2.0}), (X + 0.05, {})]
    plain, *near = own.answers([Query(X), *(Query(*each, near=X) for each in points)])
    runs = own.evaluator.counts.runs
    whole = own.answers([Query(*each) for each in points])
    assert runs == 1 + 3 + 2 * 2 and own.evaluator.counts.runs == runs + 2 * 3
    assert isinstance(plain, Answer)
    for one, other in zip(near, whole, strict=True):
        assert isinstance(one, Answer) and isinstance(other, Answer)
        shift = abs(other.eta - plain.eta).max()
        assert shift > 0.005 and abs(one.eta - other.eta).max() < 0.01 * shift
        tilt = abs(other.jacobian - plain.jacobian).max()
        assert abs(one.jacobian - other.jacobian).max() < 0.05 * tilt
