"""The gap's contrasts by hand, and that the mass is none of the modes."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.simulate.modes.label import Label
from tyrecal.studies.diagnose.gap import _as_number, _contrasts, family
from tyrecal.studies.inference.observations import Observable

from ..chance import generator
from .toy import LABELS

pytestmark = pytest.mark.numbers

ROWS = tuple(
    Observable("frequency_Hz", label, p) for p in (160.0, 240.0, 320.0) for label in LABELS
)
MASS = Observable("mass_kg", None, 240.0)


def found(rows: tuple[Observable, ...], r: np.ndarray) -> dict[str, float]:
    return {c.name: c.percent for c in _contrasts(rows, r, np.eye(len(rows)))}


def test_groups_of_residuals_come_in_order() -> None:
    """Names first, then numbers as they rise."""
    assert sorted(["10", "0.5", "b", "2", "a"], key=_as_number) == ["a", "b", "0.5", "2", "10"]


def test_the_mass_is_in_no_contrast() -> None:
    r = generator(0).standard_normal(len(ROWS))
    with_mass = found((*ROWS, MASS), np.append(r, 1e3))
    assert with_mass == pytest.approx(found(ROWS, r), rel=1e-12)
    assert len(with_mass) == 6


def test_contrasts_are_means_and_slopes() -> None:
    """Residuals that grow linearly with c and ln p, with a step of the lateral modes."""
    lateral = np.array([family(row) == "lateral" for row in ROWS])
    plane = np.array([family(row) == "in-plane" for row in ROWS])
    c = np.array([row.label.c for row in ROWS if row.label])
    p = np.array([row.pressure_kPa for row in ROWS])
    by = lambda r: found(ROWS, r)
    assert sum(plane) == 4 * 3 and sum(lateral) == 3 * 3
    grows = by(0.02 * np.log(p))
    assert grows.pop("growth with pressure, 320 over 160 kPa") == pytest.approx(2 * np.log(2))
    assert grows.pop("all modes") == pytest.approx(2 * np.log(p).mean())
    assert list(grows.values()) == pytest.approx([0.0] * 4, abs=1e-9)
    rises = by(0.01 * c)
    assert rises["slope over the harmonic, c = 4 over c = 1"] == pytest.approx(3.0)
    assert rises["c = 1 less c of 2 and more"] == pytest.approx(1 - c[c > 1].mean())
    assert rises["c = 0 less the others"] == pytest.approx(-c[c > 0].mean())
    steps = by(0.01 * lateral)
    assert steps["lateral less in-plane"] == pytest.approx(1.0)
    assert steps["all modes"] == pytest.approx(lateral.mean())


def test_the_spread_of_a_contrast_is_that_of_its_weights() -> None:
    """The mean of k independent residuals scatters by 1 / sqrt(k)."""
    contrasts = {c.name: c for c in _contrasts(ROWS, np.ones(len(ROWS)), 4e-4 * np.eye(len(ROWS)))}
    whole = contrasts["all modes"]
    assert whole.sigma_percent == pytest.approx(2 / np.sqrt(27))
    assert whole.percent == pytest.approx(100.0) and whole.p_value < 1e-9


def test_a_contrast_without_modes_is_left_out() -> None:
    rows = tuple(row for row in ROWS if row.label and row.label.c == 0)
    names = list(found(rows, np.ones(len(rows))))
    assert names == ["all modes", "growth with pressure, 320 over 160 kPa"]


def test_six_modes_at_one_pressure_have_no_growth_with_it() -> None:
    """Nor what rounding makes of the mean of equal logarithms."""
    rows = tuple(Observable("frequency_Hz", Label(c, 0), 160.0) for c in range(3, 9))
    assert not [name for name in found(rows, np.ones(6)) if name.startswith("growth")]
