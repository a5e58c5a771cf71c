"""Membranes: a law without stress across, a pressurised cylinder in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from tyrecal_solvers.bundled.section.laws.mooney_rivlin import MooneyRivlin
from tyrecal_solvers.bundled.section.laws.plane_stress import PlaneStress
from tyrecal_solvers.bundled.section.model import build
from tyrecal_solvers.language.text import read_keywords

C10, THICKNESS, RADIUS, LENGTH = 8e5, 1e-3, 0.3, 0.1
CYLINDER = f"""*NODE
1, {RADIUS}, 0.
2, {RADIUS}, {LENGTH}
*ELEMENT, TYPE=MGAX1, ELSET=PLY
1, 1, 2
*MEMBRANE SECTION, ELSET=PLY, MATERIAL=GUM
{THICKNESS}
*MATERIAL, NAME=GUM
*HYPERELASTIC, NEO HOOKE
{C10}
*DENSITY
1100.
"""


def test_force_and_tangent_are_derivatives() -> None:
    """Force and tangent agree with central differences and with the complex step that forms
    sensitivities."""
    rng = np.random.default_rng(1)
    flat = np.array([1.0, 0, 0, 0, 1.0, 0])
    z = flat + 0.1 * rng.standard_normal((4, 6))
    law = PlaneStress(MooneyRivlin(np.full(4, C10), np.full(4, C10 / 4), np.full(4, 4e8)))
    force, tangent = law.force(z), law.tangent(z)
    for i in range(6):
        step = 1e-6 * np.eye(6)[i]
        by_energy = (law.energy(z + step) - law.energy(z - step)) / 2e-6
        np.testing.assert_allclose(by_energy, force[:, i], rtol=1e-6, atol=1e-3 * C10 * 1e-3)
        imaginary = law.force(z + 1e-30j * np.eye(6)[i]).imag / 1e-30
        np.testing.assert_allclose(imaginary, tangent[:, :, i], rtol=1e-7, atol=1e-7 * C10)


@pytest.mark.parametrize("stretch", [1.02, 1.3])
def test_a_pressurised_cylinder(stretch: float) -> None:
    """p r L of each radian balances the wall: p = h / (R stretch) dW/dstretch, incompressible."""
    model = build(read_keywords(CYLINDER), None, True)
    (membrane,) = model.parts
    U = np.zeros((2, 3))
    U[:, 0] = (stretch - 1) * RADIUS
    radial = membrane.force(U).reshape(2, 3)[:, 0].sum()
    pressure = radial / (stretch * RADIUS * LENGTH)
    exact = THICKNESS / (RADIUS * stretch) * 2 * C10 * (stretch - stretch**-3)
    assert pressure == pytest.approx(exact, rel=0.003)
    assert membrane.mass is not None
    assert membrane.mass.sum() == pytest.approx(1100 * THICKNESS * RADIUS * LENGTH)
