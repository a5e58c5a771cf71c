"""Errors of the model's form and of material laws: which rows they have in common."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.studies.inference.covariance import covariance, model_form
from tyrecal.studies.inference.inverse_problem import Toggle
from tyrecal.studies.inference.observations import Observable

from .toy import LABELS, Toy, problem

pytestmark = pytest.mark.numbers


def test_covariance_is_what_it_says() -> None:
    """Model-form error: exp(-ln(1.5)^2 / (2 0.6^2)) between 160 and 240 kPa, 0.97 between runs,
    none between modes."""
    toy = Toy(pressures=(160.0, 240.0))
    p = problem(toy, changes=(Toggle("e0", 0.0),), noise=1e-9)
    S = covariance(p.observations, 0 * p.constants, 0.0, form=0.01) / 1e-4
    n = len(toy.base)
    smooth = np.exp(-(np.log(1.5) ** 2) / (2 * 0.54**2))
    assert S[0, len(LABELS)] == pytest.approx(smooth)
    assert S[0, n] == pytest.approx(0.97)
    assert S[0, n + len(LABELS)] == pytest.approx(0.97 * smooth)
    assert S[0, 1] == 0 and np.linalg.eigvalsh(S).min() > 0


def test_material_laws_are_off_in_all_modes_by_family_and_by_mode_smoothly() -> None:
    """3 % each beside the form on record, 0.4 in ln p apart: exp(-0.4^2 / (2 0.8^2)) alike; [0,0]
    torsional and [1,0] move in the plane, [1,1] does not; a stated form stands for both; the mass
    has neither."""
    toy = Toy(pressures=(160.0, 160.0 * np.exp(0.4)))
    p = problem(toy, noise=1e-9)
    mass = Observable("mass_kg", None, 0.0)
    rows = (*p.observations.rows, mass)
    added = (model_form(rows, 0.03) - model_form(rows, 0.0)) / 0.03**2
    n, near = len(LABELS), np.exp(-(0.4**2) / (2 * 0.8**2))
    names = [str(label) for label in LABELS]
    torsional, lateral, vertical = map(names.index, ("[0,0] torsional", "[1,1]", "[1,0]"))
    assert added[0, 0] == added[n, n] == pytest.approx(3.0)
    assert added[0, n] == pytest.approx(3 * near)
    assert added[vertical, torsional] == added[0, lateral] == pytest.approx(2.0)
    assert added[lateral, vertical] == pytest.approx(1.0)
    assert added[lateral, vertical + n] == pytest.approx(near)
    assert not added[-1].any() and np.linalg.eigvalsh(added).min() > -1e-12
    assert np.array_equal(model_form(rows, 0.03, form=0.01), model_form(rows, 0.0, form=0.01))
